"""``ppg library``: every command, solvers of others, records, and the page."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from benchmarks.library.instance import chosen
from benchmarks.library.record import Record, read_record
from benchmarks.library.summary import class_rows, open_rows, sentences

SOLVER = """
import json, sys, tomllib
game = tomllib.load(open(sys.argv[1], "rb"))
horizon = game["game"]["horizon"]
plan = {"arrival": [], "controls": []}
for i, agent in enumerate(game["agent"]):
    way = [b - a for a, b in zip(agent["start"], agent["goal"])]
    steps, wait = round(max(map(abs, way))), 2 * i
    rows = [[0, 0]] * wait + [[x / steps for x in way]] * steps
    plan["controls"].append(rows + [[0, 0]] * (horizon - len(rows)))
    plan["arrival"].append(steps + wait)
"""
WRITE = "json.dump(plan, open(sys.argv[2], 'w'))\n"
CHEAT = "plan['arrival'] = [1 for _ in plan['arrival']]\n"


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(here: Path, text: str) -> str:
    (here / "theirs.py").write_text(text)
    return f"{sys.executable} theirs.py {{game}} {{plan}}"


def library(ppg, folder, *words, code=0):
    return ppg("library", *words, "--games", folder, code=code)


def test_a_command_of_theirs_is_run_checked_and_ranked(ppg, here, folder):
    words = ("run", command(here, SOLVER + WRITE), "--label", "<b>waiting</b>")
    answer = library(ppg, folder, *words, "--json").json
    assert [line["status"] for line in answer["lines"]] == ["accepted", "accepted"]
    assert answer["ranking"] == [{"solver": "<b>waiting</b>", "score": 100.0, "accepted": 2}]
    plan = json.loads((here / "out/library/b-waiting-b/crossing.json").read_text())
    assert plan["arrival"] == [4, 6]
    (here / "theirs.py").unlink()  # lines that exist are not run again
    assert library(ppg, folder, *words, "--json").json["lines"] == answer["lines"]
    library(ppg, folder, "report", "--runs", "out/library/b-waiting-b.jsonl")
    page = (here / "out/library.html").read_text()
    assert "&lt;b&gt;waiting&lt;/b&gt;" in page
    assert "<b>" not in page
    assert "http" not in page


def test_shards_cover_the_games_and_are_ranked_together(ppg, here, folder):
    files = []
    for k in (1, 2):
        files += ["--runs", f"{k}.jsonl"]
        run = ("run", command(here, SOLVER + WRITE), "--label", "parts", "--shard", f"{k}/2")
        (line,) = library(ppg, folder, *run, "--json", *files[-2:]).json["lines"]
        assert line["status"] == "accepted"
    ranking = library(ppg, folder, "report", "--json", *files).json["ranking"]
    assert ranking == [{"solver": "parts", "score": 100.0, "accepted": 2}]


def test_a_cheating_plan_is_refused(ppg, here, folder):
    run = ("run", command(here, SOLVER + CHEAT + WRITE), "lanes", "--label", "cheat", "--submit")
    line = library(ppg, folder, *run, "--json", code=3).json["lines"][0]
    assert line["status"] == "refused"
    assert "arrival" in line["said"]
    assert chosen(["lanes"], folder=folder)[0].record == Record()


@pytest.mark.parametrize(
    ("text", "status", "said"),
    [
        ("import time\ntime.sleep(60)", "failed", "time limit"),
        ("raise SystemExit('too hard')", "failed", "too hard"),
        ("pass", "no plan", "no plan"),
        ("import sys\nopen(sys.argv[2], 'w').write('{')", "refused", "JSON"),
        ("import sys\nopen(sys.argv[2], 'w').write('[1]')", "refused", "cannot be read"),
    ],
)
def test_a_failing_command_is_a_line(ppg, here, folder, text, status, said):
    run = ("run", command(here, text), "lanes", "--time-limit", "0", "--json")
    (line,) = library(ppg, folder, *run, code=3).json["lines"]
    assert line["status"] == status
    assert said in line["said"]


def test_our_solvers_close_and_certify_a_game(ppg, here, folder):
    for solver in ("social", "nash", "straight"):
        library(ppg, folder, "run", solver, "--submit", "--json")
    rows = library(ppg, folder, "list", "--sort", "gap", "--json").json["games"]
    assert [row["class"] for row in rows] == ["easy", "easy"]
    assert all(row["gap"] <= 1e-4 and row["equilibria"] for row in rows)
    assert library(ppg, folder, "check", "--json").json["refused"] == []
    shown = library(ppg, folder, "show", "lanes", "--json").json["record"]
    low, high = shown["risk"]["social"]
    assert 0 <= low <= high < 1
    games = chosen(folder=folder)
    assert class_rows(games)[0][:4] == ("easy", "2", "2", "2")
    assert open_rows(games) == []
    assert next(sentences(games)).startswith("Of 2 games 2 are closed")
    assert "ppg social" in library(ppg, folder, "show", "lanes").out
    assert "lanes/1" in library(ppg, folder, "list", "l*", "--class", "easy").out


def test_a_better_plan_replaces_the_record_and_the_history_is_kept(ppg, here, folder):
    slow = {"arrival": [6, 6], "controls": [[[5 / 6, 0]] * 6 + [[0, 0]] * 2] * 2}
    fast = {"arrival": [5, 5], "controls": [[[1, 0]] * 5 + [[0, 0]] * 3] * 2}
    for name, plan in (("slow", slow), ("fast", fast)):
        (here / f"{name}.json").write_text(json.dumps(plan))

    def submit(name, code=0):
        words = ("submit", "lanes", f"{name}.json", "--by", name, "--certify", "--json")
        return library(ppg, folder, *words, code=code).json

    assert submit("slow")["improves"] == ["social"]
    assert submit("fast")["improves"] == ["social", "equilibrium"]
    assert submit("slow")["improves"] == []
    record = read_record(folder / "lanes" / "1.json")
    assert [entry["by"] for entry in record.history] == ["slow", "fast", "fast"]
    assert record.social["provenance"]["by"] == "fast"
    assert record.value < record.history[0]["value"]
    (here / "fast.json").write_text(json.dumps(fast | {"arrival": [4, 5]}))
    assert submit("fast", code=3)["defects"]
    assert read_record(folder / "lanes" / "1.json") == record
    # A record that someone changed by hand is noticed.
    path = folder / "lanes" / "1.json"
    path.write_text(path.read_text().replace('"arrival":[5,5]', '"arrival":[5,4]', 1))
    assert library(ppg, folder, "check", code=3).out.count("arrival") >= 1


def test_a_plan_below_a_bound_refutes_it():
    record = Record()
    assert record.offer_bound(10.0, {"by": "a solver"})
    assert record.offer_plan(9.0, {}, {"by": "a plan"})
    assert record.bound is None
    assert [entry["what"] for entry in record.history] == ["bound", "bound refuted", "social"]


@pytest.mark.parametrize(
    "words",
    [
        ("list", "nothing_like_this"),
        ("list", "--class", "trivial"),
        ("list", "--sort", "taste"),
        ("show", "lanes/7"),
        ("run", "gurobi"),
        ("run", "solver {game}"),
        ("run", "'solver {game} {plan}"),
        ("run", "no-such-program {game} {plan}"),
        ("check", "lanes", "--plan", "nowhere.json"),
        ("check", "--plan", "nowhere.json"),
        ("show", "*"),
        ("submit", "*", "nowhere.json", "--by", "me"),
        ("submit", "lanes", "nowhere.json", "--by", "me"),
        ("submit", "lanes", "games/lanes/1.toml"),
        ("run", "straight", "--shard", "3/2"),
        ("run", "straight", "--shard", "first"),
        ("report", "--runs", "nowhere.jsonl"),
        ("run", "social", "--runs", "nowhere/runs.jsonl"),
    ],
    ids=" ".join,
)
def test_a_mistake_is_one_sentence(ppg, here, folder, words):
    done = library(ppg, folder, *words, code=2)
    lines = done.err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("ppg: ")


def test_without_a_checkout_the_message_says_what_to_do(ppg, tmp_path):
    done = library(ppg, tmp_path, "list", code=2)
    assert "clone the repository" in done.err


def test_the_wheel_leaves_the_games_out():
    import tomllib

    root = Path(__file__).parents[3]
    settings = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]
    for data in ("games", "runs", "tracks"):
        assert f"benchmarks.library.{data}*" in settings["packages"]["find"]["exclude"]
    assert not any("library" in text for text in settings["package-data"]["benchmarks"])
