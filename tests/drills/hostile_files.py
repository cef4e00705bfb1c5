"""Hostile files of text, stores and things that are no files; each is named by what it has."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from pathlib import Path

from benchmarks.sweeps import Cell, Store
from benchmarks.sweeps.run import sweep

Words = tuple[object, ...]
Case = Callable[[Path], Words]
"""Makes the files in a folder, and returns the words of the command."""

AGENT = """[[agent]]
start = [{x}, 0]
goal = [{x}, 50]
shape = {{ {shape} }}
control = {{ {control} }}
"""


def agent(x: object = 0, shape: str = "box = [1, 1]", control: str = "l1 = 9") -> str:
    """Return the table of an agent."""
    return AGENT.format(x=x, shape=shape, control=control)


def game(text: str, verb: str = "solve", name: str = "game.toml") -> Case:
    """Return the case of a game file with this text."""

    def make(folder: Path) -> Words:
        (folder / name).write_text(text, encoding="utf-8")
        return verb, name

    return make


def plan(text: str) -> Case:
    """Return the case of a plan file with this text."""
    return game(text, "render", "plan.json")


def _pipe(folder: Path) -> Words:
    os.mkfifo(folder / "game.toml")
    return "solve", "game.toml"


def _ring(folder: Path) -> Words:
    (folder / "a.toml").symlink_to("b.toml")
    (folder / "b.toml").symlink_to("a.toml")
    return "solve", "a.toml"


def _endless_view(folder: Path) -> Words:
    store = folder / "rows.db"
    Store(store).close()
    with sqlite3.connect(store) as base:
        columns = [name for _, name, *_ in base.execute("PRAGMA table_info(rows)")]
        values = ", ".join(f'n AS "{name}"' for name in columns)
        endless = "WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c)"
        base.executescript(
            f"DROP TABLE rows; CREATE VIEW rows AS {endless} SELECT {values} FROM c;"
        )
    return "sweep", "parallel", "--players", "straight", "--episodes", 50, "--store", store


def _trigger(folder: Path) -> Words:
    store = folder / "rows.db"
    sweep([Cell("parallel", "straight", {"lam": 0.3}, episodes=50)], store)
    with sqlite3.connect(store) as base:
        base.executescript(
            "CREATE TRIGGER t AFTER INSERT ON rows BEGIN UPDATE rows SET status = 'lie'; END;"
        )
    return "sweep", "parallel", "--players", "straight", "--episodes", 50, "--store", store


def _text_store(folder: Path) -> Words:
    (folder / "rows.db").write_text("SQLite format 3\0" + "x" * 5000)
    return "sweep", "parallel", "--players", "straight", "--store", "rows.db"


def _run_pipe(folder: Path) -> Words:
    os.mkfifo(folder / "runs.jsonl")
    return "library", "report", "--runs", "runs.jsonl"


def _record(text: str) -> Case:
    def make(folder: Path) -> Words:
        (folder / "games/one").mkdir(parents=True)
        (folder / "games/one/1.toml").write_text(agent(), encoding="utf-8")
        (folder / "games/one/1.json").write_text(text, encoding="utf-8")
        return "library", "show", "one", "--games", "games"

    return make


BIG = "1" + "0" * 400
CASES: dict[str, Case] = {
    "1,000,000 agents": game(agent() * 1_000_000),
    "2,001 agents": game("".join(agent(3 * k) for k in range(2001))),
    "`circle(1000000000)`": lambda _: ("solve", "circle(1000000000)"),
    "arrays nested 100,000 deep": game("a = " + "[" * 100_000),
    "tables nested 20,000 deep": game("a = " + "{ a = " * 20_000),
    "a key of 40,000 dots": game("a" + ".a" * 40_000 + " = 1"),
    "a table header of 40,000 dots": game("[a" + ".a" * 40_000 + "]"),
    "a horizon of 401 digits": game(f"[game]\nhorizon = {BIG}\n" + agent()),
    "a horizon of 10^9": game("[game]\nhorizon = 1000000000\n" + agent()),
    "a start of 1e308": game(agent(1e308)),
    "a body of 1e308": game(agent(shape="disc = 1e308")),
    "a disc of 10^9 sides": game(agent(control="disc = 9, sides = 1000000000")),
    "a body of 100,000 corners": game(
        agent(shape="vertices = " + str([[k, k * k] for k in range(100_000)]))
    ),
    "matrices of 1e300": game(agent() + "A = 1e300\n"),
    "a name of control characters": game('[game]\nname = "\\u001b]0;x\\u0007"\n' + agent()),
    "a binary game file": game("\0" * 1000),
    "a pipe without a writer": _pipe,
    "an endless device": lambda _: ("solve", "/dev/zero.toml/../zero"),
    "a ring of links": _ring,
    "a plan nested 100,000 deep": plan("[" * 100_000),
    "a plan of 10^7 numbers": plan('{"controls": [' + "0," * 9_999_999 + "0]}"),
    "a plan with a number of 10^6 digits": plan('{"a": ' + "1" * 1_000_000 + "}"),
    "a sweep of 10^12 seeds": game(
        '[sweep]\ngames = ["parallel"]\nseeds = "0:1000000000000"\n', "sweep", "grid.toml"
    ),
    "a store that is an endless view": _endless_view,
    "a store with a trigger": _trigger,
    "a store of text": _text_store,
    "a pipe as a file of runs": _run_pipe,
    "a record nested 100,000 deep": _record("[" * 100_000),
    "a record without numbers": _record('{"social": {"social_cost": "x"}, "bound": {"value": []}}'),
}
