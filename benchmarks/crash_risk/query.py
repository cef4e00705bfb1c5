"""Query and report of the methods of ``ppg risk``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.comparison.players import Entrant
from benchmarks.terminal import outward, probability
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.planner_options import PlannerOptions


@dataclass(frozen=True)
class RiskQuery:
    """A query for the crash probabilities of ``game``.

    Attributes
    ----------
    profile : the plans on schedule; None for players without plans.
    entrant : the player in the environment; None for a plan file.
    planner : options of players that replan while they play, and the seed.
    arena : ``schedule`` or ``env``, for methods that simulate.
    against : another game and profile to compare with.
    swept : whether overlaps during the steps count: as the game says, or on request.
    episodes : simulated episodes; None for the method's default.
    progress : called with the number of episodes done since the last call.
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


EVENTS = {False: "overlap at a time step", True: "overlap during a step"}
"""The crash that is meant, by whether it is swept."""


@dataclass(frozen=True)
class Chance:
    """A probability with the limits that the method guarantees."""

    probability: float
    low: float
    high: float

    @property
    def value(self) -> float:
        """The probability, under the name that estimates use."""
        return self.probability

    def __str__(self) -> str:
        """Return the probability with its limits; if nothing was seen, the upper limit."""
        if self.probability == self.high:
            least = f", >= {outward(self.low, '.2e', up=False)}" if self.low else ""
            return f"<= {at_most(self.high)}{least}"
        return probability(self)


@dataclass(frozen=True)
class RiskReport:
    """Result of a method.

    Attributes
    ----------
    promise : meaning of the numbers, in one sentence.
    agents, any : for each agent, and for any agent.
    samples : simulated episodes.
    details : further results, for ``--json``.
    columns, rows : further columns of the table; one row per agent, and one for any agent.
    """

    promise: str
    agents: tuple[Chance, ...]
    any: Chance
    samples: int = 0
    details: dict[str, Any] = field(default_factory=dict)
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] | None = None


def at_most(bound: float) -> str:
    """Return a bound in three digits, rounded up, so that it stays a bound."""
    return outward(bound, ".2e", up=True)


def parties(game: Game, encounter: Encounter) -> Iterable[str]:
    """Yield the names of the agents and the obstacle of an encounter."""
    yield from (game.agent_names[i] for i in encounter.agents)
    if encounter.obstacle is not None:
        yield f"obstacle {encounter.obstacle}"
