"""Rows as a table in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.sweeps.row import Row
from benchmarks.terminal import print_table, probability, times
from ppg_env.support.statistics import Interval

SHOWN = 60
"""Largest number of rows printed; the store has all of them."""

AXES = (
    "objective", "lams", "gain", "noise", "speed", "horizon", "margin_cap", "crash_cost",
    "collisions", "on_goal", "start", "order", "charge", "seed",
)  # fmt: skip
"""Columns that are printed if rows differ in them."""

HEADS = {"lams": "lam", "margin_cap": "cap", "crash_cost": "crash cost", "on_goal": "on goal"}

NOTE = (
    "Social cost: sum of shifted costs. Crash: of any agent, 95 % intervals. Expected cost: mean "
    "over agents."
)


def print_rows(rows: Sequence[Row]) -> None:
    """Print a table on stdout, with a column for every axis in which the rows differ."""
    axes = [
        name
        for name in AXES
        if len({str(getattr(row, name)) for row in rows if getattr(row, name) is not None}) > 1
    ]
    heads = ("status", "arrival", "social cost", "crash probability", "expected cost")
    lines = [
        (row.scenario, row.player, *(_value(row, name) for name in axes), *_result(row))
        for row in rows[:SHOWN]
    ]
    more = f"{len(rows) - SHOWN} more rows are in the store. " if len(rows) > SHOWN else ""
    columns = ("scenario", "player", *(HEADS.get(name, name) for name in axes), *heads)
    print_table(f"{len(rows)} rows", columns, lines, more + NOTE, texts=2)


def _value(row: Row, name: str) -> str:
    value = getattr(row, name)
    if name == "lams" and row.lam is not None:
        value = row.lam
    if isinstance(value, list):
        return " ".join(f"{number:g}" for number in value)
    return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _result(row: Row) -> tuple[str, ...]:
    if row.failed:
        return (row.status, "", "", "", "")
    played = row.played_arrival or []
    shown = times(row.arrival) if row.arrival and row.arena == "schedule" else _means(played)
    overlap = bool(row.complaints)
    return (
        "overlap" if overlap else row.status,
        shown,
        "" if row.social_cost is None or overlap else f"{row.social_cost:.4f}",
        _crash(row),
        f"{row.expected_cost:.3f}",
    )


def _means(values: Sequence[float | None]) -> str:
    return " ".join("-" if value is None else f"{value:.2f}" for value in values)


def _crash(row: Row) -> str:
    assert row.crash_probability is not None
    assert row.crash_probability_low is not None
    assert row.crash_probability_high is not None
    limits = (row.crash_probability_low, row.crash_probability_high)
    return probability(Interval(row.crash_probability, *limits))
