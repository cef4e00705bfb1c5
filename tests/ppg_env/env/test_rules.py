"""The compiled kernel against the slow oracle, for every rule, and single against batched."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, make_game
from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.rules import Rules, make_rules
from ppg_env.env.simulator import Simulator
from ppg_env.game.obstacle import Obstacle
from tests.marks import first, slow_if
from tests.oracles.slow_environment import SlowGame
from tests.ppg_env.env.conftest import LIFE_CYCLES, name, with_schedule

ROOT = Path(__file__).parents[3]
BOX, BALL = Polytope.box([20.0, 20.0]), Polytope.l1(10.0)
TRIANGLE = Polytope.from_vertices([(-8, -8), (8, -6), (0, 9)])


def crowded() -> Game:
    """Three different bodies and speed sets, a wall, unequal weights, correlated noise."""
    noise = np.array([[2.0, 0.7], [0.7, 1.0]])
    wall = Polytope.from_vertices([(-5, 18), (30, 18), (30, 26), (-5, 26)])
    a = Agent(np.array([0.0, 0.0]), np.array([40.0, 0.0]), Polytope.box([9, 9]), BOX, lam=0.3,
              gain=np.array(0.4), noise=noise)  # fmt: skip
    b = Agent(np.array([40.0, 6.0]), np.array([0.0, 6.0]), TRIANGLE, BALL, lam=0.6, noise=noise)
    c = Agent(np.array([20.0, -25.0]), np.array([20.0, 12.0]), Polytope.box([5, 8]),
              Polytope.disc(9.0, 7), lam=0.0)  # fmt: skip
    return Game((a, b, c), (wall,), horizon=6)


def gliders() -> Game:
    """Double integrators in the plane that must stop at their goals."""
    one = np.eye(2)
    A = np.block([[one, one], [0 * one, one]])
    B = np.vstack([0.5 * one, one])
    noise = np.diag([0.5, 0.5, 0.2, 0.2])

    def glider(start: list[float], goal: list[float]) -> Agent:
        return Agent(np.array(start), np.array(goal), Polytope.box([6, 6]), Polytope.l1(6.0),
                     noise=noise, A=A, B=B)  # fmt: skip

    return Game((glider([0, 0, 2, 0], [30, 0, 0, 0]), glider([30, 4, 0, 0], [0, 4])), horizon=8)


def cubes() -> Game:
    """Two agents in three dimensions, with an octahedral speed set."""

    def cube(start: list[float], goal: list[float]) -> Agent:
        return Agent(np.array(start), np.array(goal), Polytope.box([8, 8, 8]), Polytope.l1(9.0, 3))

    return Game((cube([0, 0, 0], [30, 0, 0]), cube([30, 5, 3], [0, 5, 3])), horizon=6)


def tired() -> Game:
    """Speed sets that change, at different times, within a kind and from one kind to another."""
    body, small = Polytope.box([9, 9]), Polytope.box([8.0, 4.0])
    a = Agent(np.array([0.0, 0.0]), np.array([40.0, 0.0]), body, ((0, BOX), (2, small)))
    b = Agent(np.array([40.0, 6.0]), np.array([0.0, 6.0]), TRIANGLE,
              ((0, BALL), (1, small), (4, Polytope.disc(9.0, 7))), lam=0.6)  # fmt: skip
    return Game((a, b), horizon=3)


def haunted() -> Game:
    """Moving obstacles: one drifts, one goes away, one comes back to hit what is parked."""
    game = crowded()
    walls = (
        Obstacle(TRIANGLE, [[60.0 - 9 * t, 14.0 - 2 * t] for t in range(7)], noise=1.5),
        Obstacle(Polytope.box([6, 6]), [[0.0, -20.0], [6.0, -12.0], [12.0, -4.0]], until=3),
        Obstacle(Polytope.box([8, 8]), [[20.0, 80.0 - 12 * t] for t in range(6)]),
    )
    agents = [replace(agent, effort=0.1 * i) for i, agent in enumerate(game.agents)]
    return replace(game, agents=tuple(agents), obstacles=(*game.obstacles, *walls))


def swept(make: Any) -> Any:
    return lambda: replace(make(), collisions="swept")


GAMES = {"crowded": crowded, "gliders": gliders, "cubes": cubes, "tired": tired, "haunted": haunted}
QUICK = ("crowded", "tired", "tired-swept")
UNUSUAL = ("gliders", "cubes-swept")
GAMES |= {f"{name}-swept": swept(make) for name, make in GAMES.items()}


@pytest.mark.parametrize("saturation", first(1, ["clip", "none"]))
@pytest.mark.parametrize("reward", ["risk", "margin"])
@pytest.mark.parametrize("kind", slow_if(lambda kind: kind not in QUICK, GAMES))
def test_the_kernel_plays_by_the_rules(kind: str, reward: str, saturation: str) -> None:
    game, seen = GAMES[kind](), {"arrived": 0, "crashed": 0, "truncated": 0, "terminated": 0}
    for k, options in enumerate(LIFE_CYCLES):
        cycle = with_schedule(options, len(game.agents), 4)
        rules = make_rules(game, **cycle, reward=reward, saturation=saturation, max_cycles=9)
        for key, count in play_beside_the_oracle(game, rules, seed=k).items():
            seen[key] += count
    assert min(seen.values()) > 0, "every kind of event must have been compared"


def test_in_other_dimensions_its_source_plays_by_the_rules() -> None:
    """As Python: the compiler takes half a minute for each number of dimensions."""
    kinds = " or ".join(f"{kind}-margin-clip" for kind in UNUSUAL)
    words = [
        "-m",
        "pytest",
        "-q",
        "-W",
        "ignore::RuntimeWarning",
        "-k",
        f"by_the_rules and ({kinds})",
    ]
    run = subprocess.run(
        [sys.executable, *words, __file__], cwd=ROOT, env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True, text=True,
    )  # fmt: skip
    assert f"{len(UNUSUAL)} passed" in run.stdout, run.stdout + run.stderr


def play_beside_the_oracle(game: Game, rules: Rules, seed: int) -> dict[str, int]:
    """Play three copies to the end, every output compared; how often each event came."""
    random, copies = np.random.default_rng(seed), 3
    simulator = Simulator(game, rules, copies)
    rules = simulator.rules
    seen = {"arrived": 0, "crashed": 0, "truncated": 0, "terminated": 0}
    simulator.reset()
    slow = [SlowGame(game, rules, simulator.tables.tolerance) for _ in range(copies)]
    N = len(game.agents)
    for _ in range(9):
        target = simulator.tables.goal - simulator.state
        actions = 0.35 * target[..., : simulator.action_size]
        actions += random.normal(0, 6, actions.shape)
        noise = random.standard_normal(simulator.noise_shape)
        before = simulator.alive.copy()
        out = simulator.step(actions, noise, restart=False)
        for c in np.flatnonzero(before.any(axis=1)):
            expected = slow[c].step(actions[c], noise[c], simulator.tables.root)
            for key in seen:
                flags = getattr(out, key)[c].tolist()
                assert flags == getattr(expected, key), (key, rules)
                seen[key] += sum(flags)
            np.testing.assert_allclose(out.reward[c], expected.reward, rtol=1e-6, atol=1e-4)
            for i in range(N):
                state = slow[c].states[i]
                np.testing.assert_allclose(simulator.state[c, i, : state.size], state, atol=1e-4)
                # The oracle's projection is good to 1e-6: keep both on the same track.
                slow[c].states[i] = simulator.state[c, i, : state.size].copy()
    return seen


def repeats(options: dict[str, Any]) -> bool:
    """Whether others have each of these options, too, and the oracle has them all."""
    return LIFE_CYCLES.index(options) % 5 != 0


@pytest.mark.parametrize("reward", ["risk", "margin"])
@pytest.mark.parametrize("options", slow_if(repeats, LIFE_CYCLES), ids=name)
def test_single_and_batched_agree_step_for_step(
    scenario: str, options: dict[str, Any], reward: str
) -> None:
    game = make_game(scenario)
    rules = with_schedule(options, len(game.agents)) | {"reward": reward}
    copies, steps = 3, 12
    batch = Simulator(game, make_rules(game, **rules), copies)
    singles = [PathPlanningEnv(game, **rules) for _ in range(copies)]
    observation = batch.reset()
    for c, env in enumerate(singles):
        first, _ = env.reset()
        assert all(np.array_equal(first[a], observation[c, i]) for i, a in enumerate(first))
    random = np.random.default_rng(0)
    seen: list[dict[str, tuple[bool, bool]]] = [{} for _ in singles]  # crashed, arrived so far
    for _ in range(steps):
        action = random.uniform(-12, 12, (copies, *batch.low.shape))
        noise = random.standard_normal(batch.state.shape)
        out = batch.step(action, noise)
        for c, env in enumerate(singles):
            if not env.agents:
                env.reset()
                seen[c] = {}
            env.simulator.random = Replay(noise[c : c + 1])
            acting = env.agents
            result = env.step({a: action[c, i] for i, a in names(env, acting)})
            for i, a in names(env, acting):
                assert result[1][a] == out.reward[c, i]
                assert result[2][a] == out.terminated[c, i]
                assert result[3][a] == out.truncated[c, i]
                assert result[4][a]["crashed_with"].any() == out.crashed[c, i]
                before = seen[c].get(a, (False, False))
                after = before[0] or out.crashed[c, i], before[1] or out.arrived[c, i]
                assert (result[4][a]["crashed"], result[4][a]["arrived"]) == after
                seen[c][a] = after
                last = out.final_observation if out.over[c] else out.observation
                assert np.array_equal(result[0][a], last[c, i])
            assert (not env.agents) == out.over[c]


class Replay:
    """Stands in for the generator and deals out recorded noise."""

    def __init__(self, noise: np.ndarray) -> None:
        self.noise = noise

    def standard_normal(self, out: np.ndarray) -> np.ndarray:
        out[:] = self.noise
        return out


def names(env: PathPlanningEnv, acting: list[str]) -> list[tuple[int, str]]:
    return [(i, a) for i, a in enumerate(env.possible_agents) if a in acting]


def duel(**options: Any) -> PathPlanningEnv:
    """Without noise: agent_0 reaches its goal in 2 steps; agent_1 then drives through it."""
    body, speed = Polytope.box([4, 4]), Polytope.box([20, 20])
    first = Agent(np.array([0.0, 0.0]), np.array([20.0, 0.0]), body, speed, noise=np.array(0.0))
    other = Agent(np.array([40.0, 0.0]), np.array([0.0, 0.0]), body, speed, noise=np.array(0.0))
    env = PathPlanningEnv(Game((first, other), horizon=10), tolerance=0.5, infos="names", **options)
    env.reset(seed=0)
    return env


def drive(env: PathPlanningEnv, speeds: list[tuple[float, float]]) -> list[Any]:
    """Drive along x; stops when the episode ends."""
    results = []
    for speed in speeds:
        if env.agents:
            moves = {f"agent_{i}": np.array([v, 0.0]) for i, v in enumerate(speed)}
            results.append(env.step({agent: moves[agent] for agent in env.agents}))
    return results


PARK_THEN_HIT = [(10.0, 0.0), (10.0, -5.0), (0.0, -10.0), (0.0, -5.0), (0.0, -10.0), (0.0, -10.0)]


def test_an_arrived_agent_leaves_and_its_body_with_it() -> None:
    results = drive(duel(on_goal="remove"), PARK_THEN_HIT)
    assert results[1][2] == {"agent_0": True, "agent_1": False}
    assert results[1][4]["agent_0"]["arrived"]
    assert not any(info["crashed"] for result in results for info in result[4].values())
    assert results[-1][2] == {"agent_1": True}


def test_a_parked_body_can_be_hit() -> None:
    results = drive(duel(on_goal="stay"), PARK_THEN_HIT)
    assert results[1][2] == {"agent_0": False, "agent_1": False}
    hit = results[3]
    assert hit[4]["agent_0"]["crashed_with"] == ["agent_1"]
    assert hit[4]["agent_1"]["crashed_with"] == ["agent_0"]
    assert hit[2] == {"agent_0": True, "agent_1": True}
    assert hit[1] == {"agent_0": -50.0, "agent_1": -50.5}


def test_a_parked_body_that_is_hit_stays_when_crashes_do_not_end_anything() -> None:
    results = drive(duel(on_goal="stay", on_crash="continue"), PARK_THEN_HIT)
    assert results[3][4]["agent_1"]["crashed"]
    assert results[3][2] == {"agent_0": False, "agent_1": False}
    assert results[-1][2] == {"agent_0": True, "agent_1": True}


def test_agents_that_share_wait_for_the_last() -> None:
    env = duel(sharing="social")
    results = drive(env, PARK_THEN_HIT)
    assert results[1][2] == {"agent_0": False, "agent_1": False}
    assert results[1][1] == {"agent_0": -1.0, "agent_1": -1.0}
    assert results[2][1] == {"agent_0": -0.5, "agent_1": -0.5}, "the other's time counts"
    assert not results[2][4]["agent_0"]["in_traffic"]
    assert results[-1][2] == {"agent_0": True, "agent_1": True}


def test_a_crash_removes_both_and_arrival_comes_before_collision() -> None:
    head_on = [(10.0, -10.0), (9.0, -10.0)]
    results = drive(duel(), head_on)
    assert results[1][4]["agent_0"]["crashed_with"] == ["agent_1"]
    assert results[1][2] == {"agent_0": True, "agent_1": True}
    arriving = drive(duel(), [(10.0, -10.0), (10.0, -10.0)])
    assert arriving[1][4]["agent_0"]["arrived"]
    assert not arriving[1][4]["agent_1"]["crashed"], "who arrives is out of the way at once"


def test_every_step_in_overlap_is_a_crash_when_agents_go_on() -> None:
    results = drive(duel(on_crash="continue"), [(9.0, -10.0), (9.0, -10.0), (0.0, 0.0), (0.0, 0.0)])
    assert [result[4]["agent_1"]["crashed"] for result in results] == [False, True, True, True]
    assert results[3][1] == {"agent_0": -50.5, "agent_1": -50.5}


def test_on_schedule_agents_leave_at_their_time_wherever_they_are() -> None:
    env = duel(arrival="schedule", schedule=(1, 3))
    results = drive(env, [(0.0, 0.0)] * 4)
    assert results[0][2] == {"agent_0": True, "agent_1": False}
    assert len(results) == 3


def test_a_time_limit_truncates_and_does_not_terminate() -> None:
    results = drive(duel(max_cycles=2), [(0.0, 0.0)] * 3)
    assert results[1][2] == {"agent_0": False, "agent_1": False}
    assert results[1][3] == {"agent_0": True, "agent_1": True}


def test_bodies_that_only_touch_do_not_crash() -> None:
    """Sides of 4: centres 4 apart touch along a face, and any closer they overlap."""
    results = drive(duel(), [(10.0, -10.0), (8.0, -8.0)])
    assert not results[1][4]["agent_0"]["crashed"]
    deeper = drive(duel(), [(10.0, -10.0), (8.0, -8.00001)])
    assert deeper[1][4]["agent_0"]["crashed"]


@pytest.mark.parametrize("speed", ["box", "l1", "disc"])
def test_inputs_are_projected_on_the_control_set(speed: str) -> None:
    env = PathPlanningEnv("head_on", speed=speed, noise=0.0)
    control = env.game.agents[0].control
    random = np.random.default_rng(0)
    for _ in range(50):
        env.reset(seed=0)
        wish = random.uniform(-25, 25, 2)
        before = env.simulator.state[0, 0].copy()
        env.step({"agent_0": wish, "agent_1": np.zeros(2)})
        moved = env.simulator.state[0, 0] - before
        assert control.clearance(moved) <= 1e-9
        # Nearest: no corner of the control set is on the far side of the supporting line.
        assert ((control.vertices - moved) @ (wish - moved)).max() <= 1e-6


def test_without_saturation_inputs_are_taken_as_they_are() -> None:
    env = PathPlanningEnv("head_on", noise=0.0, saturation="none")
    env.reset(seed=0)
    env.step({"agent_0": np.array([0.0, 33.0]), "agent_1": np.zeros(2)})
    assert env.simulator.state[0, 0].tolist() == [10.0, 83.0]


def test_the_time_limit_has_one_owner() -> None:
    env = duel()
    assert env.max_cycles == env.simulator.max_cycles == 2 * env.game.horizon
    env.max_cycles = 2
    assert env.rules is env.simulator.rules
    assert env.rules.max_cycles == env.simulator.max_cycles == 2
    results = drive(env, [(0.0, 0.0)] * 3)
    assert len(results) == 2
    assert results[1][3] == {"agent_0": True, "agent_1": True}
