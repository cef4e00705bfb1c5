"""A mistake on the command line: exit code 2, one line on stderr, nothing on stdout or on disk.

And games that have no solution: exit code 3, and advice instead of a plan.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w

from ppg_env import make_game, straight_plan
from ppg_env.formats.plan_file import write_plan
from tests.command import Ppg, Run
from tests.marks import first
from tests.oracles.faults import VALID, changed

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to run in, but for good.json, a plan."""
    monkeypatch.chdir(tmp_path)
    game = make_game("parallel")
    plans = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    write_plan("good.json", game, plans, {})  # type: ignore[arg-type]
    return tmp_path


def assert_is_reported_in_one_line(outcome: Run, *words: str) -> None:
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.endswith(".\n")
    assert outcome.err.count("\n") == 1, outcome.err
    assert outcome.err.startswith("ppg: ")
    assert ";" in outcome.err, "a remedy follows the problem"
    for word in words:
        assert word in outcome.err


def test_a_good_command_succeeds(ppg: Ppg) -> None:
    for command in (["show", "head_on"], ["risk", "good.json", "--method", "bound"]):
        assert ppg(*command).out
        done = ppg(*command, "--json")
        assert done.err == ""
        assert done.json


MISTAKES: dict[str, tuple[str, ...]] = {
    "show haed_on": ("haed_on", "head_on"),
    "solve nowhere.toml": ("nowhere.toml",),
    "solve circle(": ("circle(n, radius)",),
    "show circle(0)": ("n: is 0",),
    'show circle("a")': ("'a'", "whole number"),
    "show circle(2.5)": ("2.5", "whole number"),
    "show circle(99999999)": ("99999999", "1000"),
    "sweep head_on --players straight --starts sequential": ("--start", "no effect", "nash"),
    "sweep head_on --players straight --charges pigou": ("--charge", "no effect", "nash"),
    "risk head_on --player straight --episodes 99999999999999999999": ("samples", "ask for 1"),
    "show circle(n=3,bogus=1)": ("circle(n, radius)",),
    'show circle(__import__("os"))': ("circle(n, radius)",),
    "show circle(3,radius=1)": ("overlaps",),
    "show head_on --lam 1": ("lam", "0 <= lam < 1"),
    "show head_on --lam -0.1": ("lam", "0 <= lam < 1"),
    "show head_on --lam x": ("--lam", "'x'"),
    "show head_on --lam nan": ("lam", "nan"),
    "show head_on --lam 0.1,0.2,0.3": ("lam", "3 numbers for 2 agents"),
    "show head_on --lam 0.1,": ("--lam",),
    "show head_on --gain x": ("--gain", "'x'"),
    "show head_on --gain inf": ("gain",),
    "show head_on --horizon 0": ("horizon", "is 0"),
    "show head_on --horizon 99999999999999999999": ("horizon",),
    "show head_on --margin-cap 0": ("margin_cap", "is 0"),
    "show head_on --margin-cap nan": ("margin_cap", "nan"),
    "show head_on --objective safety": ("objective", "'safety'"),
    "show head_on --collisions sweep": ("collisions", "sweep"),
    "show head_on --on-goal park": ("on_goal", "park"),
    "show head_on --reserve x": ("--reserve", "x"),
    "show head_on --reserve=-1": ("agent[0].reserve", "-1"),
    "show head_on --effort 1,2,3": ("effort", "3 numbers"),
    "show head_on --crash-cost -5": ("crash_cost", "-5"),
    "show head_on --speed fast": ("speed", "'fast'"),
    "show head_on --noise -1": ("noise", "eigenvalue"),
    "solve head_on --solution best": ("--solution", "'best'", "nash"),
    "solve head_on --solver GHOST": ("solver", "'GHOST'", "HIGHS"),
    "solve head_on --solution best-response --agent 7": ("agent", "7"),
    "solve head_on --solution best-response --agent -1": ("agent", "-1"),
    "solve head_on --solution best-response --against none.json": ("none.json",),
    "solve head_on --solution best-response --against three.json": ("--against",),
    "solve head_on --start late": ("start", "'late'"),
    "solve head_on --order never": ("order", "'never'"),
    "compare head_on --players ghost": ("--players", "'ghost'", "straight"),
    "compare head_on --players ,": ("--players",),
    "compare head_on --players straight --solver GHOST": ("'GHOST'",),
    "risk good.json --method magic": ("--method", "'magic'", "bound"),
    "risk none.json": ("none.json", "does not exist"),
    "certify none.json": ("none.json", "does not exist"),
    "certify good.json --charge ghost": ("charge", "'ghost'"),
    "certify good.json --solver GHOST": ("'GHOST'",),
    "render none.json": ("none.json", "does not exist"),
    "render good.json --lam 0.5": ("--lam",),
}


