"""``ppg scenarios``: the list of scenarios."""

from __future__ import annotations

from benchmarks.options import JsonOption, SeedOption
from benchmarks.terminal import print_json, print_table


def scenarios(as_json: JsonOption = False, seed: SeedOption = 0) -> None:
    """List the scenarios and families of games."""
    from ppg_env.scenarios.make import scenarios as listing

    summaries = listing()
    if as_json:
        print_json(
            {"scenarios": [{"call": call, "summary": text} for call, text in summaries.items()]}
        )
        return
    print_table(
        "Scenarios",
        ("GAME", "what it is"),
        list(summaries.items()),
        "Families take arguments, as in 'circle(10, radius=90)'.",
        texts=2,
    )
