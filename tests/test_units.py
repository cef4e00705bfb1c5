"""Results depend neither on the unit of length or time, nor on where the origin lies."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from ppg_env import Agent, Game, InputError, Polytope, make_game, straight_plan
from ppg_env.formats.game_file import game_to_tables
from ppg_env.game import HalfSpaces, Obstacle, evaluate, make_profile
from solvers import best_response, best_response_dynamics, certify, social_optimum
from solvers.solution import Solution, Status
from tests.command import Ppg
from tests.marks import first

SCALES = [1e-9, 7.0, 1e9, 1e-7, 1e-3, 1e4, 1e7]
SHIFTS = [(0.0, 0.0), (1.5e7, -1.5e7), (-3.0e5, 0.0)]


def moved(game: Game, scale: float, shift: tuple[float, ...] = (0.0, 0.0)) -> Game:
    """The game with x' = scale (x + shift), written as a user would write it."""
    offset = np.array(shift)

    def body(polytope: Polytope, place: np.ndarray | float = 0.0) -> Polytope:
        return Polytope.from_vertices(scale * (polytope.vertices + place))

    agents = []
    for agent in game.agents:
        d, n = agent.dim, agent.state_dim
        whole = np.concatenate([offset, np.zeros(n - d)])
        agents.append(
            replace(
                agent,
                start=scale * (agent.start + whole),
                goal=scale * (agent.goal + whole[: agent.goal.size]),
                shape=body(agent.shape),
                control=body(agent.control),  # type: ignore[arg-type]
                noise=scale**2 * agent.noise,
                sigma0=scale**2 * agent.sigma0,
                effort=agent.effort / scale,
                within=tuple(
                    HalfSpaces(
                        w.normals, scale * (w.offsets + w.normals @ whole[: w.dim]), w.sigmas
                    )
                    for w in agent.within
                ),
            )
        )
    walls = [Obstacle(body(wall.shape, offset)) for wall in game.obstacles]
    return replace(game, agents=tuple(agents), obstacles=tuple(walls))


def in_time(agent: Agent, tick: float) -> Agent:
    """A double integrator with velocities per second and steps of ``tick`` seconds."""
    d = agent.dim
    turn = np.diag([1.0] * d + [1 / tick] * d)
    back = np.linalg.inv(turn)
    return replace(
        agent,
        start=turn @ agent.start,
        goal=turn @ agent.goal,
        A=turn @ agent.A @ back,
        B=turn @ agent.B * tick**2,
        control=Polytope.from_vertices(agent.control.vertices / tick**2),  # type: ignore[union-attr]
        gain=agent.gain @ back / tick**2,
        noise=turn @ agent.noise @ turn,
        within=tuple(HalfSpaces(w.normals @ back, w.offsets, w.sigmas) for w in agent.within),
    )


GAMES = {
    "head_on": lambda: make_game("head_on", speed="l1", objective="risk", lam=0.8),
    "swept": lambda: make_game(
        "head_on", speed="l1", objective="risk", lam=0.8, collisions="swept", on_goal="stay"
    ),
    "effort": lambda: make_game("opposing", collisions="swept", effort=0.02, reserve=1.0),
    "walls": lambda: make_game("corridor", objective="risk", lam=0.8, collisions="swept"),
}