@pytest.mark.parametrize("as_json", first(1, [False, True]), ids=["", "--json"])
@pytest.mark.parametrize("command", MISTAKES)
def test_a_mistake_is_reported_in_one_line(
    command: str, as_json: bool, ppg: Ppg, folder: Path
) -> None:
    three = make_game("intersection3")
    plans = tuple(straight_plan(agent, three.horizon) for agent in three.agents)
    write_plan("three.json", three, plans, {})  # type: ignore[arg-type]
    before = sorted(folder.iterdir())
    outcome = ppg(*command.split(), *["--json"] * as_json, code=2)
    assert_is_reported_in_one_line(outcome, *MISTAKES[command])
    assert sorted(folder.iterdir()) == before


BROKEN_PLANS = {
    "not JSON": lambda plan: "no plan",
    "empty": lambda plan: "",
    "not a plan": lambda plan: '{"cost": [1, 2]}',
    "a list": lambda plan: "[1, 2]",
    "truncated": lambda plan: json.dumps(plan)[:-40],
    "truncated controls": lambda plan: json.dumps(
        plan | {"controls": [rows[:9] for rows in plan["controls"]]}
    ),
    "NaN controls": lambda plan: json.dumps(
        plan | {"controls": [[[float("nan")] * 2] * 15, plan["controls"][1]]}
    ),
    "tampered game": lambda plan: json.dumps(
        plan | {"game": changed(plan["game"], "agent.0.lam", 2)}
    ),
    "game with an unknown key": lambda plan: json.dumps(
        plan | {"game": changed(plan["game"], "agent.0.lambda", 0.5)}
    ),
    "game without agents": lambda plan: json.dumps(plan | {"game": {"agent": []}}),
}


@pytest.mark.parametrize(
    "command", first(2, ["risk", "certify --json", "certify", "render", "risk --json"])
)
@pytest.mark.parametrize("name", BROKEN_PLANS)
def test_a_broken_plan_file_is_reported_in_one_line(
    name: str, command: str, ppg: Ppg, folder: Path
) -> None:
    plan = json.loads(Path("good.json").read_text(encoding="utf-8"))
    Path("bad.json").write_text(BROKEN_PLANS[name](plan), encoding="utf-8")
    before = sorted(folder.iterdir())
    verb, *options = command.split()
    assert_is_reported_in_one_line(ppg(verb, "bad.json", *options, code=2), "bad.json: ")
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("place", "value", "shown"),
    [
        ("agent.1.noise", [[1.0, 2.0], [2.0, 1.0]], "agent[1].noise"),
        ("agent.0.lambda", 0.5, "agent[0].lambda"),
        ("game.horizon", 2.5, "game.horizon"),
        ("obstacle.0.vertices", [[0, 0], [1, 1], [2, 2]], "obstacle[0]"),
        ("agent.1.start", [1.0, 1.0], "agent[0].start"),
    ],
)
@pytest.mark.parametrize("verb", first(2, ["show", "solve", "compare", "render"]))
def test_a_faulty_game_file_is_reported_with_file_and_place(
    verb: str, place: str, value: object, shown: str, ppg: Ppg
) -> None:
    Path("bad.toml").write_text(tomli_w.dumps(changed(VALID, place, value)), encoding="utf-8")
    assert_is_reported_in_one_line(ppg(verb, "bad.toml", code=2), f"bad.toml: {shown}: ")
    assert_is_reported_in_one_line(ppg(verb, "bad.toml", "--json", code=2), f"bad.toml: {shown}: ")


