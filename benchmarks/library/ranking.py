"""Rankings of solvers, and performance profiles.

The score of a solver over n games is 100/n times the sum of (best known cost / its cost), with 0
for a game without an accepted plan.  Its performance profile at tau is the share of games in which
its cost is at most tau times the best known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.library.instance import Instance
from benchmarks.library.record import CLOSED
from benchmarks.library.runs import Line


@dataclass(frozen=True)
class Standing:
    """The place of a solver.

    Attributes
    ----------
    label : its name.
    ratios : for each game, its cost over the best known; infinite without an accepted plan.
    refused : number of plans that the checker refused.
    seconds : CPU seconds in all.
    """

    label: str
    ratios: tuple[float, ...]
    refused: int
    seconds: float

    @property
    def accepted(self) -> int:
        """Number of accepted plans."""
        return sum(ratio < float("inf") for ratio in self.ratios)

    @property
    def best(self) -> int:
        """Number of games in which it is as good as the best known plan."""
        return sum(ratio <= 1 + CLOSED for ratio in self.ratios)

    @property
    def score(self) -> float:
        """Score from 0 to 100."""
        return 100 * sum(1 / ratio for ratio in self.ratios) / max(len(self.ratios), 1)

    def share(self, tau: float) -> float:
        """Return the share of games with a ratio of at most ``tau``."""
        return sum(ratio <= tau for ratio in self.ratios) / max(len(self.ratios), 1)


def ran_by_all(games: Sequence[Instance], lines: Sequence[Line]) -> list[Instance]:
    """Return the games that every solver ran which ran any of them, in their current version."""
    current = {(game.name, game.digest) for game in games}
    ran: dict[str, set[tuple[str, str]]] = {}
    for line in lines:
        if (line["game"], line["digest"]) in current:
            ran.setdefault(line["label"], set()).add((line["game"], line["digest"]))
    shared = current.intersection(*ran.values())
    return [game for game in games if (game.name, game.digest) in shared]


def standings(games: Sequence[Instance], lines: Sequence[Line]) -> list[Standing]:
    """Return the solvers that ran in all ``games``, the best score first.

    Lines of another version of a game are left out.  A plan that is better than the record counts
    as the best known.
    """
    current = {game.name: game.digest for game in games}
    table: dict[str, dict[str, Line]] = {}
    for line in lines:
        if current.get(line["game"]) == line["digest"]:
            table.setdefault(line["label"], {})[line["game"]] = line
    best = {game.name: game.record.value for game in games}
    for line in (line for rows in table.values() for line in rows.values()):
        best[line["game"]] = min(best[line["game"]], _cost(line))
    ranked = [
        Standing(
            label,
            tuple(_ratio(_cost(rows[name]), best[name]) for name in current),
            sum(line["status"] == "refused" for line in rows.values()),
            sum(float(line.get("seconds") or 0) for line in rows.values()),
        )
        for label, rows in table.items()
        if current.keys() <= rows.keys()
    ]
    return sorted(ranked, key=lambda standing: (-standing.score, standing.seconds))


def _cost(line: Line) -> float:
    accepted = line["status"] == "accepted" and line["social_cost"] is not None
    return float(line["social_cost"]) if accepted else float("inf")


def _ratio(cost: float, best: float) -> float:
    if cost == float("inf"):
        return cost
    return max(cost / best, 1.0) if best > 0 else 1.0