def integrators() -> Game:
    """Two double integrators with speed limits that pass each other."""
    A = np.block([[np.eye(2), np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    B = np.vstack([0.5 * np.eye(2), np.eye(2)])
    limits = HalfSpaces.between([-np.inf, -np.inf, -3, -3], [np.inf, np.inf, 3, 3])
    agents = tuple(
        Agent(
            start=[-8.0 * side, 0.0, 0.0, 0.0], goal=[8.0 * side, 0.0, 0.0, 0.0],
            shape=Polytope.box([2.0, 2.0]), control=Polytope.box([2.0, 2.0]), A=A, B=B,
            gain=np.hstack([0.3 * np.eye(2), 0.8 * np.eye(2)]), noise=0.01, lam=0.8,
            within=(limits,),
        )
        for side in (1, -1)
    )  # fmt: skip
    return Game(agents, horizon=14, objective="risk", collisions="swept")


@cache
def standard(name: str) -> Game:
    """The game in its own units, the same object at each call."""
    return GAMES[name]()


@cache
def arrivals(game: Game) -> list[int | None]:
    return [plan and plan.arrival for plan in (straight_plan(a, game.horizon) for a in game.agents)]


@cache
def optimum(game: Game) -> Solution:
    return social_optimum(game)


@cache
def judged_optimum(game: Game) -> tuple[float, np.ndarray]:
    """The cost of the first agent's best response to the optimum, and the optimum's regrets."""
    profile = optimum(game).profile
    return best_response(game, 0, profile).value, certify(game, profile).regret


def assert_same_results(game: Game, other: Game) -> None:
    assert arrivals(game) == arrivals(other)
    optima = [optimum(g) for g in (game, other)]
    assert [s.status for s in optima] == [Status.OPTIMAL] * 2
    assert optima[1].value == pytest.approx(optima[0].value, abs=1e-6)
    assert optima[1].evaluation.violations() == ()
    profile = make_profile(
        other,
        [
            plan.controls
            * (float(np.abs(b.control.vertices).max() / np.abs(a.control.vertices).max()))
            for plan, a, b in zip(optima[0].profile, game.agents, other.agents, strict=True)
        ],
    )
    judged = evaluate(other, profile)
    assert judged.violations() == ()
    np.testing.assert_allclose(judged.shifted_cost, optima[0].evaluation.shifted_cost, atol=1e-6)
    response, regret = judged_optimum(game)
    assert best_response(other, 0, profile).value == pytest.approx(response, abs=1e-6)
    np.testing.assert_allclose(certify(other, profile).regret, regret, atol=1e-6)
    equilibrium = best_response_dynamics(other)
    assert equilibrium.status is Status.EQUILIBRIUM
    assert equilibrium.evaluation.violations() == ()


@pytest.mark.parametrize("scale", first(3, SCALES))
@pytest.mark.parametrize("name", first(1, ["head_on", "swept"]))
def test_results_do_not_depend_on_the_unit_of_length(name, scale):
    game = standard(name)
    assert_same_results(game, moved(game, scale))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("shift", SHIFTS)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("name", GAMES)
def test_results_do_not_depend_on_unit_and_origin(name, scale, shift):
    game = standard(name)
    assert_same_results(game, moved(game, scale, shift))


@pytest.mark.parametrize("tick", first(2, [1e-4, 0.05, 1.0, 3600.0]))
def test_results_do_not_depend_on_the_unit_of_time(tick):
    game = integrators()
    assert_same_results(game, replace(game, agents=tuple(in_time(a, tick) for a in game.agents)))


@pytest.mark.parametrize("shift", first(1, SHIFTS[1:]))
def test_results_do_not_depend_on_the_origin(shift):
    game = standard("head_on")
    assert_same_results(game, moved(game, 1.0, shift))


SENTENCE = r"^[^;]+, too (small|large) for double arithmetic; \w[^;]*\.$"


@pytest.mark.parametrize("size", first(2, [3e-12, 1e16, 1e-11]))
def test_bodies_within_the_limits_make_the_same_game(size):
    game = GAMES["head_on"]()
    other = moved(game, size / 15)
    values = []
    for each in (game, other):
        flights = [straight_plan(agent, each.horizon) for agent in each.agents]  # no tuple
        values.append(best_response(each, 0, flights).value)
        values.append(best_response(each, 1, flights).value)
    assert values[2:] == pytest.approx(values[:2], abs=1e-6)


@pytest.mark.parametrize("name", GAMES)
@pytest.mark.parametrize("size", [1e-20, 2e-13, 5e17, 1e18, 1e30])
def test_a_game_with_bodies_beyond_the_limits_is_refused_in_one_sentence(name, size):
    game = GAMES[name]()
    with pytest.raises(InputError, match=SENTENCE):
        moved(game, size / 15)


@pytest.mark.parametrize("size", [1e-20, 1e-11, 1e-8, 1e10, 1e18, 1e30])
def test_a_single_body_of_another_magnitude_is_refused_in_one_sentence(
    size: float, ppg: Ppg, tmp_path: Path
) -> None:
    """Among bodies of usual size: too small for its positions, or too large for its controls."""
    with pytest.raises(InputError, match=SENTENCE):
        make_game("head_on", shape={0: Polytope.box([size, size])})
    tables = game_to_tables(GAMES["head_on"]())
    tables["agent"][0]["shape"] = {"box": [size, size]}
    file = tmp_path / "extreme.toml"
    file.write_text(tomli_w.dumps(tables), encoding="utf-8")
    run = ppg("solve", file, code=2)
    (line,) = run.err.splitlines()
    assert re.match(r"^.*extreme\.toml: agent\[0\]\.[^;]+double arithmetic; \w[^;]*$", line)
    assert run.out == ""
