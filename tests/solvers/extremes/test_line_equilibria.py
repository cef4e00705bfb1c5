"""Games on a line, all of whose equilibria on a grid are enumerated by independent code."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

from solvers import EquilibriumBounds, equilibrium_bounds
from tests.marks import slow_if
from tests.oracles.brute_force import Line

GAMES = {
    "swap": Line(starts=(0, 7), goals=(6, 1), limits=(2, 2), horizon=5),
    "slow": Line(starts=(0, 5), goals=(4, 1), limits=(2, 1), horizon=5, lam=(0.5, 0.8)),
    "follow": Line(starts=(0, 2), goals=(6, 4), limits=(2, 1), horizon=5, lam=(0.8, 0.3)),
    "risk": Line(starts=(0, 5), goals=(4, 1), limits=(2, 1), horizon=5, objective="risk"),
}


def paths(line: Line, agent: int) -> list[tuple[int, ...]]:
    """All paths over whole positions, up to the arrival."""
    found, ways = [], [(line.starts[agent],)]
    while ways:
        way = ways.pop()
        t = len(way) - 1
        if way[-1] == line.goals[agent]:
            found.append(way)
        elif t < line.horizon:
            ways += [(*way, way[-1] + u) for u in line.moves(agent, t, 1.0)]
    return found


@cache
def bounds_of(name: str) -> EquilibriumBounds:
    """The bounds of a game, computed once for several tests."""
    return equilibrium_bounds(GAMES[name].game, runs=2, gap=0.02)


def equilibrium_costs(line: Line) -> np.ndarray:
    """Social costs of the profiles on the grid from which no agent gains on the grid."""
    sets = [paths(line, agent) for agent in (0, 1)]
    losses = np.zeros((len(sets[0]), len(sets[1])))
    for (k, x), (n, y) in product(enumerate(sets[0]), enumerate(sets[1])):
        end = min(len(x), len(y)) - 1
        losses[k, n] = sum(line.loss(t, x[t] - y[t]) for t in range(end))
    times = [np.array([len(way) - 1 for way in each]) for each in sets]
    first = line.lam[0] * times[0][:, None] + (1 - line.lam[0]) * losses
    second = line.lam[1] * times[1] + (1 - line.lam[1]) * losses
    stable = (first <= first.min(axis=0) + 1e-9) & (second <= second.min(axis=1)[:, None] + 1e-9)
    stable &= np.isfinite(losses)
    return (first + second)[stable]


@pytest.mark.parametrize("name", slow_if(lambda name: name in ("swap", "risk"), list(GAMES)))
def test_the_intervals_contain_every_equilibrium_on_the_grid(name):
    costs = equilibrium_costs(GAMES[name])
    bounds = bounds_of(name)
    assert len(costs)
    assert bounds.refined
    assert bounds.best.low <= costs.min() + 1e-6
    assert bounds.worst.high >= costs.max() - 1e-6
    found = [kind.solution.evaluation.social_cost for kind in bounds.sampled]
    assert bounds.best.low <= min(found) == bounds.best.high
    assert bounds.worst.low == max(found) <= bounds.worst.high
    assert bounds.optimum.low <= bounds.best.low + 1e-6


@pytest.mark.parametrize("name", ["slow", "follow"])
def test_the_intervals_are_narrow(name):
    """In `follow`, the optimum is no equilibrium: the best one costs a quarter more."""
    costs = equilibrium_costs(GAMES[name])
    bounds = bounds_of(name)
    assert bounds.best.high == pytest.approx(costs.min())
    assert bounds.worst.low == pytest.approx(costs.max())
    assert max(bounds.best.gap, bounds.worst.gap) <= 0.02 + 1e-5
    assert bounds.open == 0


def test_the_search_is_deterministic():
    first = bounds_of("follow")
    again = equilibrium_bounds(GAMES["follow"].game, runs=2, gap=0.02)
    assert (first.best, first.worst, first.risk) == (again.best, again.worst, again.risk)
    assert first.inequalities == again.inequalities > 0
