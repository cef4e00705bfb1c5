"""Proved lower bounds on expected costs: against closed forms, simulations and other bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, make_game
from ppg_env.env.episodes import evaluate
from ppg_env.env.players import GoToGoal, View
from ppg_env.env.rules import Rules
from solvers.feedback.bounds.lower_bound import social_lower_bound, solo_lower_bound


def line(start: float = 0.0, **changes: object) -> Game:
    """One agent on a line, bound for 20."""
    options = {"control": Polytope.box([6.0]), "noise": 1.0, "lam": 0.5, "gain": 0.5} | changes
    agent = Agent(
        start=np.array([start]), goal=np.array([20.0]), shape=Polytope.box([1.0]), **options
    )
    return Game((agent,), horizon=12, objective="risk", crash_cost=100.0)


def value_on_a_line(start: float, tolerance: float, leave: float, steps: int) -> float:
    """Return the least cost of :func:`line` in steps: plain dynamic programming, fine and long."""
    h = 0.05
    x = np.arange(-40.0, 80.0 + h / 2, h)
    noise = np.arange(-160, 161) * h
    weights = np.exp(-(noise**2) / 2)
    weights /= weights.sum()
    inside = np.abs(x - 20.0) <= tolerance + 1e-9
    edge = np.isclose(np.abs(x - 20.0), tolerance)
    value = np.zeros(len(x))
    for _ in range(steps):
        after = np.where(inside, np.where(edge, value / 2, 0.0), value)
        after = np.convolve(np.pad(after, 160, mode="edge"), weights, mode="valid")
        reach = round(3.0 / h)
        windows = np.lib.stride_tricks.sliding_window_view(
            np.pad(after, reach, constant_values=np.inf), 2 * reach + 1
        )
        value = np.minimum(leave, 1.0 + windows.min(axis=1))
    return float(np.interp(start, x, value))


@pytest.mark.parametrize(("lam", "start"), [(0.5, 0.0), (0.5, 13.0), (0.95, -10.0)])
def test_the_bound_on_a_line_is_a_percent_below_the_value(lam: float, start: float) -> None:
    game, rules = line(start, lam=lam), Rules(tolerance=2.0)
    value = value_on_a_line(start, 2.0, (1 - lam) / lam * 100, 24)
    bound = solo_lower_bound(game, 0, rules) / lam
    assert 0.985 * value <= bound <= value + 2e-3


def test_without_noise_the_steps_are_counted() -> None:
    game = line(noise=0.0)
    assert solo_lower_bound(game, 0, Rules(tolerance=2.0)) == pytest.approx(0.5 * 6)
    assert solo_lower_bound(game, 0, Rules(tolerance=2.1)) == pytest.approx(0.5 * 6)
    assert solo_lower_bound(game, 0, Rules(tolerance=5.1)) == pytest.approx(0.5 * 5)
    assert solo_lower_bound(game, 0, Rules(tolerance=5.1, max_cycles=3)) == pytest.approx(0.5 * 3)


def test_effort_counts_without_noise() -> None:
    game = line(noise=0.0, effort=0.1)
    assert solo_lower_bound(game, 0, Rules(tolerance=2.0)) == pytest.approx(
        3.0 + 0.1 * 18, abs=1e-5
    )


def test_a_cheap_crash_ends_the_way() -> None:
    game = replace(line(noise=0.0), crash_cost=2.0)
    assert solo_lower_bound(game, 0) == pytest.approx(0.5 + 1.0)
    assert solo_lower_bound(game, 0, Rules(on_crash="continue")) == pytest.approx(3.5)
    noisy = replace(line(), crash_cost=2.0)
    assert solo_lower_bound(noisy, 0) == pytest.approx(1.0, abs=0.51)


def test_an_agent_at_its_goal_costs_nothing_and_one_on_schedule_its_time() -> None:
    assert solo_lower_bound(line(20.0), 0) == 0.0
    rules = Rules(arrival="schedule", schedule=(7,))
    assert solo_lower_bound(line(), 0, rules) == pytest.approx(3.5)
    assert solo_lower_bound(line(), 0, Rules(saturation="none")) == pytest.approx(0.5)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_double_integrator_needs_at_least_as_many_steps_as_without_noise() -> None:
    agent = Agent(
        start=np.zeros(2),
        goal=np.array([12.0]),
        shape=Polytope.box([1.0]),
        control=Polytope.box([2.0]),
        A=np.array([[1.0, 1.0], [0.0, 1.0]]),
        B=np.array([[0.5], [1.0]]),
        noise=np.diag([0.2, 0.2]),
        gain=np.array([[0.2, 0.6]]),
    )
    game = Game((agent,), horizon=10, objective="risk")
    rules = Rules(tolerance=1.0)
    still = Game((replace(agent, noise=0.0),), horizon=10, objective="risk")
    bound, certain = (solo_lower_bound(g, 0, rules) for g in (game, still))
    assert certain == pytest.approx(0.5 * 5)  # t^2 / 2 >= 11
    assert 0.85 * certain <= bound <= certain + 0.5


def meeting(**changes: object) -> Game:
    """Two agents with coarse noise that meet half-way, far from their goals."""
    options = {"control": Polytope.l1(10.0), "noise": 9.0, "lam": 0.8, "gain": 0.5} | changes
    agents = [
        Agent(
            start=np.array(start), goal=np.array(goal), shape=Polytope.box([20.0, 20.0]), **options
        )
        for start, goal in (([0.0, 0.0], [110.0, 0.0]), ([110.0, 0.0], [0.0, 0.0]))
    ]
    return Game(tuple(agents), horizon=15, objective="risk")


@pytest.mark.nightly
@pytest.mark.slow
def test_agents_that_meet_lose_more_than_they_need_alone_and_no_player_is_below() -> None:
    game = meeting()
    alone = 2 * solo_lower_bound(game, 0)
    both = social_lower_bound(game)
    assert both >= alone + 0.5
    for players in ([GoToGoal(game, 0), GoToGoal(game, 1)], [Aside(game, 0), Aside(game, 1)]):
        cost = evaluate(game, players, 4096).summary().cost_mean
        assert both / 2 <= cost.high


@pytest.mark.nightly
@pytest.mark.slow
def test_agents_that_never_meet_need_what_they_need_alone() -> None:
    game = meeting()
    apart = replace(game.agents[1], start=np.array([110.0, 300.0]), goal=np.array([0.0, 300.0]))
    far = replace(game, agents=(game.agents[0], apart))
    alone = sum(solo_lower_bound(far, i) for i in range(2))
    assert social_lower_bound(far) == pytest.approx(alone, abs=1e-9)


class Aside:
    """Goes straight, and aside while the other is ahead and near its lane."""

    information = "full state"

    def __init__(self, game: Game, agent: int) -> None:
        self._agent, self._way = agent, GoToGoal(game, agent)

    def act(self, view: View) -> np.ndarray:
        own, other = view.state[:, self._agent], view.state[:, 1 - self._agent]
        side = 1.0 if self._agent else -1.0
        gap = side * (own[:, 1] - other[:, 1])
        ahead = (1 - 2 * self._agent) * (other[:, 0] - own[:, 0])
        dodge = (ahead > -20.0) & (ahead < 80.0) & (gap < 26.0) & view.in_traffic.all(axis=1)
        aside = np.array([2.0 - 4.0 * self._agent, 8.0 * side])
        return np.where(dodge[:, None], aside, self._way.act(view))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("name", ["head_on", "intersection", "parallel"])
@pytest.mark.parametrize("speed", ["box", "l1"])
def test_no_player_is_below_the_bound(name: str, speed: str) -> None:
    game = make_game(name, speed=speed, objective="risk", lam=0.8)
    players = [GoToGoal(game, i) for i in range(2)]
    cost = evaluate(game, players, 4096).summary().cost_mean
    assert social_lower_bound(game) / 2 <= cost.high
