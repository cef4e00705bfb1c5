"""What people see: tables on stdout, progress on stderr; and JSON for machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

import typer

if TYPE_CHECKING:
    from ppg_env.support.statistics import Estimate, Interval, RareEstimate

NO_SOLUTION = 3
PIPE_WIDTH = 124
NAME_WIDTH = 14  # the first column is not folded below this


def print_json(content: Any) -> None:
    """One JSON object on stdout."""
    from ppg_env.formats.plan_file import to_json

    typer.echo(to_json(content))


def print_table(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    note: str = "",
    texts: int = 1,
) -> None:
    """A table on stdout; the first ``texts`` columns are words, the others numbers."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(
        title=title,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
        caption=note or None,
        caption_justify="left",
    )
    widest = min(max([len(columns[0]), *(len(row[0]) for row in rows)]), NAME_WIDTH)
    for k, column in enumerate(columns):
        table.add_column(
            column,
            justify="left" if k < texts else "right",
            overflow="fold",
            min_width=None if k else widest,
        )
    for row in rows:
        table.add_row(*row)
    console = Console()
    if not console.is_terminal:  # a pipe has no width of its own
        console = Console(width=PIPE_WIDTH)
    console.print(table)


@contextmanager
def working(text: str) -> Iterator[Any]:
    """A spinner on stderr while something runs; yields an object with ``update(text)``."""
    from rich.console import Console

    with Console(stderr=True).status(text) as status:
        yield status


@contextmanager
def bar(text: str, total: int) -> Iterator[Callable[[int], None]]:
    """A progress bar on stderr with the time left; yields a function that advances it.

    It shows from the first advance on: a mistake that is found before leaves only its sentence.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    shown = Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True))
    task, done = shown.add_task(text, total=total), 0

    def advance(count: int) -> None:
        nonlocal done
        shown.start()
        done = min(done + count, total)  # whole rollouts may overshoot
        shown.update(task, completed=done)

    try:
        yield advance
    finally:
        if shown.live.is_started:
            shown.stop()


def no_solution(advice: str) -> NoReturn:
    """Say why there is no plan, and leave with exit code 3."""
    typer.echo(f"ppg: no solution: {advice}.", err=True)
    raise typer.Exit(NO_SOLUTION)


def probability(estimate: Estimate | RareEstimate | Interval) -> str:
    """An estimate with its interval; no crash seen shows the upper limit, never zero."""
    if estimate.value == 0:
        return f"< {estimate.high:.1e}"
    return f"{estimate.value:.2e} [{estimate.low:.1e}, {estimate.high:.1e}]"


def times(arrival: Sequence[int | None]) -> str:
    """Arrival times in a row; a dash for a goal never reached."""
    return " ".join("-" if t is None else str(t) for t in arrival)
