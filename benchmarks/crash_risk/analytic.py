r"""The methods of ``ppg risk``: each answers in its own way, and says what it promises.

bound   certified upper bounds; the paper's is the answer, tighter ones are beside it
exact   exact for each instant; over time [likeliest instant, tightest certified bound]

Those that simulate are in :mod:`benchmarks.crash_risk.simulated`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.comparison.planner_options import PlannerOptions
from benchmarks.comparison.players import Entrant
from benchmarks.terminal import outward, probability
from ppg_env.errors import InputError
from ppg_env.game.game import Encounter, Game
from ppg_env.game.plan import Profile

if TYPE_CHECKING:
    from ppg_env.risk.union_bounds import Bounds, RiskBounds

LADDER = ("union", "faces", "instants", "tree")
"""Upper bounds from the paper's to the tightest, as :mod:`ppg_env.risk.union_bounds` names them."""


@dataclass(frozen=True)
class RiskQuery:
    """How likely do the agents of ``game`` crash?

    Attributes
    ----------
    profile : the plans that are played on schedule; None for players without plans.
    entrant : who plays in the environment; None for a plan file.
    planner : options of players that replan while they play, and the seed.
    arena : ``schedule`` or ``env``, for methods that simulate.
    against : another game and profile that the crashes are compared with.
    swept : whether to look between the instants.
    episodes : to simulate; None for as many as the method finds fit.
    progress : is told how many episodes are done since the last call.
    """

    game: Game
    profile: Profile | None
    entrant: Entrant | None = None
    planner: PlannerOptions = field(default_factory=PlannerOptions)
    arena: str = "schedule"
    against: tuple[Game, Profile] | None = None
    swept: bool = False
    episodes: int | None = None
    workers: int = 1
    progress: Callable[[int], None] = lambda _count: None


@dataclass(frozen=True)
class Chance:
    """A probability with the limits that the method promises."""

    probability: float
    low: float
    high: float

    @property
    def value(self) -> float:
        """The probability, as estimates call it."""
        return self.probability

    def __str__(self) -> str:
        """Return the probability with its limits; if nothing was seen, the upper limit."""
        if self.probability == self.high:
            least = f", >= {outward(self.low, '.2e', up=False)}" if self.low else ""
            return f"<= {at_most(self.high)}{least}"
        return probability(self)


@dataclass(frozen=True)
class RiskReport:
    """What a method found.

    Attributes
    ----------
    promise : what the numbers are, in a sentence.
    agents, any : for each agent, and for anybody.
    samples : simulated episodes.
    details : more, for ``--json``.
    columns, rows : more columns of the table, a row for each agent and one for anybody.
    """

    promise: str
    agents: tuple[Chance, ...]
    any: Chance
    samples: int = 0
    details: dict[str, Any] = field(default_factory=dict)
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] | None = None


def bound(query: RiskQuery) -> RiskReport:
    """The paper's union bound, with certified bounds that are tighter."""
    found = _bounds(query)
    everybody = (*found.agents, found.any)
    chances = [Chance(one.union, 0.0, one.union) for one in everybody]
    rows = [
        (_times(one, "union"), *(f"<= {at_most(getattr(one, name))}" for name in LADDER[1:]))
        for one in everybody
    ]
    return RiskReport(
        "Upper bounds, the paper's first; ratio: to the tightest bound; see ppg explain risk.",
        tuple(chances[:-1]),
        chances[-1],
        details=_details(query.game, found),
        columns=("ratio", "best faces", "exact instants", "less shared"),
        rows=tuple(rows),
    )


def exact(query: RiskQuery) -> RiskReport:
    """Exact for each instant; its largest and the tightest bound on all of them together."""
    found = _bounds(query)
    chances = [Chance(one.tree, one.least, one.tree) for one in (*found.agents, found.any)]
    members = [set(encounter.agents) for encounter in query.game.encounters]
    everybody = range(len(query.game.agents))
    chosen = [[i in agents for agents in members] for i in everybody] + [[True] * len(members)]
    return RiskReport(
        "Exact for each instant; over time an upper and a lower bound; see ppg explain risk.",
        tuple(chances[:-1]),
        chances[-1],
        details=_details(query.game, found),
        columns=("likeliest instant",),
        rows=tuple((_likeliest(query.game, found.log_instants, some),) for some in chosen),
    )


def _bounds(query: RiskQuery) -> RiskBounds:
    from ppg_env.risk.union_bounds import risk_bounds

    if query.profile is None:
        name = "this player" if query.entrant is None else query.entrant.name
        raise InputError(
            "--player", f"is {name}, which has no plan to compute with", "use --method mc"
        )
    return risk_bounds(query.game, query.profile)


def at_most(bound: float) -> str:
    """Return a bound in three digits, rounded up, so that it stays a bound."""
    return outward(bound, ".2e", up=True)


def _times(one: Bounds, name: str) -> str:
    ratio = _ratio(one, name)
    return "" if ratio is None else f"{ratio:.3g}x"


def _ratio(one: Bounds, name: str) -> float | None:
    """A bound over the tightest one; None where there is no risk."""
    value: float = getattr(one, name)
    return value / one.tree if one.tree else None


def _likeliest(game: Game, logs: np.ndarray, chosen: Sequence[bool]) -> str:
    """The likeliest crash of the chosen encounters: who, when, how likely."""
    some = np.flatnonzero(chosen)
    if not some.size or np.isneginf(logs[some].max()):
        return "none"
    place, t = np.unravel_index(int(logs[some].argmax()), logs[some].shape)
    who = " and ".join(parties(game, game.encounters[some[place]]))
    return f"{power(float(logs[some[place], t]))}: {who}, t = {t}"


def parties(game: Game, encounter: Encounter) -> Iterable[str]:
    """Names of who meets in an encounter."""
    yield from (game.agent_names[i] for i in encounter.agents)
    if encounter.obstacle is not None:
        yield f"obstacle {encounter.obstacle}"


def power(log: float) -> str:
    """A probability from its logarithm, however small."""
    if log > np.log(1e-300):
        return f"{np.exp(log):.2e}"
    return f"1e{log / np.log(10):.0f}"


def _details(game: Game, found: RiskBounds) -> dict[str, Any]:
    tens = found.log_instants / np.log(10)
    encounters = [
        {
            "agents": encounter.agents,
            "obstacle": encounter.obstacle,
            "instants": instants,
            "log10_instants": logs,
            "bounds": _report(one),
        }
        for encounter, one, instants, logs in zip(
            game.encounters, found.encounters, found.instants, tens, strict=True
        )
    ]
    return {
        "bounds": {"agents": [_report(one) for one in found.agents], "any": _report(found.any)},
        "encounters": encounters,
    }


def _report(one: Bounds) -> dict[str, Any]:
    """The bounds of one event, and how many times the tightest upper one each of them is."""
    return vars(one) | {"ratios": {name: _ratio(one, name) for name in LADDER}}
