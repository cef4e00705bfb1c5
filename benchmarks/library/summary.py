"""What the records say, as text: closed and open games, and the best solver of each class."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from benchmarks.library.instance import CLASSES, Instance
from benchmarks.library.ranking import ran_by_all, standings
from benchmarks.library.runs import RUNS, Line, read_lines


def project_lines() -> list[Line]:
    """Return the lines of this project's solvers."""
    return [line for path in sorted(RUNS.glob("*.jsonl")) for line in read_lines(path)]


def class_rows(games: Sequence[Instance]) -> list[tuple[str, ...]]:
    """Return a row per class: games, closed, certified equilibria, best solver and its score.

    Scores are over the games of the class that all of the project's solvers ran.
    """
    lines = project_lines()
    rows: list[tuple[str, ...]] = []
    for kind in CLASSES:
        members = [game for game in games if game.difficulty == kind]
        ranked = standings(ran := ran_by_all(members, lines), lines) if members else []
        winner = f"{ranked[0].label} ({ranked[0].score:.1f} over {len(ran)})" if ranked else ""
        certified = sum(bool(game.record.equilibria) for game in members)
        closed = sum(game.record.closed for game in members)
        rows.append((kind, str(len(members)), str(closed), str(certified), winner))
    return rows


def open_rows(games: Sequence[Instance]) -> list[tuple[str, ...]]:
    """Return a row per open game: agents, best known social cost, bound and gap."""
    rows: list[tuple[str, ...]] = []
    for game in games:
        record = game.record
        if record.closed:
            continue
        value = "none" if record.social is None else f"{record.value:.6g}"
        bound = "none" if record.bound is None else f"{record.bound['value']:.6g}"
        gap = "" if record.gap == float("inf") else f"{100 * record.gap:.2f} %"
        rows.append((f"`{game.name}`", str(len(game.tables["agent"])), value, bound, gap))
    return rows


def sentences(games: Sequence[Instance]) -> Iterator[str]:
    """Yield what the records support."""
    closed = sum(game.record.closed for game in games)
    ends = [game.record.equilibria for game in games]
    yield (
        f"Of {len(games)} games {closed} are closed: the social cost of the best known plan is "
        "within a relative 1e-4 of a proved bound."
    )
    yield f"{sum(map(bool, ends))} games have an equilibrium with regrets of at most 1e-4 steps."
    ratios = sorted(
        pair[0]["social_cost"] / game.record.value
        for pair, game in zip(ends, games, strict=True)
        if pair and game.record.closed
    )
    if ratios:
        equal = sum(ratio <= 1 + 1e-4 for ratio in ratios)
        yield (
            f"In {equal} of the {len(ratios)} closed games with an equilibrium, the cheapest one "
            "known costs as much as the social optimum; in the costliest case "
            f"{ratios[-1]:.3g} times as much."
        )
    several = sum(len(pair) > 1 for pair in ends)
    yield f"{several} games have known equilibria of different social costs."
