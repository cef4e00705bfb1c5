"""Plans of the library whose crashes are counted in 10^9 plain episodes each.

Episodes are numbered, and the noise of each depends on the seed and its number alone, so that
the counts do not depend on the pieces in which they are made.  The counts are in
billion_episodes.json; the file is written after each piece.  This continues them, for at most the
given CPU seconds:  ``python -m tests.oracles.billion_episodes 600``
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks.library.instance import FOLDER, Instance
from benchmarks.library.judge import profile_of
from ppg_env import Game
from ppg_env.formats.plan_file import to_json
from ppg_env.game.plan import Profile
from ppg_env.risk.monte_carlo import crash_counts
from ppg_env.support.atomic_write import write_atomically

FILE = Path(__file__).with_suffix(".json")
SAMPLES, SEED = 1_000_000_000, 11
PIECE = 1024 * 20_000

CASES = (
    "head_on-l1-risk-0.8/1",
    "head_on-l1-risk-0.8-open_loop-swept/1",
    "moving1-0/1",
    "corridor45-instants/1",
    "intersection3-l1-margin-0.5/1",
)
"""Games of the library.  The counted plans stand in the file, since records may improve."""

BLANK = {"samples": 0, "agents": 0, "encounters": 0, "any": 0, "cpu_seconds": 0.0}


def stored() -> dict[str, Any]:
    """Return the content of the file."""
    if not FILE.exists():
        return {"seed": SEED, "cases": dict.fromkeys(CASES, BLANK)}
    content: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return content


def case(name: str) -> tuple[Game, Profile]:
    """Return a game of the library and the counted plan."""
    instance, row = Instance(FOLDER / f"{name}.toml"), stored()["cases"][name]
    return instance.game, profile_of(instance, row if row["samples"] else social(instance))


def social(instance: Instance) -> dict[str, Any]:
    """Return the cheapest plan on record."""
    assert instance.record.social is not None
    plan: dict[str, Any] = instance.record.social["plan"]
    return plan


def count_piece(name: str) -> None:
    """Count the next episodes of a case, and write the sums."""
    (game, profile), content, began = case(name), stored(), process_time()
    row = content["cases"][name]
    start = row["samples"]
    counts = crash_counts(game, profile, min(PIECE, SAMPLES - start), SEED, start=start)
    content["cases"][name] = {
        "samples": start + counts.samples,
        "agents": counts.agents + row["agents"],
        "encounters": counts.encounters + row["encounters"],
        "any": counts.any + row["any"],
        "cpu_seconds": round(row["cpu_seconds"] + process_time() - began, 1),
        "controls": [plan.controls for plan in profile],
    }
    write_atomically(FILE, to_json(content) + "\n")


def count(seconds: float) -> None:
    """Count pieces until the time is over: a tenth of every case, then one case after the other."""
    while process_time() < seconds:
        done = {name: row["samples"] for name, row in stored()["cases"].items()}
        left = [name for name in CASES if done[name] < SAMPLES]
        if not left:
            return
        count_piece(min(left, key=lambda name: min(done[name], SAMPLES // 10)))


if __name__ == "__main__":
    count(float(sys.argv[1]))
