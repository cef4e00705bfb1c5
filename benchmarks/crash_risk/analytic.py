r"""Analytic crash probabilities, for ``ppg risk``.

bound   certified upper bounds: the paper's, and tighter ones
exact   exact for each instant; over time [certified lower bound, tightest certified bound]

Both are about the game's own event.  No exact probability of an overlap during a step is known.

Methods that simulate are in :mod:`benchmarks.crash_risk.simulated`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.crash_risk.query import Chance, RiskQuery, RiskReport, at_most, parties
from ppg_env.errors import InputError, require
from ppg_env.game.game import Game

if TYPE_CHECKING:
    from ppg_env.risk.union_bounds import Bounds, RiskBounds

LADDER = ("union", "faces", "instants", "tree")
"""Upper bounds from the paper's to the tightest, as :mod:`ppg_env.risk.union_bounds` names them."""

COLUMNS = {"union": "programs", "faces": "best faces", "instants": "exact instants"} | {
    "tree": "less shared"
}
"""Columns of upper bounds that are not the plan's risk bound."""


def bound(query: RiskQuery) -> RiskReport:
    """Return the plan's risk bound, with the other certified bounds."""
    risk = _bounds(query)
    first, said = ("union", "the paper's first")
    if query.swept:
        first, said = "faces", "the plan's first"
    others = [name for name in LADDER if name != first and getattr(risk.any, name) is not None]
    events = (*risk.agents, risk.any)
    chances = [Chance(value, 0.0, value) for value in (getattr(event, first) for event in events)]
    rows = [
        (_times(event, first), *(f"<= {at_most(getattr(event, name))}" for name in others))
        for event in events
    ]
    return RiskReport(
        f"Upper bounds, {said}; ratio: to the tightest bound; see ppg explain risk.",
        tuple(chances[:-1]),
        chances[-1],
        details=_details(query.game, risk) | {"lower": _lower(query, risk)},
        columns=("ratio", *(COLUMNS[name] for name in others)),
        rows=tuple(rows),
    )


def exact(query: RiskQuery) -> RiskReport:
    """Return the exact largest instant, and the tightest bound on all instants together.

    Raises
    ------
    InputError
        If overlaps during the steps count.
    """
    require(
        not query.swept,
        "--method",
        "is exact, which knows overlaps at time steps only, and this game counts them during steps",
        "write bound, mc or rare",
    )
    risk = _bounds(query)
    lows = _lower(query, risk)
    chances = [
        Chance(event.tree, low, event.tree)
        for event, low in zip((*risk.agents, risk.any), lows, strict=True)
    ]
    members = [set(encounter.agents) for encounter in query.game.encounters]
    agents = range(len(query.game.agents))
    chosen = [[i in some for some in members] for i in agents] + [[True] * len(members)]
    return RiskReport(
        "Exact for each instant; over time an upper and a lower bound; see ppg explain risk.",
        tuple(chances[:-1]),
        chances[-1],
        details=_details(query.game, risk) | {"lower": lows},
        columns=("likeliest instant",),
        rows=tuple((_likeliest(query.game, risk.log_instants, some),) for some in chosen),
    )


def _bounds(query: RiskQuery) -> RiskBounds:
    from ppg_env.risk.union_bounds import risk_bounds

    if query.profile is None:
        name = "this player" if query.entrant is None else query.entrant.name
        raise InputError("--player", f"is {name}, which has no plan", "use --method mc")
    return risk_bounds(query.game, query.profile)


def _lower(query: RiskQuery, risk: RiskBounds) -> list[float]:
    """Return a lower bound for each agent, and for any agent."""
    from ppg_env.risk.lower_bounds import lower_bounds

    assert query.profile is not None
    each, of_any = lower_bounds(query.game, query.profile, risk)
    return [*each, of_any]


def _times(event: Bounds, name: str) -> str:
    ratio = _ratio(event, name)
    return "" if ratio is None else f"{ratio:.3g}x"


def _ratio(event: Bounds, name: str) -> float | None:
    """Return a bound over the tightest one; None if there is no risk, or no such bound."""
    value: float | None = getattr(event, name)
    return value / event.tree if event.tree and value is not None else None


def _likeliest(game: Game, logs: np.ndarray, chosen: Sequence[bool]) -> str:
    """Return the likeliest crash of the chosen encounters: its probability, agents and time."""
    places = np.flatnonzero(chosen)
    if not places.size or np.isneginf(logs[places].max()):
        return "none"
    k, t = np.unravel_index(int(logs[places].argmax()), logs[places].shape)
    names = " and ".join(parties(game, game.encounters[places[k]]))
    return f"{power(float(logs[places[k], t]))}: {names}, t = {t}"


def power(log: float) -> str:
    """Return a probability as text from its logarithm, which may be below the smallest float."""
    if log > np.log(1e-300):
        return f"{np.exp(log):.2e}"
    return f"1e{log / np.log(10):.0f}"


def _details(game: Game, risk: RiskBounds) -> dict[str, Any]:
    tens = risk.log_instants / np.log(10)
    encounters = [
        {
            "agents": encounter.agents,
            "obstacle": encounter.obstacle,
            "instants": instants,
            "log10_instants": logs,
            "bounds": _report(event),
        }
        for encounter, event, instants, logs in zip(
            game.encounters, risk.encounters, risk.instants, tens, strict=True
        )
    ]
    return {
        "bounds": {"agents": [_report(event) for event in risk.agents], "any": _report(risk.any)},
        "encounters": encounters,
    }


def _report(event: Bounds) -> dict[str, Any]:
    """Return the bounds of one event, and the ratio of each to the tightest upper bound."""
    return vars(event) | {"ratios": {name: _ratio(event, name) for name in LADDER}}
