"""``ppg bench``: what the documentation promises of speed, measured here and now."""

from __future__ import annotations

from typing import Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import print_json, print_table, working

SUITES = ("planning", "environment")


def bench(
    suite: Annotated[str, typer.Argument(metavar="|".join(SUITES), help="What to measure.")] = (
        "planning"
    ),
    quick: Annotated[bool, typer.Option("--quick", help="Smallest sizes, to see it run.")] = False,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Measure planning and start-up times, or the environment's rates beside its rivals'."""
    from ppg_env.errors import require

    require(suite in SUITES, "suite", f"is {suite!r}", "write " + " or ".join(SUITES))
    if suite == "planning":
        _planning(quick, seed, as_json)
    else:
        _environment(quick, seed, as_json)


def _planning(quick: bool, seed: int, as_json: bool) -> None:
    from benchmarks.timing import measurements

    rows = []
    with working("measuring") as status:
        for row in measurements(quick=quick, seed=seed):
            rows.append(row)
            status.update(f"measured {row.what}")
    if as_json:
        print_json({"measurements": [vars(row) | {"held": row.held} for row in rows]})
        return
    shown = [(row.what, f"{row.seconds:.3f}", f"{row.limit:g}", _yes(row.held)) for row in rows]
    print_table("Times in seconds", ("what", "measured", "limit", "held"), shown)


def _environment(quick: bool, seed: int, as_json: bool) -> None:
    from benchmarks.rates import ratios

    rows = []
    with working("measuring") as status:
        for row in ratios(quick=quick, seed=seed):
            rows.append(row)
            status.update(f"measured {row.what}")
    if as_json:
        print_json({"measurements": [vars(row) | {"held": row.held} for row in rows]})
        return
    shown = [
        (row.what, f"{row.value:.3g}", f"{'>=' if row.at_least else '<='} {row.target:g}",
         _yes(row.held))
        for row in rows
    ]  # fmt: skip
    print_table("The environment, on one core", ("what", "measured", "target", "held"), shown)


def _yes(held: bool) -> str:
    return "yes" if held else "no"
