"""Files that users hand in: valid examples of each kind, and what reads them."""

from __future__ import annotations

import io
import json
import sqlite3
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import tomli_w

from baselines import Learned, read_learned, write_learned
from benchmarks.library import checker
from benchmarks.library.instance import Instance, chosen
from benchmarks.library.judge import read_plan_text, verdict
from benchmarks.library.record import read_record
from benchmarks.library.runs import RUNS, read_lines
from benchmarks.sweeps import Cell, Store, sweep
from benchmarks.sweeps.grid import read_grid
from ppg_env import evaluate, make_game
from ppg_env.env import read_randomize
from ppg_env.formats.game_file import game_from_tables, game_to_tables, read_game
from ppg_env.formats.plan_file import read_plan, write_plan
from solvers import feedback_optimum, read_feedback, social_optimum, write_feedback
from tests.baselines.small import small_policy
from tests.drills.guided import mutated
from tests.oracles.faults import VALID
from tests.solvers.feedback.line_games import line_agent, line_game


@dataclass(frozen=True)
class Target:
    """A kind of file: the ending of its name, valid contents, a mutator and a reader."""

    suffix: str
    seeds: list[bytes]
    read: Callable[[Path], Any]
    mutate: Callable[[bytes, bytes, Random], bytes] = mutated


def mutated_archive(data: bytes, other: bytes, random: Random) -> bytes:
    """Mutate one member of an .npz file, and write a sound archive around it; or mutate bytes."""
    if random.random() < 0.3:
        return mutated(data, other, random)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        name = random.choice(sorted(members))
    except (zipfile.BadZipFile, ValueError, OSError, LookupError, NotImplementedError):
        return mutated(data, other, random)
    header, body = members[name][:128], members[name][128:]
    if name == "about.npy" and random.random() < 0.9:  # a text in UTF-32
        text = mutated(body.decode("utf-32-le", "replace").encode("utf-8", "replace"), b"", random)
        body = text.decode("utf-8", "replace").encode("utf-32-le", "replace")
        shape = b"{'descr': '<U%d', 'fortran_order': False, 'shape': (), }" % (len(body) // 4)
        header = header[:10] + shape.ljust(117) + b"\n"
    elif random.random() < 0.5:
        header = mutated(header, other, random)
    else:
        body = mutated(body, other, random)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for key, content in (members | {name: header + body}).items():
            archive.writestr(key if random.random() < 0.99 else f"../{key}", content)
    return stream.getvalue()


def mutated_rows(data: bytes, other: bytes, random: Random) -> bytes:
    """Overwrite an entry of a store by SQL, digest and all, or mutate bytes of the file."""
    base = sqlite3.connect(":memory:")
    try:
        base.deserialize(data)
        columns = [name for _, name, *_ in base.execute("PRAGMA table_info(rows)")]
        column = random.choice(columns)
        (old,) = base.execute(f'SELECT "{column}" FROM rows').fetchone()
        raw = old if isinstance(old, bytes) else str(old).encode()
        value: Any = mutated(raw, other[-3000:], random)
        value = random.choice([value, value.decode("utf-8", "replace"), 1e308, -1, None, 2**62])
        base.execute(f'UPDATE rows SET "{column}" = ?', (value,))
        changed = base.serialize()
    except (sqlite3.Error, IndexError, TypeError, OverflowError):
        changed = mutated(data, other, random)
    finally:
        base.close()
    return changed if random.random() < 0.5 else mutated(data, other, random)


def _game(path: Path) -> None:
    game = read_game(path)
    assert game_from_tables(game_to_tables(game), "again") == game


def _plan(path: Path) -> None:
    game, profile, _ = read_plan(path)
    evaluate(game, profile).violations()


def _policy(path: Path) -> None:
    learned, game = read_learned(path), make_game("intersection", speed="l1")
    if learned.fits(game):
        learned.players(game)


def _store(path: Path) -> None:
    with Store(path) as store:
        store.rows()


def _checked(path: Path) -> None:
    checker.main([str(path), str(path.with_name("valid.json"))])


def targets(folder: Path) -> dict[str, Target]:
    """Return all kinds of files; ``folder`` is for what valid ones are made in."""
    game = make_game("intersection", speed="l1")
    toml = [tomli_w.dumps(VALID).encode(), tomli_w.dumps(game_to_tables(game)).encode()]
    solution = social_optimum(game)
    assert solution.profile is not None
    plan = write_plan(folder / "plan.json", game, solution.profile, {"cost": [1.5]}).read_bytes()
    about = {"player": "test", "game": game_to_tables(game), "lam": [0.1, 0.9]}
    team = (small_policy(game, 0), small_policy(game, 1, squash=True))
    policy = write_learned(folder / "policy.npz", Learned((team,), about)).read_bytes()
    line = line_game(line_agent(0.0, 30.0), line_agent(25.0, 55.0, -6.0, 6.0), horizon=3)
    feedback = write_feedback(folder / "feedback.npz", feedback_optimum(line)).read_bytes()
    sweep([Cell("parallel", "straight", {"lam": 0.3}, episodes=50)], folder / "rows.db")
    instance = _instance(folder)
    runs = b"\n".join(next(iter(sorted(RUNS.glob("*.jsonl")))).read_bytes().splitlines()[:3])
    grid = (
        b'[sweep]\ngames = ["head_on", "circle(3)"]\nplayers = ["nash"]\nseeds = "0:2"\n'
        b"[set]\nlam = [0.1]\n"
    )
    draws = b"[randomize]\nlam = { uniform = [0.1, 0.9] }\nstart = { near = 1.0 }\n"
    return {
        "game": Target(".toml", toml, _game),
        "plan": Target(".json", [plan], _plan),
        "policy": Target(".npz", [policy], _policy, mutated_archive),
        "feedback policy": Target(".npz", [feedback], read_feedback, mutated_archive),
        "store": Target(".db", [(folder / "rows.db").read_bytes()], _store, mutated_rows),
        "library record": Target(".json", [instance.record_path.read_bytes()], read_record),
        "library run": Target(".jsonl", [runs], read_lines),
        "library submission": Target(
            ".json",
            [json.dumps(instance.record.social and instance.record.social["plan"]).encode(), plan],
            lambda path: verdict(instance, read_plan_text(path)),
        ),
        "library game, by the checker": Target(".toml", [instance.path.read_bytes()], _checked),
        "sweep grid": Target(".toml", [grid], read_grid),
        "random draws": Target(".toml", [draws], read_randomize),
    }


def _instance(folder: Path) -> Instance:
    instance = chosen(["door1.0-walkers2"])[0]
    assert instance.record.social is not None
    content = json.dumps(instance.record.social["plan"])
    (folder / "valid.json").write_text(content, encoding="utf-8")
    return instance
