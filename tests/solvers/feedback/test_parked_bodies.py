"""Dynamic programming where bodies stay at their goals, against exact chains and simulation.

On a line an agent has to pass the place where the other one is parked, and a crash is cheap enough
to do so.
"""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env.env.episodes import evaluate
from ppg_env.env.rules import Rules
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from solvers import (
    best_feedback_response,
    feedback_equilibrium,
    feedback_optimum,
    read_feedback,
    write_feedback,
)
from tests.marks import first
from tests.oracles.two_on_a_line import Line, solve
from tests.solvers.feedback.line_games import BODY, LAM, NOISE, line_agent

STARTS, GOALS, STEPS, WIDTH = (10.0, 50.0), (70.0, 42.0), 14, 1.0
SPEEDS, KAPPA = (8.0, 3.0), {"continue": 4.0, "remove": 20.0}


def passing(kappa, starts=STARTS, **more):
    agents = [line_agent(starts[i], GOALS[i], -SPEEDS[i], SPEEDS[i]) for i in range(2)]
    return Game(tuple(agents), objective="risk", crash_cost=kappa, horizon=10, **more)


def rules(on_goal="stay", on_crash="continue"):
    return Rules(on_goal=on_goal, on_crash=on_crash, max_cycles=STEPS, tolerance=3.0)


def chain(on_goal, on_crash):
    cells = np.arange(-8.0, 90.0, WIDTH) + WIDTH / 2
    first, second = (np.arange(-round(v / WIDTH), round(v / WIDTH) + 1) for v in SPEEDS)
    return Line(cells, GOALS, (first, second), 3.0, BODY, NOISE, LAM, (1 - LAM) * KAPPA[on_crash],
                on_goal == "stay", on_crash == "remove")  # fmt: skip


def at_starts(line: Line, costs):
    """Mean of the four cells next to the starts."""
    i, j = (int(np.searchsorted(line.cells, start)) for start in STARTS)
    return costs[False, False][:, i - 1 : i + 1, j - 1 : j + 1].mean(axis=(1, 2))


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
@pytest.mark.parametrize("on_crash", first(1, ["remove", "continue"]))
def test_the_optimum_agrees_with_an_exact_chain(on_goal, on_crash):
    line = chain(on_goal, on_crash)
    exact = at_starts(line, solve(line, STEPS))
    solution = feedback_optimum(passing(KAPPA[on_crash]), rules(on_goal, on_crash), step=1.0)
    assert sum(solution.value) == pytest.approx(exact.sum(), rel=0.015)
    assert solution.value == pytest.approx(exact, rel=0.05)


class Homewards:
    """Goes to its goal at full speed."""

    information = "own state"

    def __init__(self, agent: int) -> None:
        self._agent = agent

    def move(self, places):
        goal, speed = GOALS[self._agent], SPEEDS[self._agent]
        return np.clip(goal - places, -speed, speed)

    def act(self, view):
        return self.move(view.state[:, self._agent, :1])


@pytest.mark.parametrize("agent", [0, 1])
def test_a_response_agrees_with_an_exact_chain(agent):
    line, players = chain("stay", "continue"), [Homewards(0), Homewards(1)]

    def cells_moved(cells):
        return np.rint(players[1 - agent].move(cells) / WIDTH).astype(int)

    weights = (1.0, 0.0) if agent == 0 else (0.0, 1.0)
    exact = at_starts(line, solve(line, STEPS, weights, {1 - agent: cells_moved}))
    game = passing(KAPPA["continue"])
    response = best_feedback_response(game, agent, players, rules(), step=1.0)
    assert response.value[0] == pytest.approx(exact[agent], rel=0.015)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("collisions", ["instants", "swept"])
@pytest.mark.parametrize("solution", [feedback_optimum, feedback_equilibrium])
@pytest.mark.parametrize("on_crash", ["remove", "continue"])
def test_the_value_is_the_simulated_cost(collisions, solution, on_crash):
    game = passing(KAPPA[on_crash], collisions=collisions)
    solved = solution(game, rules(on_crash=on_crash), step=1.0)
    played = evaluate(game, solved.players(), 8192, seed=1, rules=solved.rules)
    assert sum(solved.value) == pytest.approx(played.cost.mean(axis=0).sum(), rel=0.02)


def test_policies_for_bodies_that_leave_pay_more_where_they_stay():
    game, stay = passing(KAPPA["continue"]), rules()
    costs = [
        evaluate(game, feedback_optimum(game, solved, step=1.0).players(), 2048, rules=stay).cost
        for solved in (rules("remove"), stay)
    ]
    gain = (costs[0] - costs[1]).sum(axis=1)
    assert gain.mean() > 4 * gain.std() / np.sqrt(gain.size)


@pytest.mark.nightly
@pytest.mark.slow
def test_an_equilibrium_leaves_nothing_to_gain():
    game = passing(KAPPA["continue"])
    equilibrium = feedback_equilibrium(game, rules(), step=1.0)
    assert equilibrium.without_equilibrium < 0.02
    for agent in range(2):
        response = best_feedback_response(game, agent, equilibrium.players(), rules())
        costs = [
            evaluate(game, players, 8192, seed=2, rules=rules()).cost[:, agent]
            for players in (equilibrium.players(), response.players())
        ]
        assert (costs[0] - costs[1]).mean() < 0.01 * costs[0].mean()


@pytest.mark.parametrize("on_goal", ["remove", "stay"])
def test_an_agent_that_starts_at_its_goal_has_arrived(on_goal):
    game = passing(KAPPA["continue"], starts=(10.0, GOALS[1]))
    solution = feedback_optimum(game, rules(on_goal), step=1.0)
    played = evaluate(game, solution.players(), 4096, seed=2, rules=solution.rules)
    assert solution.value == pytest.approx(played.cost.mean(axis=0), rel=0.02, abs=1e-9)
    assert (solution.value[1] > 0.0) == (on_goal == "stay")


def test_a_file_keeps_what_is_known_of_parked_bodies(tmp_path):
    solution = feedback_optimum(passing(KAPPA["continue"]), rules(), step=2.0)
    copy = read_feedback(write_feedback(tmp_path / "policy.npz", solution))
    costs = [
        evaluate(s.game, s.players(), 256, seed=4, rules=s.rules).cost for s in (solution, copy)
    ]
    assert np.array_equal(costs[0], costs[1])


def test_moving_obstacles_among_parked_bodies_are_refused():
    moving = Obstacle(Polytope.box([2.0]), path=np.array([[300.0], [310.0]]))
    with pytest.raises(InputError, match=r"obstacle\[0\]: moves, and arrived bodies stay"):
        feedback_optimum(passing(1.0, obstacles=(moving,)), rules())
