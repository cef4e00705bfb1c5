"""The examples with other libraries: what they import is pinned, and what they share is right.

Their trainings need the libraries, and run every night (``make neighbours``).
"""

from __future__ import annotations

import ast
import importlib
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ppg_env import Simulator, SingleAgentEnv, make_game
from ppg_env.env import Rules

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.txt"))
SHARED = {"figures", "run_neighbours", "shaped_learner", "task"}
PACKAGES = {"ppg_env", "solvers", "baselines", "benchmarks"}
LINES = 140

PIN = re.compile(r"([A-Za-z0-9._-]+)(\[[a-z,]+\])?==[A-Za-z0-9.]+")
DISTRIBUTIONS = {"pufferlib": "pufferlib-core"}
"""Distributions of modules, where they have another name."""


def normal(name: str) -> str:
    """Return a distribution's name as pip compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def pins(text: str) -> dict[str, str]:
    """Return the pinned requirements of a file by name; fail if a line is none."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    matches = {line: PIN.fullmatch(line) for line in lines}
    assert [line for line, match in matches.items() if match is None] == []
    return {normal(match[1]): line for line, match in matches.items() if match}


def imported(tree: ast.Module) -> set[str]:
    """Return the packages that a file imports when it is loaded."""
    names: set[str] = set()
    for node in tree.body:
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.split(".")[0])
    return names


def foreign(name: str) -> set[str]:
    """Return the packages that an example imports and neither Python nor this project has."""
    tree = ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8"))
    return imported(tree) - set(sys.stdlib_module_names) - SHARED - PACKAGES


