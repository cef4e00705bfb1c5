r"""A mixed-integer program whose points include all equilibria with given arrivals.

Columns: the controls u of both agents, the margin s_t and the loss l_t of each event.  With
clear_p(t) = a_p' (r_0 - r_1) - b_p, positions linear in u, and binaries z, v,

    u in U,  means at the goals                          both agents' plans
    unit_p s_t <= clear_p(t)         if z_tp,            sum_p z_tp = 1: bodies keep apart
    l_t >= c(q) + c'(q) (s_t - q)    for tangent points q
    l_t <= loss_(k-1)                unless s_t >= sigma_k by some face (below)
    least <= sum_t l_t <= most

Upper bounds on losses.  For levels sigma_1 < .. < sigma_K = M' of the margin,

    l <= loss(M') + sum_k (loss(sigma_(k-1)) - loss(sigma_k)) v_k,
    clear_p <= unit_p sigma_k        for all p, if v_k.

A loss M' - s has one level, and  unit_p l + clear_p <= unit_p M'  for all p, if v.

Equilibrium inequalities.  A plan d of agent i that arrives at T_d costs it at least as much:

    sum_t l_t  <=  (lam_i (T_d - T_i) + epsilon) / (1 - lam_i)  +  sum_t q_t  +  large sum_t w_t

with upper bounds q_t on the losses of d against the other's plan, and w_t = 1 only where they
overlap.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, make_plan
from solvers.budget import Budget
from solvers.extremes.affine_events import Event, events_against, events_of
from solvers.extremes.loss_levels import levels, tangents
from solvers.extremes.plan_columns import add_plans
from solvers.extremes.rows import Outcome, Rows

ROOM = 1e-6
"""Lengths by which rows that a binary switches are relaxed, beyond the reachable sets."""


class PairProgram:
    """The program for arrivals T of both agents; equilibrium inequalities are added to it."""

    def __init__(self, game: Game, arrivals: Sequence[int], epsilon: float) -> None:
        self._game, self._arrivals, self._epsilon = game, tuple(arrivals), epsilon
        self._rows = Rows()
        self._controls = [
            add_plans(self._rows, game, i, arrival) for i, arrival in enumerate(self._arrivals)
        ]
        self._largest = float(objective.loss(game, np.zeros(())))
        self._least = float(objective.loss(game, np.array(game.margin_cap)))
        events, quiet = events_of(game, self._arrivals, self._controls)
        self._losses = [self._add_event(event) for event in events]
        self._quiet = quiet * self._least
        self._total = self._rows.row(dict.fromkeys(self._losses, 1.0))

    def profile(
        self, least: float, most: float, budget: Budget, nodes: int
    ) -> tuple[Outcome, tuple[Plan, ...], float]:
        """Return some plans that satisfy the inequalities so far, and the losses they stand for.

        Only profiles with losses from ``least`` to ``most`` count.
        """
        if not self._losses and not least <= self._quiet <= most:
            return Outcome.NONE, (), 0.0
        if self._losses:
            self._rows.change(self._total, least - self._quiet, most - self._quiet)
        outcome, point = self._rows.point(budget, nodes)
        if outcome is not Outcome.POINT:
            return outcome, (), 0.0
        plans = []
        for agent, columns in zip(self._game.agents, self._controls, strict=True):
            controls = np.zeros((self._game.horizon, agent.control_dim))
            controls[: len(columns)] = point[columns]
            plans.append(make_plan(agent, controls))
        return outcome, tuple(plans), float(point[self._losses].sum()) + self._quiet

    def add_deviation(self, i: int, plan: Plan) -> None:
        """Require that agent ``i`` gains at most epsilon by ``plan``."""
        game, rows, agent = self._game, self._rows, self._game.agents[i]
        assert plan.arrival is not None
        saved = agent.lam * (plan.arrival - self._arrivals[i]) + self._epsilon
        events, quiet = events_against(game, i, plan, self._arrivals, self._controls)
        most = saved / (1 - agent.lam) + quiet * self._least - self._quiet
        vacuous = self._largest * len(self._losses) + max(-most, 0.0) + ROOM
        terms = dict.fromkeys(self._losses, 1.0)
        for event in events:
            loss = rows.column(0.0, self._largest)
            self._limit_loss(loss, event)
            terms[loss] = -1.0
            if event.low.max() < 0:
                overlap = rows.binary()
                terms[overlap] = -vacuous
                for p in range(len(event.low)):
                    self._if(overlap, event.terms[p], 0.0 - event.constant[p], event, p)
        rows.row(terms, most=most)

    def _add_event(self, event: Event) -> int:
        """Add the margin and the loss of an event, and the choice of a face."""
        game, rows = self._game, self._rows
        margin, loss = rows.column(0.0, game.margin_cap), rows.column(0.0, self._largest)
        for slope, intercept in tangents(game):
            rows.row({loss: 1.0, margin: -slope}, least=intercept)
        self._limit_loss(loss, event)
        chosen = {}
        for p in np.flatnonzero(event.high >= -ROOM).tolist():
            face = rows.binary()
            unit = float(event.units[p])
            spare = max(unit * game.margin_cap - event.low[p], 0.0) + ROOM
            terms = {k: -v for k, v in event.terms[p].items()} | {margin: unit, face: spare}
            rows.row(terms, most=float(event.constant[p]) + spare)
            chosen[face] = 1.0
        rows.row(chosen or {loss: 0.0}, 1.0, 1.0)
        return loss

    def _limit_loss(self, loss: int, event: Event) -> None:
        """Bound a loss from above by the clearances of all faces."""
        game, rows = self._game, self._rows
        if game.objective == "margin":
            close = rows.binary()
            rows.row({loss: 1.0, close: -self._largest}, most=0.0)
            for p, unit in enumerate(event.units.tolist()):
                terms = {**event.terms[p], loss: unit}
                self._if(close, terms, unit * game.margin_cap - event.constant[p], event, p)
            return
        terms, before, previous = {loss: 1.0}, self._largest, None
        for margin, after in levels(game):
            close = rows.binary()
            terms[close] = after - before
            before = after
            for p, unit in enumerate(event.units.tolist()):
                self._if(close, event.terms[p], unit * margin - event.constant[p], event, p)
            if previous is not None:
                rows.row({previous: 1.0, close: -1.0}, most=0.0)
            previous = close
        rows.row(terms, most=before)

    def _if(self, binary: int, terms: dict[int, float], most: float, event: Event, p: int) -> None:
        """Add ``terms`` <= ``most`` if the binary is one; without it nothing is required.

        ``terms`` are those of face ``p``, and perhaps its unit times a loss that is then zero.
        """
        spare = max(float(event.high[p] - event.constant[p]) - most, 0.0) + ROOM
        self._rows.row({**terms, binary: spare}, most=most + spare)
