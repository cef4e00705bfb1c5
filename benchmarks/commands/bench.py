"""``ppg bench``: measurements of the speeds that the documentation states."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated

import typer

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import print_json, print_table, working

if TYPE_CHECKING:
    from benchmarks.speed.measurement import Measurement

TITLES = {
    "planning": "Times in seconds",
    "engine": "The engine and MILP solvers, on one core",
    "walls": "Plans among walls, in CPU seconds on one core",
    "many": "Many agents, on one core",
    "environment": "The environment, on one core",
    "learning": "PPO's training loop, on one core",
    "sweep": "Sweeps",
    "risk": "Crash probabilities, on one core",
    "motion": "Plans that hold between steps, on one core",
    "feedback": "Feedback policies of two agents",
}
SUITES = {
    "planning": "benchmarks.speed.planning",
    "engine": "benchmarks.speed.engine",
    "walls": "benchmarks.speed.walls",
    "many": "benchmarks.speed.many_agents",
    "environment": "benchmarks.speed.environment",
    "learning": "benchmarks.speed.training",
    "sweep": "benchmarks.speed.sweeps",
    "risk": "benchmarks.speed.risk",
    "motion": "benchmarks.speed.motion",
    "feedback": "benchmarks.speed.feedback",
}


def bench(
    suite: Annotated[str, typer.Argument(metavar="|".join(SUITES), help="What to measure.")] = (
        "planning"
    ),
    quick: Annotated[bool, typer.Option("--quick", help="Smallest sizes, as a test.")] = False,
    as_json: JsonOption = False,
    seed: SeedOption = 0,
) -> None:
    """Measure plans, walls, crowds, the environment, PPO, sweeps, risks, motion or feedback."""
    from ppg_env.errors import require

    require(suite in SUITES, "suite", f"is {suite!r}", "write " + " or ".join(SUITES))
    measurements = import_module(SUITES[suite]).measurements
    rows = []
    with working("measuring") as status:
        for row in measurements(quick=quick, seed=seed):
            rows.append(row)
            status.update(f"measured {row.what}")
    if as_json:
        print_json({"measurements": [vars(row) | {"held": row.held} for row in rows]})
        return
    lines = [
        (row.what, f"{row.value:.3g}", _wanted(row), "yes" if row.held else "no") for row in rows
    ]
    print_table(TITLES[suite], ("what", "measured", "wanted", "held"), lines)


def _wanted(row: Measurement) -> str:
    return f"{'>=' if row.at_least else '<='} {row.target:g}" if row.target else ""