def shared(name: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Load a file that examples share, as they do."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module(name)


def test_every_file_is_an_example_or_shared_by_them() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {*NAMES, *SHARED}
    assert len(NAMES) >= 6


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_says_how_to_run_it(name: str) -> None:
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LINES
    assert f"python examples/{name}.py" in (ast.get_docstring(ast.parse(text)) or "")
    assert name not in foreign(name), "a file would hide the library of its name"
    compile(text, name, "exec")


@pytest.mark.parametrize("name", NAMES)
def test_what_an_example_needs_beyond_this_project_is_pinned(name: str) -> None:
    pinned = pins((EXAMPLES / f"{name}.txt").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    own = {normal(re.split(r"[<>=\[]", need)[0]) for need in project["dependencies"]}
    needed = {normal(DISTRIBUTIONS.get(module, module)) for module in foreign(name)}
    assert needed - own <= set(pinned)
    ours = (ROOT / "constraints.txt").read_text().splitlines()
    assert pinned["torch"] in ours  # another would be a build of several GB


def test_the_check_of_pins_bites() -> None:
    assert pins("# why\n\nray[rllib]==2.60.0\n") == {"ray": "ray[rllib]==2.60.0"}
    for line in ("ray", "ray>=2", "ray==2.60.0 --no-deps", "-r other.txt"):
        with pytest.raises(AssertionError):
            pins(line)
    assert imported(ast.parse("import a.b\nfrom c.d import e\ndef f():\n    import g")) == {
        "a",
        "c",
    }


def test_each_example_runs_every_night_and_has_its_place_in_the_docs() -> None:
    workflow = (ROOT / ".github/workflows/ci.yml").read_text()
    (matrix,) = re.findall(r"example: \[(.*)\]", workflow)
    assert [word.strip() for word in matrix.split(",")] == [name.split("_")[0] for name in NAMES]
    page = (ROOT / "docs/neighbours.md").read_text(encoding="utf-8")
    assert [name for name in NAMES if f"examples/{name}.py" not in page] == []


def settings(text: str) -> dict[str, str]:
    """Return the numbers and switches that a program of RLlib sets, and its wrapper's method."""
    tree = ast.parse(text)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    found = {
        keyword.arg: ast.unparse(keyword.value)
        for call in calls
        if ast.unparse(call.func).endswith((".training", "DefaultModelConfig", ".multi_agent"))
        for keyword in call.keywords
        if keyword.arg
    }
    (wrapper,) = (node for node in tree.body if isinstance(node, ast.ClassDef))
    (step,) = (node for node in wrapper.body if isinstance(node, ast.FunctionDef))
    lines = [line for line in step.body if not ast.unparse(line).startswith(("'", '"'))]
    return found | {"step": "\n".join(ast.unparse(line) for line in lines)}


def test_the_docs_train_with_rllib_as_the_example_does() -> None:
    page = (ROOT / "docs/neighbours.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```text\n(import ray\n.*?)^```", page, re.S | re.M)
    example = (EXAMPLES / "rllib_ppo.py").read_text(encoding="utf-8")
    assert settings(shown) == settings(example)
    assert len(settings(shown)) == 14
    assert "from baselines import ShapedEnv" in shown
    assert "PathPlanning(ShapedEnv(**config))" in shown


# --- what the examples share ----------------------------------------------------------------------


def towards_goal(observation: np.ndarray, dim: int) -> np.ndarray:
    """Return actions in [-1, 1] of full speed towards the goal, along the first axis."""
    action = np.zeros((*observation.shape[:-1], dim), dtype=np.float32)
    action[..., 0] = -np.sign(observation[..., 0])
    return action


def test_a_single_learner_is_shaped_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    module = shared("shaped_learner", monkeypatch)
    env, plain = module.ShapedLearner(SingleAgentEnv("head_on", 1)), SingleAgentEnv("head_on", 1)
    first, _ = env.reset(seed=3)
    plain.reset(seed=3)
    action = np.array([-4.0, 1.0], dtype=np.float32)
    seen, reward, *_ = env.step(action)
    change = env._potential(1, seen) - env._potential(1, first)
    assert reward * module.SCALE == pytest.approx(plain.step(action)[1] + change)


def test_a_policy_is_reported_with_the_figures_of_compare(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    figures, task = (shared(name, monkeypatch) for name in ("figures", "task"))
    monkeypatch.setattr(figures, "EPISODES", 50)
    game = make_game("parallel", speed="l1", lam=0.8)

    def act(_: int, seen: np.ndarray) -> np.ndarray:
        return towards_goal(seen, game.dim)

    figures.report("straight", task.Task(game, 1000), act, steps=1000, seconds=2.0)
    table = shared("run_neighbours", monkeypatch).table("log\n" + capsys.readouterr().out)
    title, own, learned = (re.split(r"\s{2,}", line) for line in table)
    assert title == list(figures.COLUMNS)
    assert own[:3] == ["straight", "1,000", "2"]
    assert learned[:2] == ["ppo-selfish", "2,000,000"]
    assert 6 < float(own[3].split()[0]) < 10
    assert float(own[-1]) > 50


def test_a_short_run_is_reported_under_its_own_rules(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    figures, task = (shared(name, monkeypatch) for name in ("figures", "task"))
    monkeypatch.setattr(figures, "ROUGH_EPISODES", 50)
    rough = task.rough_task("head_on", 100)
    rough.rules["max_cycles"] = 1  # too few to arrive
    figures.report("still", rough, lambda i, seen: np.zeros((len(seen), 2)), steps=4, seconds=0.0)
    _, row = capsys.readouterr().out.splitlines()
    cells = re.split(r"\s{2,}", row)
    assert cells[0] == "still head_on"
    assert cells[-1] == "0.0"


def test_the_short_runs_hold_crashes_early_arrivals_and_time_limits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    task = shared("task", monkeypatch)
    assert tuple(task.ROUGH) == shared("run_neighbours", monkeypatch).GAMES
    for scenario in task.ROUGH:
        rough, rng = task.rough_task(scenario, 100), np.random.default_rng(0)
        env, early = Simulator(rough.game, Rules(**rough.rules), copies=64, seed=0), 0
        env.reset()
        counts = np.zeros(3, dtype=int)
        for _ in range(4 * task.MAX_CYCLES):
            out = env.step(rng.uniform(env.low, env.high, (64, *env.low.shape)))
            counts += [out.arrived.sum(), out.crashed.sum(), out.truncated.sum()]
            early += (out.arrived.any(axis=1) & ~out.over).sum()
        assert early > 0, scenario
        assert counts.min() > 0, f"{scenario}: arrived, crashed, late {counts}"


# --- make neighbours ------------------------------------------------------------------------------


def test_a_failing_command_is_reported_by_its_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, log = shared("run_neighbours", monkeypatch), tmp_path / "log"
    monkeypatch.setattr(module, "HOME", tmp_path)
    assert module.call("failed", [sys.executable, "-c", "print('fine')"], log) == "fine\n"
    code = "import sys; print('first', file=sys.stderr); sys.exit('no wheel for 3.11')"
    with pytest.raises(module.StoppedError, match=r"^not installed: no wheel for 3\.11$"):
        module.call("not installed", [sys.executable, "-c", code], log)
    assert log.read_text() == "fine\nfirst\nno wheel for 3.11\n"


def test_each_part_has_its_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    module = shared("run_neighbours", monkeypatch)
    short = [[module.SHORT, "--game", name] for name in module.GAMES]
    assert module.runs("train", "5000") == [["5000"]]
    assert module.runs("games", "5000") == short
    assert module.runs("", "") == [[], *short]


def test_examples_are_chosen_by_the_start_of_their_names(monkeypatch: pytest.MonkeyPatch) -> None:
    module = shared("run_neighbours", monkeypatch)
    assert module.examples() == NAMES
    assert module.examples("rllib") == ["rllib_ppo"]
    monkeypatch.setattr(sys, "argv", ["run_neighbours.py", "--only", "nonsense"])
    with pytest.raises(SystemExit) as stop:
        module.main()
    assert stop.value.code == 2
