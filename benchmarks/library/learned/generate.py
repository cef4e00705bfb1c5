"""Draw the test games of a track, and compute both ends of their scale.

    python -m benchmarks.library.learned.generate NAME REFERENCE GAMES_PER_SPLIT

REFERENCE is the player whose score is 100.  Draws in which it costs more than nine tenths of
straight flight have little to learn, and are left out.  Games that ``games.json`` has stay as they
are, so that a run that was stopped continues.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace

import numpy as np

from benchmarks.library.learned.costs import mean_costs
from benchmarks.library.learned.drawn_game import DrawnGame
from benchmarks.library.learned.track import FOLDER, SPLITS, Track
from benchmarks.library.provenance import provenance
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.support.atomic_write import write_atomically

EPISODES = 20_000
LIMITS = {"feedback-social": 600.0}
"""Seconds for the reference player of each game, where it is not 60."""

LITTLE = 0.9
TRIES = 50
DRAW_SEED = 7


def draws(track: Track, split: str) -> list[DrawnGame]:
    """Return :data:`TRIES` games of a split, without costs."""
    seed = np.random.SeedSequence(DRAW_SEED, spawn_key=(SPLITS.index(split),))
    simulator = Simulator(track.game, Rules(), TRIES, seed, track.rule(split))
    simulator.reset()
    result = []
    for copy in range(TRIES):
        agents = simulator.game_of(copy).agents
        start = [[round(float(x), 3) for x in agent.start] for agent in agents]
        first = agents[0]
        lam, noise = round(float(first.lam), 3), round(float(first.noise[0, 0]), 3)
        result.append(DrawnGame(split, start, lam, noise))
    return result


def write_test_games(track: Track, reference: str, count: int) -> None:
    """Write ``count`` games of each split to ``games.json``, each as soon as it is known."""
    path = track.folder / "games.json"
    origin = provenance("ppg", f"python -m {__spec__.name} {track.name} {reference} {count}")
    limit = LIMITS.get(reference, 60.0)
    kept = json.loads(path.read_text())["games"] if path.exists() else []
    done = {split: sum(row["split"] == split for row in kept) for split in SPLITS}
    for split in SPLITS:
        known = [row["start"] for row in kept if row["split"] == split]
        for test in draws(track, split):
            if done[split] == count:
                break
            if test.start in known:
                continue
            ends = [mean_costs(track, test, name, EPISODES, limit=limit)[0]
                    for name in ("straight", reference)]  # fmt: skip
            if ends[1] > LITTLE * ends[0]:
                continue
            kept.append(asdict(replace(test, straight=ends[0], reference=ends[1])))
            done[split] += 1
            about = {"reference": reference, "episodes": EPISODES, "games": kept}
            write_atomically(path, json.dumps(about | {"provenance": origin}, indent=1) + "\n")


if __name__ == "__main__":
    name, reference, count = sys.argv[1:]
    write_test_games(Track(FOLDER / name), reference, int(count))
