"""``ppg risk``: the crash probability of a plan."""

from __future__ import annotations

from time import monotonic
from typing import Annotated, Any

import typer

from benchmarks.options import JsonOption, PlanArgument, SeedOption, WorkersOption
from benchmarks.terminal import print_json, print_table, probability, working

METHODS = ("bound", "mc")


def risk(
    plan: PlanArgument,
    method: Annotated[str, typer.Option(metavar="|".join(METHODS), help="How to find it.")] = "mc",
    episodes: Annotated[int, typer.Option(min=1, help="Simulated episodes, for mc.")] = 1_000_000,
    workers: WorkersOption = 1,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Crash probability of a plan: the union bound, or Monte Carlo with exact intervals."""
    from ppg_env.errors import require
    from ppg_env.evaluate import evaluate
    from ppg_env.planfile import read_plan

    require(method in METHODS, "--method", f"is {method!r}", "write " + " or ".join(METHODS))
    game, profile, _ = read_plan(plan)
    complaints = evaluate(game, profile).complaints()
    if complaints:
        typer.echo(f"ppg: {plan} is no valid plan: {'; '.join(complaints)}.", err=True)
    begun = monotonic()
    if method == "bound":
        judged = evaluate(game, profile)
        each = [_at_most(float(value)) for value in judged.risk_bound]
        anybody, samples = _at_most(judged.risk_bound_any), 0
        shown = [f"<= {entry['high']:.2e}" for entry in (*each, anybody)]
    else:
        from ppg_env.montecarlo import crash_counts

        done = 0
        with working("simulating") as status:

            def tell(count: int) -> None:
                nonlocal done
                done += count
                status.update(f"simulated {done:,} of {episodes:,} episodes")

            counts = crash_counts(game, profile, episodes, seed, workers=workers, progress=tell)
        found, any_found = counts.estimates()
        each = [_estimate(e) for e in found]
        anybody, samples = _estimate(any_found), episodes
        shown = [probability(e) for e in (*found, any_found)]
    if as_json:
        print_json(
            {
                "agents": each,
                "any": anybody,
                "method": method,
                "samples": samples,
                "seconds": monotonic() - begun,
                "complaints": list(complaints),
            }
        )
        return
    what = "union bound" if method == "bound" else f"{samples:,} episodes, 95 % intervals"
    print_table(
        f"{plan}: crash probability ({what})",
        ("agent", "probability"),
        list(zip((*game.agent_names, "any"), shown, strict=True)),
    )


def _at_most(bound: float) -> dict[str, Any]:
    limit = min(bound, 1.0)
    return {"probability": limit, "low": 0.0, "high": limit}


def _estimate(estimate: Any) -> dict[str, Any]:
    return {"probability": estimate.value, "low": estimate.low, "high": estimate.high}
