"""The checker agrees with the evaluator, refuses mutated plans, and needs no other file."""

from __future__ import annotations

import json
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.library import checker
from benchmarks.library.families.tables import game, walker, wall
from benchmarks.library.instance import instances
from benchmarks.library.judge import recorded_plans, verdict
from ppg_env import evaluate
from ppg_env.formats.game_file import game_from_tables, game_to_tables
from ppg_env.game.plan import make_profile
from tests.marks import first
from tests.oracles.random_games import drawn_plan, random_game

NUMBERS = ("shifted_cost", "social_cost", "potential", "risk_sum")
RULES = list(product(("instants", "swept"), ("remove", "stay")))


def assert_agrees(tables: dict[str, Any], plan: dict[str, Any]) -> bool:
    """Compare the checker with the evaluator; return whether both accept the plan."""
    played = game_from_tables(tables, "the game")
    evaluation = evaluate(played, make_profile(played, plan["controls"]))
    answer = checker.check(tables, plan)
    assert answer["accepted"] == evaluation.feasible, (answer["defects"], evaluation.violations())
    assert answer["arrival"] == list(evaluation.arrival)
    for key in NUMBERS:
        np.testing.assert_allclose(answer[key], getattr(evaluation, key), 1e-9, 1e-9, err_msg=key)
    return bool(answer["accepted"])


@pytest.mark.parametrize("rule", first(2, RULES), ids="-".join)
def test_the_checker_agrees_with_the_evaluator_on_random_plans(rule):
    accepted = []
    for seed in range(24):
        drawn, random = random_game(seed)
        plans = [drawn_plan(agent, random) for agent in drawn.agents]
        if None in plans:
            continue
        try:
            played = replace(drawn, collisions=rule[0], on_goal=rule[1])
        except ValueError:  # parked bodies that overlap
            continue
        plan = {"controls": [p.controls.tolist() for p in plans]}
        plan["arrival"] = [p.arrival for p in plans]
        accepted.append(assert_agrees(game_to_tables(played), plan))
    assert len(accepted) > 6
    assert 0 < sum(accepted) < len(accepted)


@pytest.mark.slow
@pytest.mark.parametrize("instance", instances(), ids=lambda one: one.name)
def test_the_checker_agrees_with_the_evaluator_on_recorded_plans(instance):
    for entry in recorded_plans(instance.record).values():
        assert assert_agrees(instance.tables, entry["plan"])
        assert entry["social_cost"] == pytest.approx(
            checker.check(instance.tables, entry["plan"])["social_cost"], 1e-9
        )


# --- mutations ------------------------------------------------------------------------------------

LANES = game(
    8,
    [
        walker([0, 0], [5, 0], within={"low": [-1, -0.1], "high": [6, 3]}, effort=0.01),
        walker([0, 1.5], [5, 1.5]),
    ],
    [wall(2, -2, 3, -1)],
)
"""Two agents side by side above a wall."""


def lanes_plan() -> dict[str, Any]:
    straight = [[1.0, 0.0]] * 5 + [[0.0, 0.0]] * 3
    return {"arrival": [5, 5], "controls": [deepcopy(straight), deepcopy(straight)]}


def test_the_plan_that_is_mutated_is_accepted():
    assert assert_agrees(LANES, lanes_plan())
    stated = lanes_plan() | {
        key: checker.check(LANES, lanes_plan())[key] for key in ("means", "social_cost", "risk_sum")
    }
    assert checker.check(LANES, stated)["accepted"]


def late(plan: dict[str, Any]) -> str:
    plan["controls"][0].insert(0, [0.0, 0.0])
    plan["controls"][0].pop()
    return "arrival"


def stated_late(plan: dict[str, Any]) -> str:
    plan["arrival"][1] = 6
    return "arrival"


def never(plan: dict[str, Any]) -> str:
    plan["controls"][1][4] = [0.9, 0.0]
    return "goal at None"


def control_out(plan: dict[str, Any]) -> str:
    plan["controls"][1][0] = [1.0 + 1e-4, 0.0]
    plan["controls"][1][1] = [1.0 - 1e-4, 0.0]
    return "control at 0"


def too_near(plan: dict[str, Any]) -> str:
    """Pass half a body nearer: the clearance of 0.9 becomes an overlap of 0.05 in the middle."""
    for t, step in ((0, -0.5), (1, -0.45), (3, 0.5), (4, 0.45)):
        plan["controls"][1][t] = [1.0, step]
    return "overlap at 2"


