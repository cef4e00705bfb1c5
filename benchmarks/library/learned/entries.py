"""Entries of players on a track: their scores, and the history of better ones.

player, by      name on the track, and its author
scores          per split, interquartile mean of the normalised scores, with limits
costs           per split, mean cost in each game for each training
runs, episodes  trainings, and episodes of each in each game
digest          SHA-256 of the file of the player, empty without one
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.library.learned.costs import mean_costs
from benchmarks.library.learned.score import aggregate, scores
from benchmarks.library.learned.track import SPLITS, Track
from benchmarks.library.provenance import provenance
from ppg_env.support.atomic_write import write_atomically

Entry = dict[str, Any]


def evaluated(
    track: Track,
    name: str,
    *,
    label: str,
    by: str,
    episodes: int,
    limit: float | None = None,
) -> Entry:
    """Play a player in all test games, and return its entry."""
    started = process_time()
    costs = {
        split: [mean_costs(track, test, name, episodes, limit=limit) for test in track.games(split)]
        for split in SPLITS
    }
    path = Path(name)
    digest = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    command = f"ppg library track {track.name} --player {path.name} --episodes {episodes}"
    return {
        "player": label,
        "by": by,
        "scores": {split: _score(track, split, costs[split]) for split in SPLITS},
        "costs": {
            split: [[round(cost, 9) for cost in runs] for runs in rows]
            for split, rows in costs.items()
        },
        "runs": len(costs[SPLITS[0]][0]),
        "episodes": episodes,
        "digest": digest,
        "provenance": provenance(by, command, process_time() - started),
    }


def _score(track: Track, split: str, costs: list[list[float]]) -> list[float | None]:
    """Return the aggregate of a split and its limits, which are None for one training."""
    games = track.games(split)
    ends = [np.array([getattr(game, end) for game in games]) for end in ("straight", "reference")]
    result = aggregate(scores(np.array(costs).T, *ends))
    limits = (result.value, result.low, result.high)
    return [None if x != x else round(x, 4) for x in limits]


def read_entries(track: Track) -> dict[str, list[Entry]]:
    """Return ``entries``, the best test score first, and ``history``."""
    path = track.folder / "entries.json"
    if not path.exists():
        return {"entries": [], "history": []}
    content: dict[str, list[Entry]] = json.loads(path.read_text(encoding="utf-8"))
    return content


def ranked(entries: list[Entry]) -> list[Entry]:
    """Return the entries, the best test score first."""
    return sorted(entries, key=lambda entry: -float(entry["scores"]["test"][0]))


def offer(track: Track, entry: Entry) -> bool:
    """Keep an entry unless the track has a better one of the same name; return whether it does."""
    content = read_entries(track)
    others = [known for known in content["entries"] if known["player"] != entry["player"]]
    last = [known for known in content["entries"] if known["player"] == entry["player"]]
    score = entry["scores"]["test"][0]
    if any(known["scores"]["test"][0] >= score for known in last):
        return False
    shown = {key: entry[key] for key in ("player", "by", "scores")}
    history = [*content["history"], shown | {"date": entry["provenance"]["date"]}]
    kept = {"entries": ranked([*others, entry]), "history": history}
    text = json.dumps(kept, allow_nan=False, separators=(",", ":"))
    write_atomically(track.folder / "entries.json", text + "\n")
    return True
