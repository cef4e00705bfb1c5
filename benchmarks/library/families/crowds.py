"""Many agents: circles, crossing streams, and starts and goals at random."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.library.families.tables import Draft, scenario_tables


def games() -> Iterator[Draft]:
    """Yield circles of 3 to 20, streams of 4 to 50 and random fields of 2 to 30 agents."""
    for n, speed in ((3, "l1"), (3, "box"), (4, "l1"), (4, "box"), (5, "l1"), (5, "box")):
        yield f"circle{n}-{speed}", scenario_tables(f"circle({n})", speed=speed, objective="risk")
    for n in (6, 7, 8, 10, 12, 20):
        yield f"circle{n}-l1", scenario_tables(f"circle({n})", speed="l1", objective="risk")
    for n in (3, 4):
        fields = {"speed": "l1", "objective": "risk", "collisions": "swept"}
        yield f"circle{n}-l1-swept", scenario_tables(f"circle({n})", **fields)
    for n in (4, 5, 6, 8, 10, 12, 20, 30, 50):
        yield f"streams{n}-l1", scenario_tables(f"streams({n})", speed="l1", objective="risk")
    for n, seeds in ((2, 6), (3, 6), (4, 6), (5, 4), (6, 3), (8, 2), (12, 2), (20, 1), (30, 1)):
        for seed in range(seeds):
            rules = {"speed": ("l1", "box", "disc")[seed % 3]}
            rules["collisions"] = ("swept", "instants")[seed % 2]
            tables = scenario_tables(f"random({n}, {seed})", objective="risk", lam=0.6, **rules)
            yield f"random{n}-{seed}", tables
