r"""Liability rules: which agent pays which share of the losses of an encounter.

With u_i = 1 - lam_i, the losses c_ij of a pair harm i by u_i c_ij and j by u_j c_ij.  Under a rule,
agent i pays

    P_i = lam_i T_i + u_i o_i + f_i + sum_j w_ij c_ij,     w_ij = own_ij u_i + other_ij u_j,

where o_i are its losses from obstacles, which harm no other agent, and f_i is its effort.

    rule            own  other
    selfish           1      0   every agent pays its own harm: P_i = J_i
    partial:a         1      a   and a share a of the harm to the other, 0 <= a <= 1
    pigou             1      1   and all of the harm to the other
    right-of-way   0, 1   0, 1   the agent that yields pays everything, the other nothing

Agents have the right of way in the order of the game, unless ``right-of-way:2-0-1`` gives another.

Potential.  If there are d_i > 0 with w_ij / d_i = w_ji / d_j for every pair, then

    Phi = sum_i (lam_i T_i + u_i o_i + f_i) / d_i + sum_{i<j} (w_ij / d_i) c_ij

falls by 1/d_i times what agent i gains.  ``selfish`` has d_i = u_i; ``pigou`` has d_i = 1, and Phi
is the social cost; ``partial:a`` with equal lam has d_i = 1, and Phi is the social cost with each
pair counted 1 + a times instead of twice.  With unequal lam, the cycle of three agents gives

    w_ij w_jk w_ki - w_ji w_kj w_ik = a (1 - a) (u_i - u_j) (u_j - u_k) (u_i - u_k),

so a partial rule has a potential if and only if no three lam are different.  Right of way has no
potential but a hierarchy: what an agent pays depends only on agents of higher priority, so best
responses in the order of priority are an equilibrium after one round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.game.game import Game
from ppg_env.game.objective import Objective, efforts

RULES = "selfish, pigou, partial:0.5, right-of-way or right-of-way:1-0"
"""Examples of all rules, for messages."""

PARTIAL, RIGHT_OF_WAY = "partial", "right-of-way"
SHARES = {"selfish": 0.0, "pigou": 1.0}
"""Named rules, by the share of the harm to the other."""


@dataclass(frozen=True, eq=False)
class Liability:
    """A liability rule applied to one game: the costs of its agents, and their potential.

    Attributes
    ----------
    game : the game whose losses the rule distributes.
    charge : the rule as written, such as ``partial:0.5``.
    own, other : (N, N) shares that agent i pays, in its encounter with j, of the harm to i and of
        the harm to j; the diagonals have no effect.
    priority : all agents, the one with the right of way first; None for the other rules.
    """

    game: Game
    charge: str
    own: np.ndarray
    other: np.ndarray
    priority: tuple[int, ...] | None = None

    @cached_property
    def costs(self) -> tuple[Objective, ...]:
        """What each agent pays, P_i."""
        return tuple(self._cost(i) for i in range(len(self.game.agents)))

    def _cost(self, agent: int) -> Objective:
        time = np.where(np.arange(len(self.game.agents)) == agent, self._lams, 0.0)
        weights = np.zeros(len(self.game.encounters))
        for e, encounter in enumerate(self.game.encounters):
            if agent in encounter.agents:
                others = [j for j in encounter.agents if j != agent]
                weights[e] = self._pair[agent, others[0]] if others else 1 - self._lams[agent]
        effort = np.where(np.arange(len(self.game.agents)) == agent, efforts(self.game), 0.0)
        return Objective(self.game, time, weights, effort)

    @cached_property
    def potential(self) -> Objective | None:
        """Phi, which falls whenever an agent gains; None if the rule has no potential."""
        scale = self._scale
        if scale is None:
            return None
        ends = [(e.agents[0], e.agents[-1]) for e in self.game.encounters]
        pairs = [self._pair[i, j] if i != j else 1 - self._lams[i] for i, j in ends]
        return Objective(
            self.game,
            self._lams / scale,
            np.array(pairs) / scale[[i for i, _ in ends]],
            efforts(self.game) / scale,
        )

    @property
    def _lams(self) -> np.ndarray:
        return np.array([agent.lam for agent in self.game.agents])

    @cached_property
    def _pair(self) -> np.ndarray:
        """(N, N) weights w_ij."""
        care = 1 - self._lams
        return self.own * care[:, None] + self.other * care[None, :]

    @property
    def _scale(self) -> np.ndarray | None:
        """(N,) divisors d: 1 - lam if no agent pays for others, else relative to the first."""
        w = self._pair + np.eye(len(self._lams))  # no agent meets itself
        if (w <= 0).any():
            return None
        scale = w[:, 0] / w[0] if self.other.any() else 1 - self._lams
        return scale if np.allclose(w / scale[:, None], (w / scale[:, None]).T) else None


def make_rule(game: Game, charge: str) -> Liability:
    """Return the rule that ``charge`` names, applied to ``game``.

    Raises
    ------
    InputError
        If the rule does not exist, or its numbers do not fit the game.
    """
    name, _, detail = charge.partition(":")
    if name == RIGHT_OF_WAY:
        return _right_of_way(game, charge)
    if name == PARTIAL:
        share = _share(detail)
    else:
        require(charge in SHARES, "charge", f"is {charge!r}", f"write {RULES}")
        share = SHARES[charge]
    everywhere = np.ones((len(game.agents), len(game.agents)))
    return Liability(game, charge, everywhere, share * everywhere)


def _share(text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = -1.0
    require(
        0 <= share <= 1,
        "charge",
        f"is {PARTIAL + ':' + text!r}",
        "write a share from 0 to 1, such as partial:0.5",
    )
    return share


def _right_of_way(game: Game, charge: str) -> Liability:
    size, (_, _, text) = len(game.agents), charge.partition(":")
    try:
        priority = tuple(int(part) for part in text.split("-")) if text else tuple(range(size))
    except ValueError:
        priority = ()
    if sorted(priority) != list(range(size)):
        raise InputError(
            "charge",
            f"is {RIGHT_OF_WAY + ':' + text!r}",
            f"list the agents 0 to {size - 1} in the order of priority, with - between them",
        )
    rank = np.argsort(priority)
    yields = (rank[:, None] > rank[None, :]).astype(float)
    return Liability(game, charge, yields, yields, priority)
