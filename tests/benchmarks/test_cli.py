"""The command as a whole: exit codes, help, and where things are printed."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from benchmarks.commands import VERBS
from tests.marks import first


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself_and_takes_json(ppg, verb):
    done = ppg(verb, "--help")
    assert "--json" in done.out
    assert "Traceback" not in done.out + done.err


@pytest.mark.parametrize(
    "words",
    [
        ["solve", "heads_on"],
        ["solve", "head_on", "--lam", "1.5"],
        ["solve", "head_on", "--lam", "0.1,0.2,0.3"],
        ["solve", "head_on", "--lam", "half"],
        ["solve", "head_on", "--solution", "perfect"],
        ["solve", "head_on", "--solution", "best-response", "--agent", "7"],
        ["solve", "head_on", "--solver", "ABACUS"],
        ["solve", "head_on", "--speed", "warp"],
        ["solve", "circle(0)"],
        ["show", "nowhere.toml"],
        ["show", "head_on", "--objective", "glory"],
        ["show", "head_on", "--out", "no/such/folder/game.toml"],
        ["certify", "nowhere.json"],
        ["risk", "nowhere.json"],
        ["render", "nowhere.json"],
        ["compare", "head_on", "--players", "nash,chance"],
        ["compare", "head_on", "--players", ","],
    ],
    ids=" ".join,
)
def test_a_users_mistake_is_one_sentence_and_exit_code_2(ppg, words):
    done = ppg(*words, code=2)
    assert done.out == ""
    lines = done.err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("ppg: ")
    assert "Traceback" not in done.err


@pytest.mark.parametrize("words", [["fly"], ["solve"], ["solve", "head_on", "--wings"]])
def test_words_that_are_no_command_are_exit_code_2(ppg, words):
    done = ppg(*words, code=2)
    assert done.out == ""
    assert "Traceback" not in done.err


def test_the_module_is_the_command():
    command = [sys.executable, "-m", "benchmarks", "scenarios", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["scenarios"]


@pytest.mark.parametrize("solver", first(1, ["HIGHS", "SCIP", "GUROBI"]))
def test_whatever_the_back_end_says_stdout_holds_the_json_alone(solver):
    pytest.importorskip({"HIGHS": "highspy", "SCIP": "pyscipopt", "GUROBI": "gurobipy"}[solver])
    words = ["solve", "parallel", "--solver", solver, "--json"]
    command = [sys.executable, "-m", "benchmarks", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["status"] == "equilibrium"
