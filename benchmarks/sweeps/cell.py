r"""A cell of a sweep: a game, its player, and how it is simulated.

    address = SHA-256 of the canonical JSON of (format, the game itself, player, its options,
              its file's content, arena, episodes, groups, seed, solver, limits)

The address contains the content of scenarios and files, not their names: editing a game file makes
new cells, renaming it does not.  Options without effect for a player are left out, so that a grid
over the starts of ``nash`` has one cell for ``social``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from baselines.deviations import check_deviation
from baselines.pretrained import PLAYERS as PRETRAINED
from baselines.pretrained import pretrained_file
from benchmarks.comparison.players import FILE, check_arena, chosen_player, find_player
from ppg_env.errors import require
from ppg_env.formats.game_file import game_to_tables
from ppg_env.game.game import Game
from ppg_env.scenarios.make import make_game
from ppg_env.support.read_file import read_bytes
from solvers.planner_options import PlannerOptions

FORMAT = 3
"""Raise it whenever a cell gives another row than before, so that old rows are not found."""

SELFISH = "selfish"
"""The liability rule of all players that accept no other."""

PAPER = {"collisions": "instants", "on_goal": "remove"}
"""Rules of a game that the first stores had no other values of; addresses leave them out."""


@dataclass(frozen=True)
class Cell(PlannerOptions):
    """One player in one game, with the options of its planner.

    Attributes
    ----------
    scenario : a scenario's call or the path of a .toml file, as for ``make_game``.
    player : a name that ``ppg compare`` knows, or a file of learned players.
    fields : fields of the game to override, as for ``make_game``.
    arena : ``schedule`` or ``env``, as for ``ppg compare``.
    episodes : simulated episodes.
    groups : groups of episodes in ``env``; learners have one per training run at least.  Players
        with as many groups meet the same noise.
    deviation : in ``env``, the deviation whose gain is measured, as in ``ppg regret``; None for
        none.

    A ``time_limit`` makes results depend on the machine, a ``node_limit`` does not.
    """

    scenario: str
    player: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    arena: str = "schedule"
    episodes: int = 10_000
    groups: int = 1
    deviation: str | None = None

    def __post_init__(self) -> None:
        check_arena(self.arena, "arena")
        check_deviation(self.deviation)
        chosen_player(self.player, self.arena, "player")
        for name, least in (("episodes", 1), ("groups", 1), ("seed", 0)):
            value = getattr(self, name)
            require(value >= least, name, f"is {value}", f"give a whole number from {least} on")

    def __getstate__(self) -> dict[str, Any]:
        # Leave out cached values: another process resolves the names itself.
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @cached_property
    def game(self) -> Game:
        """The game; raises InputError if there is none."""
        try:
            fields = json.dumps(self.fields)
        except TypeError:  # arrays and polytopes
            return make_game(self.scenario, **self.fields)
        if self.scenario.endswith(".toml"):  # a file may change
            return make_game(self.scenario, **self.fields)
        return _scenario(self.scenario, fields)

    @property
    def effective_options(self) -> dict[str, Any]:
        """The options, with None for those without effect for this player and arena."""
        accepted = find_player(self.player).accepts
        order = self.order if isinstance(self.order, str) else ",".join(map(str, self.order))
        return {
            "start": self.start if "start" in accepted else None,
            "order": order if "order" in accepted else None,
            "charge": self.charge if "charge" in accepted else None,
            "arena": self.arena,
            "episodes": self.episodes,
            "groups": self.groups if self.arena == "env" else None,
            "deviation": self.deviation if self.arena == "env" else None,
            "seed": self.seed,
            "solver": self.solver,
            "time_limit": self.time_limit,
            "node_limit": self.node_limit if "node_limit" in accepted else None,
        }

    @cached_property
    def address(self) -> str:
        """SHA-256, in hexadecimal, of everything that determines the result."""
        content = {
            "format": FORMAT,
            "game": _addressed(self.game),
            "player": FILE if self.player.endswith(FILE) else self.player,
            "learned": self._file_digest(),
            **self.effective_options,
        }
        if content["charge"] in (None, SELFISH):  # the only rule of the first stores
            del content["charge"]
        if content["deviation"] is None:  # nothing else was measured before
            del content["deviation"]
        return hashlib.sha256(_canonical(content).encode()).hexdigest()

    def _file_digest(self) -> str | None:
        """Return the SHA-256 of the file of a learned player; None for other players."""
        if self.player in PRETRAINED:
            path = pretrained_file(self.player, self.game)
        elif self.player.endswith(FILE):
            path = Path(self.player)
        else:
            return None
        from solvers.feedback.grid.policy_file import LARGEST

        return hashlib.sha256(read_bytes(path, LARGEST)).hexdigest()


def _addressed(game: Game) -> dict[str, Any]:
    """Return the tables of ``game`` without the rules of the paper."""
    tables = game_to_tables(game)
    head = tables["game"]
    kept = {key: value for key, value in head.items() if PAPER.get(key) != value}
    return tables | {"game": kept}


@lru_cache(maxsize=1024)
def _scenario(call: str, fields: str) -> Game:
    """Return the game of a scenario; many cells of a grid share one."""
    return make_game(call, **json.loads(fields))


def _canonical(content: Mapping[str, Any]) -> str:
    """Return JSON in which equal values are equal texts: sorted keys, whole numbers as 3.0."""
    normalised = json.loads(json.dumps(content, allow_nan=False), parse_int=float)
    return json.dumps(normalised, sort_keys=True, separators=(",", ":"))
