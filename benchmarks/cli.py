"""The command ``ppg``: one verb per file of :mod:`benchmarks.commands`.

Results go to stdout, progress and warnings to stderr.  Exit codes: 0 done, 2 bad input,
3 no solution within the limits, 130 interrupted.
"""

from __future__ import annotations

import errno
import sys
import warnings
from typing import Annotated

import typer

from benchmarks.commands import GROUPS, VERBS
from benchmarks.interrupt import ended_by_interrupts
from ppg_env.errors import InputError
from ppg_env.support.names import printable

BAD_INPUT = 2

app = typer.Typer(
    name="ppg",
    help="Path planning games: plan, certify, simulate and compare.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for name, command in VERBS.items():
    app.command(name)(command)
for group in GROUPS:
    app.add_typer(group)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"ppg {version('path-planning-games')}")
        raise typer.Exit


@app.callback()
def _program(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Options before the verb."""


def main(arguments: list[str] | None = None) -> None:
    """Run ``ppg`` and exit with its code."""
    # A callable object where the type stub wants a function.
    warnings.showwarning = _Once()  # type: ignore[assignment]
    try:
        with ended_by_interrupts():
            app(args=arguments)
    except InputError as error:
        print(f"ppg: {printable(str(error))}", file=sys.stderr)
        raise SystemExit(BAD_INPUT) from None
    except BrokenPipeError:  # the reader of a pipe, such as head, has closed it
        sys.stderr.close()
        raise SystemExit(0) from None
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        print(f"ppg: standard output: {error.strerror}; free some space.", file=sys.stderr)
        raise SystemExit(BAD_INPUT) from None


class _Once:
    """Shows a warning as one line on stderr; equal lines appear once."""

    def __init__(self) -> None:
        self.shown: set[str] = set()

    def __call__(self, message: Warning | str, *_where: object) -> None:
        line = f"ppg: note: {printable(str(message))}"
        if line not in self.shown:
            self.shown.add(line)
            print(line, file=sys.stderr)


if __name__ == "__main__":
    main()
