r"""Limits that hold for all feasible profiles or follow from bounds on losses alone."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.input_sets import bounds
from ppg_env.game.reserve import planned_controls
from solvers.extremes.arrival_vectors import ArrivalVector
from solvers.extremes.bounds_result import Between


def largest_cost(game: Game) -> float:
    """Return a bound on the social cost of all feasible profiles: latest arrivals, bodies touch."""
    weights, H = objective.social(game), game.horizon
    touch = float(objective.loss(game, np.zeros(())))
    effort = 0.0
    for agent, weight in zip(game.agents, weights.effort.tolist(), strict=True):
        low, high = bounds(planned_controls(agent, H))
        effort += weight * H * float(np.maximum(np.abs(low), np.abs(high)).sum())
    return float(weights.time.sum() * H + weights.encounter.sum() * (H + 1) * touch + effort)


def risk_limits(game: Game, vectors: Iterable[ArrivalVector]) -> Between:
    r"""Return bounds on the union bound of any overlap in the equilibria of ``vectors``.

    With K events in traffic, losses L and ``risk`` as the objective, it is L / kappa.  Otherwise
    g is convex, so that sum_t g(s_t) with sum_t (M' - s_t) = L is least for equal margins, and
    largest where as many margins as possible are 0 or M'.
    """
    limits = [(_risks(game, v.least, v)[0], _risks(game, v.most, v)[1]) for v in vectors]
    low, high = zip(*limits, strict=True) if limits else ((0.0,), (np.inf,))
    return Between(float(min(low)), float(max(high)))


def _risks(game: Game, losses: float, vector: ArrivalVector) -> tuple[float, float]:
    """Return the least and the largest risk of events with a sum of losses."""
    events, cap = min(vector.arrivals), game.margin_cap
    if game.objective == "risk" and game.crash_cost > 0:
        return (losses / game.crash_cost,) * 2
    if game.objective == "risk":
        return 0.0, events / 2
    whole = int(min(losses // cap, events))
    rest = losses - whole * cap if whole < events else 0.0
    margins = np.array([0.0] * whole + [cap - rest] + [cap] * events)[:events]
    even = np.full(events, cap - losses / events)
    low, high = (objective.event_risk(game, s).sum() for s in (even, margins))
    return float(low), float(high)
