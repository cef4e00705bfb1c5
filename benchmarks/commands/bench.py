"""``ppg bench``: the times that the documentation promises, measured here and now."""

from __future__ import annotations

from typing import Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import print_json, print_table, working


def bench(
    quick: Annotated[
        bool, typer.Option("--quick", help="Smallest sizes, to see that it runs.")
    ] = False,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Measure planning, simulation and start-up times on one core."""
    from benchmarks.timing import measurements

    rows = []
    with working("measuring") as status:
        for row in measurements(quick=quick, seed=seed):
            rows.append(row)
            status.update(f"measured {row.what}")
    if as_json:
        print_json({"measurements": [vars(row) for row in rows]})
        return
    shown = [
        (row.what, f"{row.seconds:.3f}", f"{row.limit:g}", "yes" if row.held else "no")
        for row in rows
    ]
    print_table("Times in seconds", ("what", "measured", "limit", "held"), shown)
