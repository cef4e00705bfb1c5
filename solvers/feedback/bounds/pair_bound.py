r"""A proved lower bound on what two agents in the plane lose to each other.

Up to a time t* before which neither can arrive, positions x_i move by x_i' = x_i + B_i u_i + w_i.
With fixed vectors l_i, of which no input gains more than one step, l_i B_i u <= 1 on U_i, put

    L_t(x_1, x_2) = sum_i lam_i l_i (g_i - x_i) + P_t(x_1 - x_2).

The linear terms lose exactly lam_i l_i B_i u_i in a step, whatever the noise, so L bounds the sum
of both costs to go from below if P does so for a game of the displacement D alone,

    P_t(D) = min_u  sum_i lam_i (1 - l_i B_i u_i) + E[ P_{t+1}(D'); D' not in K ] + C Pr(D' in K),

D' = D + B_1 u_1 - B_2 u_2 + w_1 - w_2: it says what a detour, or the risk of none, costs.  C is the
cost of a crash of both less the linear terms, at most; at t* P is a bound on what is missing
between the linear terms and the costs that both have alone
(:mod:`solvers.feedback.bounds.solo_table`).

This holds while the noise stays within some deviations of its law up to each time; the rest has a
small probability, whose share of L is subtracted.  Of K a box inside counts, at the time
steps only.  What happens after t* is not in the bound, nor what both need apart from D.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope, collision_set
from solvers.feedback.bounds.pair_grid import PairGrid
from solvers.feedback.bounds.pair_terms import Mover, farthest, make_mover, missing

FEWEST, MOST = 4.0, 5.5
"""Deviations within which noise is taken to stay: as many as leave the last time that the fewest
allow, but at most the most."""


def pair_lower_bound(game: Game, pair: tuple[int, int], rules: Rules) -> float:
    """Return a proved lower bound on the sum of two agents' expected costs; 0 if none is found.

    It needs agents in the plane with positions as states, uncorrelated noise, one control set each,
    and arrival in a region.
    """
    tolerances = checked_tolerances(game, rules)
    movers = [make_mover(game.agents[i], tolerances[i], rules) for i in pair]
    first, second = movers
    if first is None or second is None:
        return 0.0
    crash = sum((1 - game.agents[i].lam) * game.crash_cost for i in pair)
    leave = [
        (1 - game.agents[i].lam) * game.crash_cost if rules.on_crash == "remove" else float("inf")
        for i in pair
    ]
    return max(0.0, _bound(game, (first, second), crash, leave, rules))


def _bound(
    game: Game,
    movers: tuple[Mover, Mover],
    crash: float,
    leave: list[float],
    rules: Rules,
) -> float:
    """Return the bound; minus infinity near the goals, or where crashes are cheap."""
    time, sigmas = _last_before_arrival(movers)
    if time < 1:
        return -np.inf
    linear = sum(mover.agent.lam * mover.distance for mover in movers)
    collision = collision_set(movers[0].agent.shape, movers[1].agent.shape)
    rests = [
        missing(mover, rules.steps(game) - time, time, cost, sigmas)
        for mover, cost in zip(movers, leave, strict=True)
    ]
    hit = crash - _most_linear(movers, collision, time, sigmas)
    if len(game.agents) > 2 or game.obstacles:  # one of the two may crash into something else
        for k, mover in enumerate(movers):
            alone = farthest(mover, -mover.pull, time, sigmas) + mover.agent.lam * mover.distance
            hit = min(hit, leave[k] - alone + float(rests[1 - k].least[0].min()))
    if hit <= 0:
        return -np.inf
    grid = PairGrid(movers, collision, hit, time, tol.LENGTH * game.unit)
    meeting, most = grid.solve_pair(rests[0], rests[1], time)
    return linear + meeting - _escaped(movers, linear + most, time, sigmas)


def _last_before_arrival(movers: tuple[Mover, Mover]) -> tuple[int, float]:
    """Return the last time at which no noise within bounds lets one arrive, and these bounds."""

    def deviations(time: int) -> float:
        rooms = []
        for mover in movers:
            reach = float(np.abs(mover.pull) @ mover.tolerance) / mover.agent.lam
            rooms.append((mover.distance - reach - time) / (mover.along * np.sqrt(time)))
        return min(rooms) * (1 - 1e-9)

    time = 0
    while deviations(time + 1) >= FEWEST:
        time += 1
    return time, min(MOST, deviations(time)) if time else 0.0


def _most_linear(
    movers: tuple[Mover, Mover], collision: Polytope, time: int, sigmas: float
) -> float:
    """Return the most that the linear terms may be at a crash up to ``time``."""
    first, second = movers
    both = first.pull + second.pull
    ways = [sum(m.agent.lam * m.distance + farthest(m, -m.pull, time, sigmas) for m in movers)]
    goals = sum(float(mover.pull @ mover.agent.goal) for mover in movers)
    for mover, gap in ((second, -first.pull), (first, second.pull)):
        there = goals + float((collision.vertices @ gap).max() - both @ mover.agent.start)
        ways.append(there + farthest(mover, -both, time, sigmas))
    return min(ways)


def _escaped(movers: tuple[Mover, Mover], most: float, time: int, sigmas: float) -> float:
    """Return a bound on the expectation of L where the noise exceeds its bounds.

    At the first such time L is at most ``most`` plus the steps back and the noise of l x, whose
    expectation Cauchy and Schwarz bound.
    """
    from scipy.special import ndtr

    # Per agent and time: both sides of two components, and one of l w.
    chance = 2 * time * 5 * float(ndtr(-sigmas))
    back = sum(mover.agent.lam * mover.back for mover in movers) * time
    noise = sum(mover.agent.lam * mover.along for mover in movers) * np.sqrt(time)
    return chance * max(most + back, 0.0) + float(np.sqrt(chance)) * noise
