"""The report of the library: one HTML file without references to others.

Names come from files and commands, so every text is escaped.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from benchmarks.library.instance import CLASSES, Instance
from benchmarks.library.learned.summary import ENTRY_HEADS, entry_rows
from benchmarks.library.player_summary import FAMILY_HEADS, PLAYER_HEADS, family_rows, player_rows
from benchmarks.library.ranking import Standing

COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e44ad", "#b9770e", "#555555")
TAUS = tuple(1 + k / 100 for k in range(101))
WIDTH, HEIGHT, LEFT, BELOW = 640, 300, 46, 30
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0}
td,th{padding:.15rem .7rem;border-bottom:1px solid #ddd}
td{text-align:right;font-variant-numeric:tabular-nums}td:first-child,th:first-child{text-align:left}
svg text{font:12px system-ui,sans-serif}"""


def page(games: Sequence[Instance], ranked: Sequence[Standing]) -> str:
    """Return the report on ``games``, and on solvers that all ran the same games."""
    ran = max((len(standing.ratios) for standing in ranked), default=0)
    closed = sum(game.record.closed for game in games)
    certified = sum(bool(game.record.equilibria) for game in games)
    words = (
        f"{len(games)} games; {closed} closed (gap at most 1e-4); {certified} with a certified "
        "equilibrium."
    )
    title = "The instance library"
    return "\n".join(
        (
            f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
            f"<style>{STYLE}</style></head><body><h1>{title}</h1><p>{words}</p>",
            f"<h2>Solvers</h2><p>Over the {ran} games that all of these solvers ran.</p>",
            _table(
                ("solver", "score", "accepted", "as good as known", "refused", "CPU s"),
                _solvers(ranked),
            ),
            "<h2>Performance profile</h2><p>Share of the games in which the cost is at most tau "
            "times the best known.</p>",
            profile_svg(ranked),
            "<h2>Gaps</h2>",
            _table(("class", "games", "closed", "median gap of the others"), _classes(games)),
            "<h2>Players in the environment</h2>",
            _table(PLAYER_HEADS, player_rows(games)),
            "<h2>Families</h2>",
            _table(FAMILY_HEADS, family_rows(games)),
            "<h2>Learned tracks</h2>",
            _table(ENTRY_HEADS, entry_rows()),
            "<h2>Records</h2>",
            _table(
                (
                    "game",
                    "class",
                    "agents",
                    "social cost",
                    "gap",
                    "equilibria",
                    "found by",
                    "changes",
                ),
                _records(games),
            ),
            "</body></html>",
        )
    )


def profile_svg(ranked: Sequence[Standing]) -> str:
    """Return the performance profiles as a picture; tau from 1 to 2."""
    lines = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" role="img" '
        'aria-label="Performance profiles">'
    ]
    for share in (0, 0.25, 0.5, 0.75, 1):
        y = _y(share)
        lines.append(f'<line x1="{LEFT}" x2="{WIDTH - 160}" y1="{y}" y2="{y}" stroke="#ddd"/>')
        lines.append(f'<text x="4" y="{y + 4}">{share:.0%}</text>')
    lines += [f'<text x="{_x(tau) - 8}" y="{HEIGHT - 8}">{tau:g}</text>' for tau in (1, 1.5, 2)]
    for k, standing in enumerate(ranked):
        colour = COLOURS[k % len(COLOURS)]
        points = " ".join(f"{_x(tau):.1f},{_y(standing.share(tau + 1e-4)):.1f}" for tau in TAUS)
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
        )
        place = f'x="{WIDTH - 150}" y="{20 + 18 * k}" fill="{colour}"'
        lines.append(f"<text {place}>{escape(standing.label)}</text>")
    return "\n".join([*lines, "</svg>"])


def _x(tau: float) -> float:
    return LEFT + (tau - 1) * (WIDTH - 160 - LEFT)


def _y(share: float) -> float:
    return 10 + (1 - share) * (HEIGHT - BELOW - 10)


def _solvers(ranked: Sequence[Standing]) -> Iterable[tuple[str, ...]]:
    for one in ranked:
        counts = (one.accepted, one.best, one.refused)
        yield one.label, f"{one.score:.1f}", *map(str, counts), f"{one.seconds:.1f}"


def _classes(games: Sequence[Instance]) -> Iterable[tuple[str, ...]]:
    for kind in CLASSES:
        members = [game for game in games if game.difficulty == kind]
        gaps = sorted(game.record.gap for game in members if not game.record.closed)
        middle = f"{gaps[len(gaps) // 2]:.2%}" if gaps else ""
        closed = sum(game.record.closed for game in members)
        yield kind, str(len(members)), str(closed), middle.replace("inf%", "no bound")


def _records(games: Sequence[Instance]) -> Iterable[tuple[str, ...]]:
    for game in games:
        record = game.record
        found = "" if record.social is None else str(record.social["provenance"].get("by", ""))
        value = "" if record.social is None else f"{record.value:.6g}"
        agents, gap = str(len(game.tables["agent"])), record.gap
        shown = "" if gap == float("inf") else f"{gap:.2e}"
        ends = " to ".join(f"{entry['social_cost']:.6g}" for entry in record.equilibria)
        yield (
            game.name,
            game.difficulty,
            agents,
            value,
            shown,
            ends,
            found,
            str(len(record.history)),
        )


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell.strip('`'))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"