def outside(plan: dict[str, Any]) -> str:
    plan["controls"][0][0], plan["controls"][0][1] = [1.0, -0.2], [1.0, 0.2]
    return "within"


def cut_horizon(plan: dict[str, Any]) -> str:
    plan["controls"][0] = plan["controls"][0][:-1]
    return "8 x 2"


def shifted_means(plan: dict[str, Any]) -> str:
    plan["means"] = checker.check(LANES, plan)["means"]
    plan["means"][1] = [[x, y + 0.3] for x, y in plan["means"][1]]
    return "means"


def cheaper(plan: dict[str, Any]) -> str:
    plan["social_cost"] = checker.check(LANES, plan)["social_cost"] - 1e-6
    return "social_cost"


def not_a_number(plan: dict[str, Any]) -> str:
    plan["controls"][0][0][0] = float("nan")
    return "finite"


def one_agent(plan: dict[str, Any]) -> str:
    plan["controls"].pop()
    return "strict" if sys.version_info < (3, 10) else "shorter"


def no_arrival(plan: dict[str, Any]) -> str:
    del plan["arrival"]
    return "arrival"


@pytest.mark.parametrize(
    "mutate",
    [
        late, stated_late, never, control_out, too_near, outside, cut_horizon, shifted_means,
        cheaper, not_a_number, one_agent, no_arrival,
    ],
)  # fmt: skip
def test_a_mutated_plan_is_refused_with_its_defect(mutate, tmp_path):
    plan = lanes_plan()
    words = mutate(plan)
    path = tmp_path / "1.toml"
    path.parent.mkdir(exist_ok=True)

    class Lanes:
        tables = LANES

    answer = verdict(Lanes(), plan)
    assert not answer["accepted"]
    assert words in " ".join(answer["defects"])


@pytest.mark.parametrize("plan", [[], "plan", 3, None, {"arrival": 5, "controls": {}}])
def test_what_is_no_plan_is_refused(plan):
    class Lanes:
        tables = LANES

    assert not verdict(Lanes(), plan)["accepted"]


# --- recorded plans -------------------------------------------------------------------------------


def recorded(count: int) -> list[tuple[Any, dict[str, Any]]]:
    """Return games of every kind that have a plan, evenly over the names."""
    games = [one for one in instances() if one.record.social is not None]
    return [(one, one.record.social["plan"]) for one in games[:: max(len(games) // count, 1)]]


@pytest.mark.parametrize(
    ("instance", "plan"), recorded(10), ids=lambda value: getattr(value, "name", "")
)
def test_mutations_of_recorded_plans_are_refused(instance, plan):
    assert verdict(instance, plan)["accepted"]
    for i, arrival in enumerate(plan["arrival"]):
        stated = deepcopy(plan)
        stated["arrival"][i] = arrival + 1
        assert not verdict(instance, stated)["accepted"]
        missed = deepcopy(plan)
        missed["controls"][i][arrival - 1][0] += 1e-4  # out of its set, or past the goal
        assert not verdict(instance, missed)["accepted"]


# --- the file alone -------------------------------------------------------------------------------


def test_the_checker_is_one_short_file_of_numpy_and_the_standard_library(tmp_path):
    source = Path(checker.__file__).read_text()
    assert len(source.splitlines()) <= 200
    alone = tmp_path / "checker.py"
    alone.write_text(source)
    (instance, plan) = recorded(1)[0]
    (tmp_path / "plan.json").write_text(json.dumps(plan))

    def run(*words: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-I", str(alone), *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    done = run(instance.path, "plan.json", "--json")
    assert (done.returncode, json.loads(done.stdout)["accepted"]) == (0, True)
    plan = deepcopy(plan)
    plan["arrival"][0] += 1
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    done = run(instance.path, "plan.json")
    assert done.returncode == 1
    assert "arrival" in done.stdout
    missing = run("nowhere.toml", "plan.json")
    assert missing.returncode == 1
    assert "Traceback" not in missing.stderr


def test_the_checker_imports_nothing_of_the_project():
    source = Path(checker.__file__).read_text()
    lines = [line for line in source.splitlines() if line.startswith(("import ", "from "))]
    roots = {line.split()[1].split(".")[0] for line in lines}
    assert roots <= set(sys.stdlib_module_names) | {"numpy"}
