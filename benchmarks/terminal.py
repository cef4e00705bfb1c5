"""Output for people: tables on stdout, progress on stderr; and JSON for machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from time import perf_counter
from typing import Any, NoReturn, Protocol

import typer

from ppg_env.support.names import printable

NO_SOLUTION = 3
LOG_SECONDS = 30.0
"""Seconds between two lines of progress where stderr is no terminal."""

PIPE_WIDTH = 124
LONGEST_WORD = 28
"""Words up to this length are not broken; longer ones are names that people chose."""


class Limits(Protocol):
    """A value with the limits of its interval."""

    @property
    def value(self) -> float:
        """The estimate."""

    @property
    def low(self) -> float:
        """Lower limit."""

    @property
    def high(self) -> float:
        """Upper limit."""


def print_json(content: Any) -> None:
    """Print one JSON object on stdout."""
    from ppg_env.formats.plan_file import to_json

    typer.echo(to_json(content))


def print_table(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    note: str = "",
    texts: int = 1,
) -> None:
    """Print a table on stdout; the first ``texts`` columns are words, the others numbers.

    ``note`` is printed below the table.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(title),
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )
    console = Console()
    if not console.is_terminal:  # a pipe has no width of its own
        console = Console(width=PIPE_WIDTH)
    widths = _widths([columns, *rows], console.width - 2 * len(columns))
    for k, column in enumerate(columns):
        table.add_column(
            Text(column),
            justify="left" if k < texts else "right",
            overflow="fold",
            width=widths[k],
        )
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # names are text, never markup
    console.print(table)
    if note:
        # Not the table's caption, which would be wrapped at the width of the table.
        console.print(note, style="table.caption", markup=False, highlight=False)


def _widths(lines: Sequence[Sequence[str]], room: int) -> list[int]:
    """Return widths of columns: as wide as their cells, or folded between words to fit ``room``."""
    cells = list(zip(*lines, strict=True))
    widths = [max(len(line) for cell in column for line in cell.split("\n")) for column in cells]
    words = [max(len(word) for cell in column for word in [*cell.split(), ""]) for column in cells]
    least = [min(word, LONGEST_WORD) for word in words]
    while sum(widths) > room:
        k = max(range(len(widths)), key=lambda k: widths[k] - least[k])
        if widths[k] <= least[k]:
            break
        widths[k] -= 1
    return widths


def print_note(text: str) -> None:
    """Print a line on stdout, in one piece; nothing if it is empty."""
    if text:
        typer.echo(text)


class _Log:
    """Progress for a log file: a line now and then, where no terminal shows a spinner or a bar."""

    def __init__(self) -> None:
        self._last = perf_counter()

    def update(self, text: str, *, last: bool = False) -> None:
        """Print ``text`` if it is the ``last``, or a line is at least :data:`LOG_SECONDS` old."""
        if last or perf_counter() - self._last >= LOG_SECONDS:
            self._last = perf_counter()
            typer.echo(f"ppg: {printable(text)}", err=True)


class _Spinner:
    def __init__(self, status: Any) -> None:
        self._status = status

    def update(self, text: str) -> None:
        """Show ``text``, in which nothing is markup."""
        from rich.text import Text

        self._status.update(Text(printable(text)))


@contextmanager
def working(text: str) -> Iterator[_Log | _Spinner]:
    """Show a spinner on stderr; yields an object with ``update(text)``."""
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Log()
        return
    with console.status(Text(printable(text))) as status:
        yield _Spinner(status)


@contextmanager
def bar(text: str, total: int) -> Iterator[Callable[[int | str], None]]:
    """Show a progress bar on stderr with the time left; yields a function that advances it.

    Called with a text instead of a number, the function shows the text after the bar's own.

    It appears at the first advance, so that an error before it leaves only its sentence.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    console, log = Console(stderr=True), _Log()
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    shown = Progress(*columns, TimeRemainingColumn(), console=console)
    task, done, begun = shown.add_task(printable(text), total=total), 0, perf_counter()
    label = text

    def advance(step: int | str) -> None:
        nonlocal done, label
        if isinstance(step, str):
            label = f"{text}, {step}" if step else text
        else:
            done = min(done + step, total)  # whole rollouts may overshoot
        if not console.is_terminal:
            seconds = perf_counter() - begun
            log.update(f"{label}: {done}/{total} in {seconds:.0f} s", last=done == total)
            return
        shown.start()
        shown.update(task, completed=done, description=printable(label))

    try:
        yield advance
    finally:
        if shown.live.is_started:
            shown.stop()


def no_solution(advice: str) -> NoReturn:
    """Report why there is no plan, and exit with code 3."""
    typer.echo(f"ppg: no solution: {advice}.", err=True)
    raise typer.Exit(NO_SOLUTION)


def outward(value: float, spec: str, up: bool) -> str:
    """Return ``value`` in the format ``spec``, rounded up or down instead of to the nearest.

    ``spec`` is that of a number with digits, such as ``.1e``, ``+.1e``, ``.3f`` or ``.4g``.
    """
    if value - value != 0:  # infinite or nan
        return f"{value:{spec}}"
    way = ROUND_CEILING if up else ROUND_FLOOR
    digits, kind = int(spec[:-1].rpartition(".")[2]), spec[-1]
    exact = Decimal(repr(float(value)))
    if kind == "f":
        rounded = exact.quantize(Decimal(1).scaleb(-digits), way, Context(prec=400))
    else:
        rounded = Context(prec=digits + (kind == "e"), rounding=way).plus(exact)
    return f"{float(rounded):{spec}}"


def interval(estimate: Limits, spec: str = ".2e", limits: str = ".1e") -> str:
    """Return ``value [low, high]``; the limits are rounded outward, so that they hold the value.

    ``limits`` is their format, with at most as many digits as ``spec``.  Limits that are nan are
    left out.
    """
    value = f"{estimate.value:{spec}}"
    if estimate.low != estimate.low:
        return value
    low, high = outward(estimate.low, limits, up=False), outward(estimate.high, limits, up=True)
    return f"{value} [{low}, {high}]"


def probability(estimate: Limits) -> str:
    """Return a probability with its interval; if no crash was seen the upper limit, never zero."""
    if estimate.value == 0:
        return f"< {outward(estimate.high, '.1e', up=True)}"
    return interval(estimate)


def times(arrival: Sequence[int | None]) -> str:
    """Return arrival times in a row; a dash for a goal never reached."""
    return " ".join("-" if t is None else str(t) for t in arrival)
