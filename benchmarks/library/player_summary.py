"""What the records say about players in the environment, and families of games."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from statistics import median

from benchmarks.library.instance import CLASSES, Instance
from benchmarks.library.ranking import ran_by_all, standings
from benchmarks.library.summary import project_lines

PLAYER_HEADS = ("player", "games", "best in", "median cost over best", "median crash probability")
FAMILY_HEADS = ("family", "games", "closed", "best solver (score)", "best player (games)")


def player_rows(games: Sequence[Instance]) -> list[tuple[str, ...]]:
    """Return a row per player: in how many games it is the best known, and how it compares.

    Its cost is divided by the least of all players' in the same game; ties are best, too.
    """
    ratios: dict[str, list[float]] = {}
    crashes: dict[str, list[float]] = {}
    best: Counter[str] = Counter()
    for record in (game.record for game in games):
        least = min((entry["cost"][0] for entry in record.players.values()), default=0.0)
        for name, entry in record.players.items():
            ratios.setdefault(name, []).append(entry["cost"][0] / least if least else 1.0)
            crashes.setdefault(name, []).append(entry["crash"][0])
            best[name] += entry["cost"][0] <= least * (1 + 1e-9)
    ordered = sorted(ratios, key=lambda name: (-best[name], name))
    return [
        (
            f"`{name}`",
            str(len(ratios[name])),
            str(best[name]),
            f"{median(ratios[name]):.3f}",
            f"{median(crashes[name]):.2g}",
        )
        for name in ordered
    ]


def best_players(games: Sequence[Instance]) -> str:
    """Return the player that is the best known in most of the games, and in how many."""
    known = [game.record.best_player for game in games if game.record.players]
    if not known:
        return ""
    ((name, count),) = Counter(known).most_common(1)
    return f"{name} ({count} of {len(known)})"


def family(game: Instance) -> str:
    """Return the kind of a game: its name up to the first digit or dash."""
    name = game.path.parent.name
    return "intersection3" if name.startswith("intersection3") else re.split(r"[\d-]", name)[0]


def family_rows(games: Sequence[Instance]) -> list[tuple[str, ...]]:
    """Return a row per family: closed games, best solver over those that all ran, best player."""
    lines = project_lines()
    rows: list[tuple[str, ...]] = []
    for kind in sorted({family(game) for game in games}):
        members = [game for game in games if family(game) == kind]
        ran = ran_by_all(members, lines)
        ranked = standings(ran, lines) if ran else []
        winner = f"{ranked[0].label} ({ranked[0].score:.1f} over {len(ran)})" if ranked else ""
        closed = sum(game.record.closed for game in members)
        rows.append((kind, str(len(members)), str(closed), winner, best_players(members)))
    return rows


def player_sentences(games: Sequence[Instance]) -> Iterator[str]:
    """Yield what the records say about players."""
    played = [game for game in games if game.record.players]
    yield (
        f"{len(played)} games have simulated players in the environment, "
        f"{sum(len(game.record.players) for game in played)} in all."
    )
    bounded = sum(any("regret" in e for e in g.record.players.values()) for g in played)
    yield f"In {bounded} games the regret of a player is bounded from both sides."
    for kind in CLASSES:
        members = [game for game in played if game.difficulty == kind]
        if members:
            yield f"Class {kind}: the most frequent best player is {best_players(members)}."
