"""Conformance of every scenario: what holds for one holds for the next that is added."""

from __future__ import annotations

import ast
import importlib
import inspect
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.cli import main
from ppg_env import Game, InputError, evaluate, make_game, scenarios, straight_plan
from ppg_env.game.polytope import collision_set
from ppg_env.game.reachability import earliest_arrival
from ppg_env.scenarios.course import Course
from ppg_env.scenarios.make import BrokenScenarioWarning
from ppg_env.scenarios.registry import OTHERS, load_registry, registry
from tests.marks import first

PACKAGE = importlib.import_module("ppg_env.scenarios")  # the name ppg_env.scenarios is the function


def test_no_agents_overlap_at_the_start(game: Game) -> None:
    for encounter in game.encounters:
        places = [game.agents[i].start[: game.dim] for i in encounter.agents]
        assert encounter.collision.clearance(encounter.displacement(*places)) > 0


def test_no_agent_has_to_stop_inside_an_obstacle(game: Game) -> None:
    for agent in game.agents:
        for obstacle in game.obstacles:
            assert collision_set(agent.shape, obstacle.shape).clearance(agent.goal) > 0


def test_every_goal_can_be_reached_with_time_to_give_way(game: Game) -> None:
    for agent in game.agents:
        first = earliest_arrival(agent, game.horizon)
        assert first is not None
        assert first < game.horizon


def test_every_agent_has_a_straight_plan_that_arrives(game: Game) -> None:
    profile = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    assert None not in profile
    found = evaluate(game, profile)  # type: ignore[arg-type]
    assert None not in found.arrival
    assert found.residuals.control.max() <= 1e-7
    assert np.isfinite(found.cost).all()


def test_agents_are_alike_except_for_start_and_goal(game: Game) -> None:
    first = game.agents[0]
    for agent in game.agents:
        assert replace(agent, start=first.start, goal=first.goal) == first


def test_a_game_bears_the_name_it_was_called_by(scenario: str) -> None:
    assert make_game(scenario).name == scenario


def test_the_registry_is_exactly_the_public_functions_of_the_modules() -> None:
    folder = Path(str(PACKAGE.__file__)).parent
    defined = {
        node.name
        for path in folder.glob("*.py")
        if path.stem not in ("__init__", *OTHERS)
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    }
    assert set(registry()) == defined
    assert {"opposing", "head_on", "parallel", "intersection", "intersection3", "circle"} <= defined


@pytest.fixture
def extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A further folder of the package; its modules are forgotten afterwards."""
    monkeypatch.setattr(PACKAGE, "__path__", [*PACKAGE.__path__, str(tmp_path)])
    importlib.invalidate_caches()
    load_registry.cache_clear()
    yield tmp_path
    for path in tmp_path.glob("*.py"):
        sys.modules.pop(f"{PACKAGE.__name__}.{path.stem}", None)
    load_registry.cache_clear()


IMPORT = "from ppg_env.scenarios.course import Course\n"


def test_a_new_module_is_picked_up(extra: Path) -> None:
    (extra / "brand_new.py").write_text(
        f"{IMPORT}from math import sin\n"
        "def lonely(x: float = 5.0) -> Course:\n"
        "    '''One agent.'''\n"
        "    return Course([(0, 0)], [(x, 0)])\n"
        "def _private() -> Course: ...\n",
        encoding="utf-8",
    )
    assert "lonely" in registry()
    assert "_private" not in registry()
    assert "sin" not in registry()
    assert make_game("lonely(8.0)").agents[0].goal.tolist() == [8.0, 0.0]


BROKEN = {
    "syntax": ("def f(:", "SyntaxError"),
    "import": ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
    "name": ("def f() -> Course: ...", "NameError: name 'Course' is not defined"),
    "unknown annotation": (
        f"from __future__ import annotations\n{IMPORT}def f(n: nit = 3) -> Course: ...",
        "annotations of f cannot be evaluated, name 'nit' is not defined",
    ),
    "no annotation": (f"{IMPORT}def f(n=3) -> Course: ...", "argument n of f has no annotation"),
    "no return": (f"{IMPORT}def f(n: int = 3): ...", "f is not annotated to return a Course"),
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "several lines": ("raise OSError('one\\ntwo')", "OSError: one two"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_module_is_one_sentence_and_the_others_work(name: str, extra: Path) -> None:
    text, problem = BROKEN[name]
    path = extra / "broken_one.py"
    path.write_text(text + "\n", encoding="utf-8")
    assert make_game("head_on").name == "head_on"
    with pytest.warns(BrokenScenarioWarning) as caught:
        listing = scenarios()
    assert "head_on" in listing
    (warning,) = caught
    sentence = str(warning.message)
    assert sentence.startswith(f"the scenario file {path} is broken (")
    assert problem in sentence
    assert "\n" not in sentence
    with pytest.raises(InputError, match="is not a scenario and the scenario file") as refused:
        make_game("f")
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("hed_on", "perhaps you mean 'head_on',"), ("qqq", "use one of opposing, head_on, .*,")],
)
def test_a_name_that_is_no_scenario_is_answered_in_one_sentence(name: str, remedy: str) -> None:
    sentence = rf"^'{name}': is not a scenario; {remedy} or a file ending in \.toml\.$"
    with pytest.raises(InputError, match=sentence):
        make_game(name)


def test_a_broken_module_leaves_the_commands_working(
    extra: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (extra / "broken_one.py").write_text("import no_such_module\n", encoding="utf-8")
    with pytest.raises(SystemExit) as stopped:
        main(["show", "head_on"])
    assert not stopped.value.code
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("name", registry())
def test_a_scenario_is_a_documented_function_of_typed_arguments_with_defaults(name: str) -> None:
    function = registry()[name]
    assert inspect.getdoc(function)
    for parameter in inspect.signature(function).parameters.values():
        assert parameter.default is not parameter.empty
        assert parameter.annotation is not parameter.empty
    assert isinstance(function(), Course)


@pytest.mark.parametrize("n", first(6, range(1, 21)))
def test_a_circle_leaves_room_for_all_agents_and_time_to_cross_it(n: int) -> None:
    game = make_game(f"circle({n})", speed="l1")
    assert len(game.agents) == n
    for encounter in game.encounters:
        places = [game.agents[i].start for i in encounter.agents]
        assert encounter.collision.clearance(encounter.displacement(*places)) > 5
    for agent in game.agents:
        np.testing.assert_allclose(agent.goal, -agent.start)
        assert straight_plan(agent, game.horizon) is not None


def test_the_printed_coordinates_of_the_paper() -> None:
    opposing, head_on = make_game("opposing"), make_game("head_on")
    assert [a.start.tolist() for a in opposing.agents] == [[10, 50], [90, 50]]
    assert [a.goal.tolist() for a in opposing.agents] == [[95, 50], [5, 10]]
    assert [a.goal.tolist() for a in head_on.agents] == [[95, 50], [5, 50]]
    assert len(make_game("intersection").agents) == 2
    assert len(make_game("intersection3").agents) == 3
    assert make_game("course").obstacles


@pytest.mark.parametrize(
    ("body", "problem"), [("1 / 0", "ZeroDivisionError"), ("5", "returns no Course")]
)
def test_a_scenario_that_fails_is_one_sentence(body: str, problem: str, extra: Path) -> None:
    path = extra / "failing_one.py"
    path.write_text(f"{IMPORT}def fails() -> Course:\n    return {body}\n", encoding="utf-8")
    with pytest.raises(InputError, match=problem) as refused:
        make_game("fails")
    assert str(path) in str(refused.value)