@pytest.mark.parametrize(
    "command",
    [
        "show head_on --out missing/game.toml",
        "render head_on --out missing/picture.png",
        "solve parallel --solution best-response --out missing/plan.json",
        "compare parallel --players straight --episodes 10 --out missing/picture.png",
    ],
)
@pytest.mark.parametrize("as_json", [False, True], ids=["", "--json"])
def test_a_folder_that_cannot_be_written_to_leaves_nothing_behind(
    command: str, as_json: bool, ppg: Ppg, folder: Path
) -> None:
    before = sorted(folder.rglob("*"))
    outcome = ppg(*command.split(), *["--json"] * as_json, code=2)
    assert_is_reported_in_one_line(outcome, command.split()[-1] + ": ", "cannot be written")
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    "command",
    [
        "dance",
        "solve",
        "solve head_on --bogus",
        "solve head_on --horizon x",
        "solve head_on --horizon 2.5",
        "solve head_on --seed -1",
        "solve head_on --time-limit -1",
        "solve head_on --time-limit nan",
        "risk good.json --episodes 0",
        "risk good.json --workers 0",
        "show head_on extra",
    ],
)
def test_a_command_that_does_not_parse_is_refused_without_a_traceback(
    command: str, ppg: Ppg
) -> None:
    outcome = ppg(*command.split(), code=2)
    assert outcome.out == ""
    assert outcome.err
    assert "Traceback" not in outcome.err


ADVICE = re.compile(r"agent_0 cannot reach its goal.* horizon to 9 or more")
UNREACHABLE = [
    *(f"solve head_on --horizon 3 --solution {s}" for s in ("nash", "potential", "social")),
    "solve head_on --horizon 3 --solution best-response",
    "solve head_on --horizon 8 --out plan.json",
    "compare head_on --horizon 3",
]


@pytest.mark.parametrize("command", UNREACHABLE)
def test_a_goal_out_of_reach_exits_with_3_and_names_agent_and_horizon(
    command: str, ppg: Ppg, folder: Path
) -> None:
    before = sorted(folder.rglob("*"))
    outcome = ppg(*command.split(), code=3)
    assert outcome.out == ""
    assert ADVICE.search(outcome.err)
    assert outcome.err.count("\n") == 1
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("command", UNREACHABLE)
def test_a_goal_out_of_reach_is_one_json_object_too(command: str, ppg: Ppg) -> None:
    outcome = ppg(*command.split(), "--json", code=3)
    report = outcome.json
    for entry in report.get("rows", [report]):
        assert entry["status"] == "unreachable"
        assert ADVICE.search(entry["advice"])
        assert "controls" not in entry
    assert outcome.err == ""


def in_its_own_process(*arguments: str) -> Run:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *arguments],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
    )
    return Run(done.returncode, done.stdout, done.stderr)


def test_a_process_of_its_own_tells_a_mistake_in_one_line() -> None:
    outcome = in_its_own_process("show", 'circle(__import__("os"))', "--json")
    assert_is_reported_in_one_line(outcome, "circle(n, radius)")


def test_a_process_of_its_own_exits_with_3_without_a_plan() -> None:
    outcome = in_its_own_process("solve", "head_on", "--horizon", "3", "--json")
    assert outcome.code == 3
    assert outcome.json["status"] == "unreachable"
    assert outcome.err == ""
