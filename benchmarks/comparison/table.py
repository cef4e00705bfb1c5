"""The results of a comparison as a table on the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.comparison.overlaps import between_steps_note
from benchmarks.comparison.report import game_name
from benchmarks.comparison.results import Played, PlayerResult
from benchmarks.terminal import outward, print_note, print_table, probability, times
from ppg_env.game.between_steps import overlap_times
from ppg_env.game.game import Game
from ppg_env.support.statistics import Interval

SCHEDULE_COLUMNS = (
    "player",
    "sees",
    "arrival",
    "social cost",
    "regret <=",
    "crash probability",
    "risk bound",
    "expected cost",
)
ENV_COLUMNS = (
    "player",
    "sees",
    "runs",
    "arrival",
    "arrived %",
    "crash probability",
    "expected cost",
)
STARS = {"*": "* rare-event method", "**": "** not to be trusted"}
"""Marks of crash probabilities that were not counted."""

NOTE = "{episodes:,} episodes {where}; 95 % intervals; {stars}see ppg explain compare."
WHERE = {"schedule": "on schedule", "env": "in the environment"}


def print_results(
    game: Game,
    rows: Sequence[PlayerResult],
    arena: str,
    episodes: int,
    tolerance: float | None = None,
) -> None:
    """Print one line per player; players without a plan show their status, and why below."""
    cells = _schedule_cells if arena == "schedule" else _env_cells
    columns = SCHEDULE_COLUMNS if arena == "schedule" else ENV_COLUMNS
    lines = [
        cells(row) if row.played else (row.player, row.status, *[""] * (len(columns) - 2))
        for row in rows
    ]
    failures = [f"{row.player}: {row.advice}." for row in rows if not row.played]
    marks = sorted({_star(row.played) for row in rows if row.played} - {""})
    stars = "".join(f"{STARS[mark]}; " for mark in marks)
    where = WHERE[arena] + ("" if tolerance is None else f", arrival within {tolerance:g}")
    note = NOTE.format(episodes=episodes, where=where, stars=stars)
    lams = sorted({agent.lam for agent in game.agents})
    print_table(
        f"{game_name(game)}: objective {game.objective}, lam {', '.join(f'{x:g}' for x in lams)}; "
        f"a crash is an overlap {overlap_times(game)}",
        columns,
        lines,
        "\n".join([*failures, note]),
        texts=2,
    )
    print_note(between_steps_note(game, {row.player: row.profile for row in rows}))


def _schedule_cells(row: PlayerResult) -> tuple[str, ...]:
    assert row.solution is not None
    evaluation, played, regret = row.solution.evaluation, row.played, row.solution.regret
    assert evaluation is not None
    assert played is not None
    overlap = "" if evaluation.feasible else "overlap"
    bound = evaluation.risk_bound_any if evaluation.game.scale == "exact" else None
    return (
        row.player,
        played.information,
        times(evaluation.arrival),
        overlap or f"{evaluation.social_cost:.4f}",
        "" if regret is None else outward(float(regret.max()), ".0e", up=True),
        _crash(played),
        overlap or ("" if bound is None else outward(bound, ".1e", up=True)),
        _interval(played.expected_cost),
    )


def _env_cells(row: PlayerResult) -> tuple[str, ...]:
    played = row.played
    assert played is not None
    assert played.success is not None
    spread = played.over_runs
    return (
        row.player,
        played.information,
        str(played.runs) if spread else "",
        " ".join("-" if time != time else f"{time:.2f}" for time in played.arrival),
        " ".join(f"{100 * share.value:.1f}" for share in played.success),
        _crash(played),
        _interval(spread["expected_cost"] if spread else played.expected_cost),
    )


def _crash(played: Played) -> str:
    """Return the crash probability; over runs if there are several and crashes were counted."""
    if played.method == "rare" or played.over_runs is None or not played.crash_any.value:
        return probability(played.crash_any) + _star(played)
    return probability(played.over_runs["crash_probability"])


def _star(played: Played) -> str:
    """Return the mark of a probability that was not counted, see ``STARS``."""
    if played.method == "mc":
        return ""
    return "*" if played.crash_any.trusted else "**"


def _interval(interval: Interval) -> str:
    """Return a value and half its interval, rounded up so that the printed interval holds it."""
    centre = f"{interval.value:.3f}"
    half = max(interval.high - float(centre), float(centre) - interval.low)
    return f"{centre} ± {outward(half, '.3f', up=True)}"
