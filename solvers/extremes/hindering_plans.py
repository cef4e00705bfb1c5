r"""Plans of one agent that leave the other no cheap deviation: a mixed-integer program.

Columns: the controls of agent j, and a binary for each deviation d of agent i and each event t at
which j can hinder d,

    z_dt = 1  =>  clear_p(t)  <=  unit_p(t) s_dt   for all faces p,        sum_t z_dt >= 1,

with the margins of :mod:`solvers.extremes.hindrance`.  If the program has no point, each plan of j
with its arrival allows one of the deviations, so agent i pays at most what they cost.
"""

from __future__ import annotations

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, make_plan
from solvers.budget import Budget
from solvers.extremes.affine_events import Event, timed_events_against
from solvers.extremes.guard import Guard
from solvers.extremes.hindrance import largest_margin, loss_shares
from solvers.extremes.plan_columns import add_plans
from solvers.extremes.rows import Outcome, Rows

ROOM = 1e-6
"""Lengths by which rows are relaxed."""

EXCESS = 1e-4
"""Loss by which a share exceeds that of a plan that it excludes."""


class HinderingPlans:
    """Plans of the other agent against which agent ``i`` pays more than ``most``.

    Parameters
    ----------
    arrival : that of the other agent.
    """

    def __init__(self, game: Game, i: int, arrival: int, most: float) -> None:
        self.game, self.i, self.arrival, self.most = game, i, arrival, most
        self._rows, self._whole = Rows(), Guard.anywhere(game, i, arrival)
        self._columns = add_plans(self._rows, game, 1 - i, arrival)
        self._none = False

    def add(self, plan: Plan, near: np.ndarray | None = None) -> bool:
        """Require that ``plan`` of agent ``i`` is hindered.

        ``near`` are its losses against plans that are to be excluded; return whether they are.
        """
        game, agent = self.game, self.game.agents[self.i]
        assert plan.arrival is not None
        room = (self.most - agent.lam * plan.arrival) / (1 - agent.lam)
        largest = self._whole.losses(plan)
        shares = loss_shares(game, largest, near, room)
        if shares is None:
            return False
        events = timed_events_against(game, self.i, plan, self.arrival, self._columns)
        limits = {
            t: events[t].units * largest_margin(game, float(shares[t]))
            for t in np.flatnonzero(largest > shares).tolist()
        }
        closer = {t: limit for t, limit in limits.items() if (events[t].low <= limit).all()}
        if closer:
            hindered = [self._add_hindrance(events[t], limit) for t, limit in closer.items()]
            self._rows.row(dict.fromkeys(hindered, 1.0), least=1.0)
        self._none |= not closer
        return near is None or all(near[t] + EXCESS <= shares[t] for t in closer)

    def _add_hindrance(self, event: Event, limits: np.ndarray) -> int:
        """Add a binary that requires clearances up to ``limits``."""
        closer = self._rows.binary()
        for p, spare in enumerate(np.maximum(event.high - limits, 0.0).tolist()):
            if spare > 0:
                most = float(limits[p] - event.constant[p]) + spare + ROOM
                self._rows.row({**event.terms[p], closer: spare}, most=most)
        return closer

    def point(self, budget: Budget, nodes: int) -> tuple[Outcome, Plan | None]:
        """Return some plan that hinders all deviations, or that there is none."""
        if self._none:
            return Outcome.NONE, None
        outcome, point = self._rows.point(budget, nodes)
        if outcome is not Outcome.POINT:
            return outcome, None
        agent = self.game.agents[1 - self.i]
        controls = np.zeros((self.game.horizon, agent.control_dim))
        controls[: self.arrival] = point[self._columns]
        return outcome, make_plan(agent, controls)
