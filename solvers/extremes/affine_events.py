"""Clearances of the pair's faces as linear functions of controls, with their ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from solvers.extremes.guard import PAIR, directions_of, pair_units, reach_along


@dataclass(frozen=True)
class Event:
    """Clearances at one time, terms . x + constant for each of F faces.

    Attributes
    ----------
    terms, constant : coefficients by column, and constants (F,).
    low, high : (F,) their ranges within reach.
    units : (F,) lengths of one unit of margin.
    """

    terms: tuple[dict[int, float], ...]
    constant: np.ndarray
    low: np.ndarray
    high: np.ndarray
    units: np.ndarray

    def matters(self, cap: float) -> bool:
        """Return whether some plans within reach have a margin below the cap."""
        return bool((self.low < cap * self.units).all())


def events_of(
    game: Game, arrivals: Sequence[int], controls: Sequence[np.ndarray]
) -> tuple[list[Event], int]:
    """Return the events that matter between two agents, and the number of the others."""
    parts = [_moving(game, i, arrivals[i], controls[i]) for i in (0, 1)]
    return _mattering(game, _events(game, parts, min(arrivals)))


def events_against(
    game: Game, i: int, plan: Plan, arrivals: Sequence[int], controls: Sequence[np.ndarray]
) -> tuple[list[Event], int]:
    """Return the same with agent ``i`` following ``plan``."""
    return _mattering(game, timed_events_against(game, i, plan, arrivals[1 - i], controls[1 - i]))


def timed_events_against(
    game: Game, i: int, plan: Plan, arrival: int, controls: np.ndarray
) -> list[Event]:
    """Return the events at t = 0, 1, ... between ``plan`` of agent ``i`` and the other agent."""
    assert plan.arrival is not None
    count, j = min(plan.arrival, arrival), 1 - i
    fixed = -plan.means[:count, : game.dim] @ directions_of(game, i).T
    none: tuple[dict[int, float], ...] = ({},) * fixed.shape[1]
    known = _Part([none] * count, fixed, fixed, fixed)
    return _events(game, [known, _moving(game, j, arrival, controls)], count)


@dataclass(frozen=True)
class _Part:
    """What one agent adds to the clearances (T, F): terms, constants and their ranges."""

    terms: list[tuple[dict[int, float], ...]]
    constant: np.ndarray
    low: np.ndarray
    high: np.ndarray


def _moving(game: Game, j: int, arrival: int, controls: np.ndarray) -> _Part:
    agent, toward = game.agents[j], directions_of(game, j)
    drift, effect = _positions(agent, arrival)
    columns = controls.ravel().tolist()
    rows = -np.einsum("fd,tdk->tfk", toward, effect)
    terms = [
        tuple({c: float(v) for c, v in zip(columns, row, strict=True) if v} for row in at)
        for at in rows
    ]
    below, above = reach_along(game, j, arrival)
    return _Part(terms, -drift @ toward.T, -above, -below)


def _events(game: Game, parts: Sequence[_Part], count: int) -> list[Event]:
    offsets, units = game.encounters[PAIR].collision.offsets, pair_units(game)
    return [
        Event(
            tuple({**a, **b} for a, b in zip(*(part.terms[t] for part in parts), strict=True)),
            sum(part.constant[t] for part in parts) - offsets,
            sum(part.low[t] for part in parts) - offsets,
            sum(part.high[t] for part in parts) - offsets,
            units[t],
        )
        for t in range(count)
    ]


def _mattering(game: Game, every: Sequence[Event]) -> tuple[list[Event], int]:
    matter = [event for event in every if event.matters(game.margin_cap)]
    return matter, len(every) - len(matter)


def _positions(agent: Agent, arrival: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (T+1, d) and (T+1, d, T m):  position at t = drift_t + effect_t u."""
    n, m = agent.state_dim, agent.control_dim
    drift, effect = np.zeros((arrival + 1, n)), np.zeros((arrival + 1, n, arrival * m))
    drift[0] = agent.start
    for t in range(arrival):
        drift[t + 1], effect[t + 1] = agent.A @ drift[t], agent.A @ effect[t]
        effect[t + 1][:, t * m : (t + 1) * m] = agent.B
    return drift[:, : agent.dim], effect[:, : agent.dim]
