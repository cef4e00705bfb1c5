r"""The extent of a reproduction: settings, scenarios, gains and values of lam.

A *panel* is one row of the paper's figures: a scenario and a gain, over lam.  It is drawn in
several *settings* (speed set and margin cap), since the paper states the speed set but not the cap.
``head_on`` is the reading of ``opposing`` that the paper's caption suggests.  Every panel has the
social optimum and several *equilibria*: best response from several starts and orders, and the
minimiser of the potential.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

from benchmarks.sweeps import Cell
from ppg_env.errors import InputError, require
from ppg_env.game.between_steps import OVERLAP_TIMES
from ppg_env.scenarios.make import make_game

FIRST_TWO = ("opposing", "head_on", "parallel")
"""The paper's first two scenarios, in both readings of the first."""

INTERSECTIONS = ("intersection", "intersection3")
SCENARIOS = (*FIRST_TWO, *INTERSECTIONS)
GAINS = (0.0, 0.5)
LAMS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)

SOCIAL = "social"
POTENTIAL = "potential"
BEST_RESPONSE = "best response"
"""The paper's: from the straight model, all agents in turn."""

DYNAMICS = {
    BEST_RESPONSE: ("straight", False),
    "other order": ("straight", True),
    "other start": ("sequential", False),
    "both other": ("sequential", True),
}
"""Start of the best-response dynamics, and whether the last agent moves first."""

EQUILIBRIA = (*DYNAMICS, POTENTIAL)
SOLUTIONS = (*EQUILIBRIA, SOCIAL)


@dataclass(frozen=True)
class Setting:
    """A speed set with a margin cap."""

    speed: str
    margin_cap: float

    def __str__(self) -> str:
        return f"{self.speed} speed, M' = {self.margin_cap:g}"


SETTINGS = (Setting("box", 3.0), Setting("box", 8.0), Setting("l1", 3.0), Setting("disc", 3.0))
"""The first is the paper's own speed set with this project's default cap."""


def read_settings(text: str) -> tuple[Setting, ...]:
    """Return the settings in a text such as ``box:3,l1:8``."""
    settings = []
    for part in text.split(","):
        speed, _, cap = part.partition(":")
        try:
            settings.append(Setting(speed.strip(), float(cap)))
        except ValueError:
            raise InputError(
                "settings", f"has {part!r}", "write SPEED:CAP, such as box:3,l1:8"
            ) from None
    return tuple(settings)


@dataclass(frozen=True)
class Place:
    """Setting, scenario and gain of a panel."""

    setting: Setting
    scenario: str
    gain: float


@dataclass(frozen=True)
class Extent:
    """What to reproduce; by default everything.

    ``collisions`` is the rule of all games: ``instants`` is the paper's.
    """

    settings: Sequence[Setting] = SETTINGS
    scenarios: Sequence[str] = SCENARIOS
    gains: Sequence[float] = GAINS
    lams: Sequence[float] = LAMS
    episodes: int = 100_000
    seed: int = 0
    collisions: str = "instants"

    def __post_init__(self) -> None:
        for scenario in self.scenarios:
            remedy = "use names of " + ", ".join(SCENARIOS)
            require(scenario in SCENARIOS, "scenarios", f"has {scenario!r}", remedy)
        for lam in self.lams:
            require(0 <= lam < 1, "lams", f"has {lam:g}", "give values with 0 <= lam < 1")
        for name in ("settings", "scenarios", "gains", "lams"):
            values = getattr(self, name)
            distinct = 0 < len(values) == len(set(values))
            require(distinct, name, "is empty or has a value twice", "name each value once")

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.places()) * len(SOLUTIONS) * len(self.lams)

    @property
    def crash_event(self) -> str:
        """What a crash is, in words."""
        return f"overlap {OVERLAP_TIMES[self.collisions]}"

    def places(self) -> list[Place]:
        """Return the places of all panels, those of a setting together."""
        return [Place(*chosen) for chosen in product(self.settings, self.scenarios, self.gains)]

    def cells(self, place: Place) -> dict[str, list[Cell]]:
        """Return the cells of a panel: for each solution, one cell for each lam."""
        return {
            solution: [self._cell(place, lam, solution) for lam in self.lams]
            for solution in SOLUTIONS
        }

    def _cell(self, place: Place, lam: float, solution: str) -> Cell:
        fields = {
            "speed": place.setting.speed,
            "margin_cap": place.setting.margin_cap,
            "gain": place.gain,
            "lam": lam,
            "collisions": self.collisions,
        }
        if solution not in DYNAMICS:
            return Cell(place.scenario, solution, fields, episodes=self.episodes, seed=self.seed)
        start, backwards = DYNAMICS[solution]
        return Cell(
            place.scenario,
            "nash",
            fields,
            start=start,
            order=tuple(reversed(range(_agents(place.scenario)))) if backwards else "cyclic",
            episodes=self.episodes,
            seed=self.seed,
        )


@cache
def _agents(scenario: str) -> int:
    """Return the number of agents of ``scenario``."""
    return len(make_game(scenario).agents)
