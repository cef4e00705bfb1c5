r"""Where the other agent must be for a deviation to cost more than allowed.

A plan of agent i leaves ``room`` for losses.  Let theta_t with sum theta_t <= room be shares of it.
Against a plan of the other agent with a larger sum of losses, some event t has a loss above
theta_t: every face is closer than the margin s_t of that loss, and

    a_p . (r_i(t) - r_j(t)) - b_p  <=  unit_p(t) s_t      for all p

is a polytope of positions r_j(t).  So the plans against which the deviation is too costly are
covered by one set of half-spaces for each event.
"""

from __future__ import annotations

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from solvers.extremes.guard import PAIR, Guard, directions_of
from solvers.extremes.plan_set import HalfSpace


def hindrances(guard: Guard, plan: Plan, room: float) -> list[tuple[HalfSpace, ...]] | None:
    """Return half-spaces, one set per event, that cover the plans which hinder ``plan``.

    There are none if the guard already bounds its losses by ``room`` >= 0; None if ``room`` < 0.
    """
    if room < 0:
        return None
    losses = guard.losses(plan)
    shares = _shares(losses, room)
    return [
        _closer(guard, plan, t, largest_margin(guard.game, shares[t]))
        for t in np.flatnonzero(losses > shares).tolist()
    ]


def _shares(losses: np.ndarray, room: float) -> np.ndarray:
    """Return (K,) shares of ``room``: small losses are allowed whole, others share the rest."""
    shares, rest = np.zeros(len(losses)), room
    order = losses.argsort(kind="stable")
    for n, t in enumerate(order.tolist()):
        shares[t] = min(losses[t], rest / (len(losses) - n))
        rest -= shares[t]
    return shares


def largest_margin(game: Game, loss: float) -> float:
    """Return the largest margin whose loss is at least ``loss``; 0 where only an overlap is."""
    if game.objective == "margin":
        return max(game.margin_cap - loss, 0.0)
    from scipy.special import erfcinv

    if game.crash_cost <= 0 or loss >= game.crash_cost / 2:
        return 0.0
    return float(min(erfcinv(2 * loss / game.crash_cost) if loss > 0 else np.inf, game.margin_cap))


def _closer(guard: Guard, plan: Plan, t: int, margin: float) -> tuple[HalfSpace, ...]:
    """Return that every face of the pair is closer than ``margin`` at time ``t``."""
    game = guard.game
    own = directions_of(game, guard.agent) @ plan.means[t, : game.dim]
    most = guard.units[t] * margin + own + game.encounters[PAIR].collision.offsets
    # The clearance falls along directions_of the other: here it has to be small.
    toward = directions_of(game, 1 - guard.agent)
    return tuple(
        HalfSpace(t, tuple((-row).tolist()), float(limit))
        for row, limit in zip(toward, most, strict=True)
    )
