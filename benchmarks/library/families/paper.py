"""The paper's scenarios over speed set, objective, lam, gain and rule of collisions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from benchmarks.library.families.tables import Draft, scenario_tables

SCENARIOS = ("opposing", "head_on", "parallel", "intersection", "intersection3")


def games() -> Iterator[Draft]:
    """Yield the grid of speed sets and objectives, and the variations of the L1 games."""
    for scenario, speed, objective in product(SCENARIOS, ("box", "l1", "disc"), ("margin", "risk")):
        name = f"{scenario}-{speed}-{objective}-0.5"
        yield name, scenario_tables(scenario, speed=speed, objective=objective, lam=0.5)
    for scenario in SCENARIOS:
        for lam, gain, collisions in (
            (0.8, 0.5, "instants"),
            (0.8, 0.0, "swept"),
            (0.2, 0.5, "swept"),
        ):
            fields = {"lam": lam, "gain": gain, "collisions": collisions}
            name = f"{scenario}-l1-risk-{lam}"
            name += ("" if gain else "-open_loop") + ("-swept" if collisions == "swept" else "")
            yield name, scenario_tables(scenario, speed="l1", objective="risk", **fields)
