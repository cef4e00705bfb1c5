"""Records: the best plans known of a game, proved bounds, and their history, as JSON.

    social      the cheapest accepted plan:      social_cost, plan, provenance
    bound       the largest proved lower bound on the social cost: value, provenance
    equilibria  the cheapest and the costliest certified equilibrium: ... and epsilon
    risk        per plan, proved limits of the probability of any crash
    players     by name, what a player costs in the environment (:mod:`benchmarks.library.play`)
    history     every change: what, value, by, date

A plan has ``arrival`` and ``controls`` in full precision; means follow from them.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ppg_env.errors import InputError
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import read_text

CLOSED = 1e-4
"""A relative gap of at most this closes a game."""

CERTIFIED = 1e-4
"""Largest regret of a certified equilibrium, in time steps."""

CHEAPER = 1e-9
"""Relative difference from which a plan is better, and not a rounding error."""

TRACKED = ("social", "nash", "costliest-nash")
"""Players that track plans of the record, which change with it."""

Entry = dict[str, Any]


@dataclass
class Record:
    """What is known about one game; see the module."""

    social: Entry | None = None
    bound: Entry | None = None
    equilibria: list[Entry] = field(default_factory=list)
    risk: dict[str, list[float]] = field(default_factory=dict)
    players: dict[str, Entry] = field(default_factory=dict)
    history: list[Entry] = field(default_factory=list)

    @property
    def value(self) -> float:
        """The least social cost known; infinite without a plan."""
        return float("inf") if self.social is None else float(self.social["social_cost"])

    @property
    def gap(self) -> float:
        """Relative distance of the value from the bound; infinite without one of them."""
        if self.social is None or self.bound is None:
            return float("inf")
        return max(self.value - float(self.bound["value"]), 0.0) / max(abs(self.value), 1e-9)

    @property
    def closed(self) -> bool:
        """Whether the social optimum is known."""
        return self.gap <= CLOSED

    @property
    def best_player(self) -> str | None:
        """Name of the player with the least mean cost in the environment."""
        return min(self.players, key=lambda name: self.players[name]["cost"][0], default=None)

    @property
    def proof_seconds(self) -> float:
        """CPU seconds of the search that proved the bound; infinite without one."""
        if self.bound is None:
            return float("inf")
        return float(self.bound["provenance"].get("seconds", float("inf")))

    def tracked(self, player: str) -> Entry | None:
        """Return the entry of the plan that a player of :data:`TRACKED` tracks, None if none."""
        if player == "social":
            return self.social
        several = player in TRACKED and len(self.equilibria) > (player == "costliest-nash")
        return self.equilibria[0 if player == "nash" else -1] if several else None

    def offer_plan(self, social_cost: float, plan: Entry, provenance: Entry) -> bool:
        """Take an accepted plan if it is cheaper; return whether it is.

        A bound that the plan refutes is removed.
        """
        if self.bound is not None and social_cost < self.bound["value"] * (1 - 1e-6) - 1e-6:
            self._note("bound refuted", self.bound["value"], provenance)
            self.bound = None
        if self.social is not None and social_cost >= self.value - CHEAPER * abs(self.value):
            return False
        self.social = {"social_cost": social_cost, "plan": plan, "provenance": provenance}
        self.players.pop("social", None)
        self._note("social", social_cost, provenance)
        return True

    def offer_bound(self, value: float, provenance: Entry) -> bool:
        """Take a proved lower bound on the social cost if it is larger; return whether it is."""
        if self.bound is not None and value <= self.bound["value"]:
            return False
        self.bound = {"value": min(value, self.value), "provenance": provenance}
        self._note("bound", value, provenance)
        return True

    def offer_equilibrium(
        self, social_cost: float, epsilon: float, plan: Entry, provenance: Entry
    ) -> bool:
        """Take a certified equilibrium if it is the cheapest or the costliest; return whether."""
        if epsilon > CERTIFIED:
            return False
        costs = [entry["social_cost"] for entry in self.equilibria]
        inside = costs and min(costs) - 1e-6 <= social_cost <= max(costs) + 1e-6
        if inside:
            return False
        entry = {"social_cost": social_cost, "epsilon": epsilon, "plan": plan}
        ordered = [*self.equilibria, entry | {"provenance": provenance}]
        ordered.sort(key=lambda known: known["social_cost"])
        self.equilibria = ordered if len(ordered) < 2 else [ordered[0], ordered[-1]]
        for player in TRACKED[1:]:
            self.players.pop(player, None)
        self._note("equilibrium", social_cost, provenance)
        return True

    def offer_player(self, name: str, entry: Entry) -> bool:
        """Take what a player costs, in place of its last entry; return whether none costs less."""
        best = min((known["cost"][0] for known in self.players.values()), default=float("inf"))
        self.players[name] = entry
        cheaper: bool = entry["cost"][0] < best
        if cheaper:
            self._note("player " + name, entry["cost"][0], entry["provenance"])
        return cheaper

    def _note(self, what: str, value: float, provenance: Entry) -> None:
        shown = {key: provenance.get(key) for key in ("by", "date")}
        self.history.append({"what": what, "value": value, **shown})


def read_record(path: Path) -> Record:
    """Return the record in ``path``, or an empty one if there is no such file.

    Raises
    ------
    InputError
        If the file is not a record.
    """
    if not path.exists():
        return Record()
    text = read_text(path)
    try:
        record = Record(**json.loads(text))
        _check(record)
        return record
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        raise InputError(
            str(path), f"is not a record ({error!s:.200})", "restore it from version control"
        ) from None


def _check(record: Record) -> None:
    """Raise ValueError, TypeError or KeyError if an entry is not what the others rely on."""
    entries = [("social_cost", e) for e in (record.social, *record.equilibria) if e is not None]
    entries += [("value", record.bound)] if record.bound is not None else []
    for key, entry in entries:
        if type(entry[key]) not in (int, float) or not isinstance(entry["provenance"], dict):
            raise ValueError(f"{key} or its provenance has the wrong type")
    if not isinstance(record.risk, dict) or not isinstance(record.history, list):
        raise ValueError("risk or history has the wrong type")


def write_record(path: Path, record: Record) -> None:
    """Write the record atomically."""
    text = json.dumps(asdict(record), allow_nan=False, separators=(",", ":"))
    write_atomically(path, text + "\n")
