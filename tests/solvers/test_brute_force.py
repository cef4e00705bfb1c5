"""Tiny games on a line, where dynamic programming over integer positions is exact."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest

from ppg_env import make_profile
from solvers import best_response, potential_equilibrium, social_optimum
from solvers.solution import Status
from tests.marks import first
from tests.oracles.brute_force import Line, best_response_value, joint_optimum

COURSES = {
    "swap": Line(starts=(0, 7), goals=(6, 1), limits=(2, 2)),
    "give way": Line(starts=(0, 8), goals=(6, 4), limits=(2, 1), horizon=7),
    "follow": Line(starts=(0, 2), goals=(8, 6), limits=(2, 1), horizon=7),
    "tire": Line(starts=(0, 7), goals=(5, 1), limits=(2, 2), later=(2, (1, 1)), horizon=7),
    "red light": Line(starts=(0, 2), goals=(8, 6), limits=(0, 1), later=(2, (3, 1)), horizon=7),
}
LAMS = [(0.0, 0.4), (0.5, 0.8), (0.9, 0.9)]
NOISES = {  # units of margin of 0, 1, 2, and 1 again without the sqrt(2)
    "none": {"noise": (0.0, 0.0)},
    "unit 1": {"noise": (0.25, 0.25)},
    "unit 2": {"noise": (1.5, 0.5)},
    "paper scale": {"noise": (0.75, 0.25), "scale": "paper"},
}
GROWING = {"noise": (0.2, 0.3), "gain": 0.0}
PLANNERS = {"social": social_optimum, "potential": potential_equilibrium}


def paths(line: Line, agent: int) -> list[list[float]]:
    """A few plans on the grid: straight ahead, late, back first, and in the smallest steps."""
    start, goal = line.starts[agent], line.goals[agent]
    away = -1 if goal > start else 1
    ways = [[], [0], [0, 0], [away], [-away, -away]]
    found = []
    for way in ways:
        places = [start]
        for t in range(line.horizon):
            limit = line.moves(agent, t, 1.0)[-1]
            ahead = int(np.clip(goal - places[-1], -limit, limit))
            places.append(places[-1] + (way[t] if t < len(way) else ahead))
        if places[-1] == goal:
            first = places.index(goal)
            found.append([float(p) for p in places[: first + 1] + [goal] * (line.horizon - first)])
    return found


def against(line: Line, agent: int, other: list[float]):
    """Arguments of a best response to the path ``other``; the agent's own plan is to stay."""
    game, controls = line.game, [np.zeros((line.horizon, 1)), np.zeros((line.horizon, 1))]
    controls[1 - agent] = np.diff(other)[:, None]
    return game, agent, make_profile(game, controls)


@pytest.mark.parametrize("course", first(1, COURSES))
@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("lam", LAMS)
@pytest.mark.parametrize("what", PLANNERS)
def test_mp3_and_the_potential_program_agree_with_dynamic_programming(course, noise, lam, what):
    line = replace(COURSES[course], lam=lam, **NOISES[noise])
    solution = PLANNERS[what](line.game)
    assert solution.status is Status.OPTIMAL
    assert solution.value == pytest.approx(joint_optimum(line, what), abs=1e-6)
    assert solution.bound == pytest.approx(solution.value, abs=1e-6)


@pytest.mark.parametrize("course", first(1, COURSES))
@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("lam", LAMS)
@pytest.mark.parametrize("agent", [0, 1])
def test_mp2_agrees_with_dynamic_programming_against_every_path(course, noise, lam, agent):
    line = replace(COURSES[course], lam=lam, **NOISES[noise])
    for other in paths(line, 1 - agent):
        response = best_response(*against(line, agent, other))
        assert response.value == pytest.approx(best_response_value(line, agent, other), abs=1e-6)
        assert response.bound == pytest.approx(response.value, abs=1e-6)


@pytest.mark.parametrize("course", first(1, COURSES))
@pytest.mark.parametrize("noise", ["unit 1", "unit 2", "growing"])
@pytest.mark.parametrize("lam", [(0.3, 0.3), (0.5, 0.8)])
@pytest.mark.parametrize("agent", [0, 1])
def test_mp2_with_risk_lies_between_the_grid_and_its_error(course, noise, lam, agent):
    more = GROWING if noise == "growing" else NOISES[noise]
    line = replace(COURSES[course], lam=lam, objective="risk", cap=4.0, **more)
    step = 1 / 8
    for other in paths(line, 1 - agent)[:3]:
        response = best_response(*against(line, agent, other))
        grid = best_response_value(line, agent, other, step)
        assert response.value <= grid + 1e-6
        assert response.value >= grid - (1 - lam[agent]) * grid_error(line, step)


@pytest.mark.parametrize("course", first(1, COURSES))
@pytest.mark.parametrize("noise", ["unit 1", "unit 2", "growing"])
@pytest.mark.parametrize("what", PLANNERS)
def test_mp3_with_risk_lies_between_the_grid_and_its_error(course, noise, what):
    more = GROWING if noise == "growing" else NOISES[noise]
    line = replace(COURSES[course], lam=(0.5, 0.5), objective="risk", cap=4.0, **more)
    step = 1 / 2
    solution, grid = PLANNERS[what](line.game), joint_optimum(line, what, step)
    assert solution.status is Status.OPTIMAL
    assert solution.value <= grid + 1e-6
    assert solution.value >= grid - grid_error(line, step)


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("goal", ["margin", "risk"])
@pytest.mark.parametrize("gain", [0.0, 1.0])
def test_on_a_line_an_evaluation_is_what_a_loop_adds_up(course, goal, gain):
    line = replace(COURSES[course], lam=(0.3, 0.6), objective=goal, gain=gain, cap=3.0)
    solution = social_optimum(line.game)
    x, y = (plan.means[:, 0] for plan in solution.profile)
    ends = [plan.arrival for plan in solution.profile]
    pair = sum(line.loss(t, x[t] - y[t]) for t in range(min(ends)))
    for i in (0, 1):
        own = line.lam[i] * ends[i] + (1 - line.lam[i]) * pair
        assert solution.evaluation.shifted_cost[i] == pytest.approx(own, abs=1e-6)


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("goal", ["margin", "risk"])
def test_no_path_on_a_fine_grid_beats_a_plan_of_the_potential_equilibrium(course, goal):
    line = replace(COURSES[course], lam=(0.4, 0.7), objective=goal)
    solution = potential_equilibrium(line.game)
    for agent in (0, 1):
        other = solution.profile[1 - agent]
        places = [float(p) for p in other.means[:, 0]]
        places[other.arrival :] = [float(line.goals[1 - agent])] * (
            line.horizon + 1 - other.arrival
        )
        grid = best_response_value(line, agent, places, 1 / 8)
        assert solution.evaluation.shifted_cost[agent] <= grid + 1e-5


@pytest.mark.parametrize("what", PLANNERS)
def test_what_dynamic_programming_finds_infeasible_is_infeasible(what):
    # Both have exactly the time they need, so neither can wait, and they meet at t = 2.
    line = Line(starts=(0, 4), goals=(6, -2), limits=(1, 1), horizon=6)
    assert joint_optimum(line, what) == inf
    assert PLANNERS[what](line.game).status is Status.INFEASIBLE
    relaxed = replace(line, horizon=7)
    assert PLANNERS[what](relaxed.game).value == pytest.approx(joint_optimum(relaxed, what))


def grid_error(line: Line, step: float) -> float:
    """What moving every position down to the grid can add: the loss's slope times the step."""
    slope = line.crash_cost / sqrt(pi)
    return sum(slope * step / unit for unit in line.units if unit > 0)
