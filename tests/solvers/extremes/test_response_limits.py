"""What responses cost at most, against all plans on a grid; random games on a line."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from ppg_env.game import objective
from solvers import equilibrium_bounds
from solvers.budget import Budget
from solvers.extremes.hindrance import largest_margin, loss_shares
from solvers.extremes.response_limit import ResponseLimits
from tests.marks import first, slow_if
from tests.oracles.brute_force import Line
from tests.solvers.extremes.test_line_equilibria import GAMES, equilibrium_costs, paths

WIDTH = 0.05


def random_line(seed: int) -> Line:
    """A game with whole positions, in which both agents move and start apart."""
    rng = np.random.default_rng(seed)
    start, goal, limits = rng.integers(0, 6, 2), rng.integers(0, 6, 2), rng.integers(1, 3, 2)
    lam = rng.choice([0.3, 0.5, 0.8], 2)
    if abs(start[0] - start[1]) < 1 or (start == goal).any() or (abs(goal - start) > 4).any():
        return random_line(seed + 1000)
    return Line(tuple(start), tuple(goal), tuple(limits), lam=tuple(lam), horizon=4)


def largest_response(line: Line, i: int, arrival: int) -> float:
    """The most that agent ``i`` pays in response to a path on the grid with an arrival."""
    own, others = paths(line, i), paths(line, 1 - i)

    def cost(x: tuple[int, ...], y: tuple[int, ...]) -> float:
        end = min(len(x), len(y)) - 1
        losses = sum(line.loss(t, x[t] - y[t]) for t in range(end))
        return line.lam[i] * (len(x) - 1) + (1 - line.lam[i]) * losses

    late = [y for y in others if len(y) - 1 == arrival]
    return max((min(cost(x, y) for x in own) for y in late), default=-inf)


@pytest.mark.parametrize("name", slow_if(lambda name: name == "swap", ["swap", "slow", "follow"]))
@pytest.mark.parametrize("i", [0, 1])
def test_no_proof_claims_less_than_a_response_on_the_grid_costs(name, i):
    line, responses = GAMES[name], ResponseLimits(GAMES[name].game, epsilon=0.0)
    for arrival in range(3, line.horizon + 1):
        largest = largest_response(line, i, arrival)
        if -inf < largest < inf:
            assert not responses.proves(i, arrival, largest - WIDTH, 10, Budget(None))


def test_what_responses_cost_is_proved():
    """The proof ends right above what a path on the grid costs, and fails right below."""
    line, responses = GAMES["slow"], ResponseLimits(GAMES["slow"].game, epsilon=0.0)
    largest = largest_response(line, 0, 4)
    assert responses.proves(0, 4, largest + WIDTH, 40, Budget(None))
    assert not responses.proves(0, 4, largest - WIDTH, 40, Budget(None))
    assert responses.take_witnesses()
    assert not responses.take_witnesses()


@pytest.mark.parametrize("seed", first(1, range(1, 13)))
def test_random_games_keep_their_equilibria_inside(seed):
    line = random_line(seed)
    costs = equilibrium_costs(line)
    bounds = equilibrium_bounds(line.game, runs=1, gap=0.1)
    assert bounds.refined
    assert bounds.best.low <= bounds.best.high <= bounds.worst.low <= bounds.worst.high
    if len(costs):
        assert bounds.best.low <= costs.min() + 1e-6
        assert bounds.worst.high >= costs.max() - 1e-6


def test_shares_sum_to_the_room_and_allow_what_is_near():
    game, largest = GAMES["slow"].game, np.array([2.0, 0.1, np.inf, 2.0])
    shares = loss_shares(game, largest, np.array([0.5, 0.0, 0.0, 0.0]), 1.5)
    assert shares is not None
    assert shares.sum() == pytest.approx(1.5)
    assert shares[0] >= 0.5
    assert shares[1] == pytest.approx(0.1)
    assert loss_shares(game, largest, None, -0.1) is None


@pytest.mark.parametrize("name", ["slow", "risk"])
def test_margins_below_the_largest_lose_more(name):
    game = GAMES[name].game
    for loss in (0.1, 0.3, 1.7):
        margin = largest_margin(game, loss)
        assert float(objective.loss(game, np.array(margin))) == pytest.approx(loss)
    assert largest_margin(game, 1e3) == 0.0
