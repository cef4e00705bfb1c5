r"""Where the other agent must be for a deviation to cost more than allowed.

A deviation of agent i leaves ``room`` for losses.  Let theta_t with sum theta_t <= room be shares
of it.  Against a plan of the other agent with a larger sum of losses, some event t has a loss above
theta_t: every face is closer than the margin s_t of that loss,

    clear_p(t)  <=  unit_p(t) s_t      for all p.
"""

from __future__ import annotations

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game


def loss_shares(
    game: Game, largest: np.ndarray, near: np.ndarray | None, room: float
) -> np.ndarray | None:
    """Return (K,) shares of ``room``, none below the loss of the margin cap; None if that fails.

    Parameters
    ----------
    largest
        (K,) upper bounds on the losses; an event needs no larger share.
    near
        (K,) losses that are to be allowed whole, if there is room for them.
    """
    least = np.full(len(largest), float(objective.loss(game, np.array(game.margin_cap))))
    shares = least if near is None else np.maximum(near, least)
    if shares.sum() > room:
        shares = least
    rest = room - shares.sum()
    if rest < 0:
        return None
    wanted = np.maximum(largest - shares, 0.0)
    for n, t in enumerate(wanted.argsort(kind="stable").tolist()):
        added = min(wanted[t], rest / (len(shares) - n))
        shares[t] += added
        rest -= added
    return shares


def largest_margin(game: Game, loss: float) -> float:
    """Return the largest margin whose loss is at least ``loss``; 0 where only an overlap is."""
    if game.objective == "margin":
        return min(max(game.margin_cap - loss, 0.0), game.margin_cap)
    from scipy.special import erfcinv

    if game.crash_cost <= 0 or loss >= game.crash_cost / 2:
        return 0.0
    return float(min(erfcinv(2 * loss / game.crash_cost) if loss > 0 else np.inf, game.margin_cap))
