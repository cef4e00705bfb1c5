"""Numbers of any magnitude, 1e-308 to 1e308: a usable game, or one sentence with its place.

In files, in Python and on the command line.
"""

from __future__ import annotations

import contextlib
import copy
import io
import re
import tomllib
import warnings
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.cli import main
from ppg_env import Game, InputError, Polytope, evaluate, make_game, straight_plan
from ppg_env import tolerances as tol
from ppg_env.env.arrival_regions import arrival_tolerances
from ppg_env.env.rules import Rules
from ppg_env.env.simulator import Simulator
from ppg_env.formats.game_file import game_from_tables
from ppg_env.game.dynamics import covariances
from ppg_env.game.plan import make_profile
from tests.marks import first
from tests.oracles.faults import VALID, at, changed
from tests.profiles import examples

SIGNS, EXPONENTS = st.sampled_from([1, 1, 1, -1]), st.integers(-308, 308)
MAGNITUDES = st.builds(lambda sign, power: sign * 10.0**power, SIGNS, EXPONENTS)
MODERATE = st.integers(-12, 12).map(lambda power: 10.0**power)
FACTORS = MODERATE | MAGNITUDES

FIELDS = [
    *(f"game.{key}" for key in ("margin_cap", "crash_cost")),
    *(f"agent.0.{key}" for key in ("start", "goal", "lam", "gain", "shape.vertices", "noise")),
    *(f"agent.0.{key}" for key in ("control.disc", "A", "B", "sigma0")),
    *(f"agent.1.{key}" for key in ("shape.normals", "shape.offsets", "control.0.l1")),
    *(f"agent.1.{key}" for key in ("control.1.box", "noise", "gain")),
    *(f"agent.2.{key}" for key in ("start", "shape.box", "control.box")),
    *("obstacle.0.vertices", "obstacle.1.normals", "obstacle.1.offsets"),
]


def assert_is_usable(game: Game) -> None:
    """Every part of the game is finite, and nothing warns."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plans = [straight_plan(agent, game.horizon) for agent in game.agents]
        still = [np.zeros((game.horizon, agent.control_dim)) for agent in game.agents]
        controls = [
            zero if plan is None else plan.controls for plan, zero in zip(plans, still, strict=True)
        ]
        evaluation = evaluate(game, make_profile(game, controls))
        assert np.isfinite(evaluation.margins).all()
        assert np.isfinite(evaluation.deficit).all()
        for encounter in game.encounters:
            assert np.isfinite(encounter.collision.normals).all()
            assert np.isfinite(encounter.collision.offsets).all()
        for agent in game.agents:
            assert np.isfinite(covariances(agent, game.horizon)).all()
        assert all(np.isfinite(half).all() for half in arrival_tolerances(game))
        simulator = Simulator(game, Rules(tolerance=0.0), copies=2)  # some reach the goal at once
        simulator.reset()
        step = simulator.step(np.zeros((2, len(game.agents), simulator.action_size)))
        assert np.isfinite(step.observation).all()
        assert np.isfinite(step.reward).all()


def scaled(value: Any, factor: float) -> Any:
    """Every number of nested lists times ``factor``."""
    return [scaled(item, factor) for item in value] if isinstance(value, list) else value * factor


@st.composite
def extreme_tables(draw: st.DrawFn) -> dict[str, Any]:
    """The valid file after one or two fields are scaled, or one of their numbers is replaced."""
    tables = copy.deepcopy(VALID)
    for place in draw(st.lists(st.sampled_from(FIELDS), min_size=1, max_size=2, unique=True)):
        value = at(tables, place)
        if isinstance(value, list) and draw(st.booleans()):
            place += f".{draw(st.integers(0, len(value) - 1))}"
            if isinstance(at(tables, place), list):
                place += f".{draw(st.integers(0, 1))}"
            tables = changed(tables, place, draw(FACTORS))
        else:
            tables = changed(tables, place, scaled(value, draw(FACTORS)))
    return tables


def assert_is_usable_or_refused(tables: dict[str, Any]) -> None:
    try:
        game = game_from_tables(tomllib.loads(tomli_w.dumps(tables)), "game.toml")
    except InputError as error:
        refusal = str(error)
    else:
        assert_is_usable(game)
        return
    assert re.match(r"game\.toml: (game|agent|obstacle)\b.*[^;]; \w.*\.$", refusal)


@pytest.mark.filterwarnings("error", "ignore:the spectral radius")
@given(extreme_tables())
def test_a_file_of_any_magnitude_is_a_usable_game_or_refused(tables: dict[str, Any]) -> None:
    assert_is_usable_or_refused(tables)


@pytest.mark.slow
@pytest.mark.filterwarnings("error", "ignore:the spectral radius")
@examples(5)
@given(extreme_tables())
def test_more_files_of_any_magnitude_are_usable_games_or_refused(tables: dict[str, Any]) -> None:
    assert_is_usable_or_refused(tables)


OVERRIDES: dict[str, Any] = {
    "lam": lambda x: x,
    "gain": lambda x: x,
    "noise": lambda x: x,
    "sigma0": lambda x: [[x, 0.0], [0.0, 1.0]],
    "margin_cap": lambda x: x,
    "crash_cost": lambda x: x,
    "A": lambda x: [[1.0, x], [0.0, 1.0]],
    "B": lambda x: [[x, 0.0], [0.0, 1.0]],
    "start": lambda x: {0: [x, 50.0]},
    "goal": lambda x: {1: [x, -x]},
    "shape": lambda x: Polytope.from_vertices([[0, 0], [x, 0], [0, 1], [x, 1 + x]]),
    "control": lambda x: {"disc": x},
    "obstacles": lambda x: [
        Polytope.from_halfspaces([[1, 0], [-1, x], [0, 1], [0, -1]], [200, -150, 200, x])
    ],
}


@pytest.mark.filterwarnings("error", "ignore:the spectral radius")
@given(st.sampled_from(sorted(OVERRIDES)), FACTORS, st.sampled_from(["margin", "risk"]))
def test_python_values_of_any_magnitude_make_a_usable_game_or_are_refused(
    field: str, size: float, objective: str
) -> None:
    try:
        game = make_game("head_on", objective=objective, **{field: OVERRIDES[field](size)})
    except InputError as error:
        refusal = str(error)
    else:
        assert_is_usable(game)
        return
    assert re.match(r"[^;]+; \w.*\.$", refusal)


OPTIONS = ["--lam", "--gain", "--noise", "--margin-cap", "--crash-cost"]
CALLS = ["circle(3, radius={})", "streams(4, spacing={})", "corridor(width={})"]


def run(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    return int(stopped.value.code or 0)


@given(st.sampled_from(OPTIONS + CALLS), MAGNITUDES)
def test_options_of_any_magnitude_are_used_or_refused_in_one_line(option: str, size: float) -> None:
    call = option.format(size) if option in CALLS else "head_on"
    words = [] if option in CALLS else [f"{option}={size}"]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(["show", call, *words, "--json"])
    assert code in (0, 2)
    lines = [line for line in err.getvalue().splitlines() if "SpectralRadius" not in line]
    assert len(lines) == (1 if code else 0), err.getvalue()
    assert "Traceback" not in err.getvalue()


LENGTHS = [
    "agent.1.within.0.low",
    "agent.1.within.0.high",
    "agent.1.within.1.offsets",
    "agent.1.effort",
    "agent.2.within.box",
    "obstacle.2.box",
    "obstacle.2.path",
    "obstacle.2.noise",
    "obstacle.3.polygon",
]
"""More places of the valid file with a unit of length."""


def in_units(unit: float) -> dict[str, Any]:
    """The valid file with every length multiplied by ``unit``."""
    tables = copy.deepcopy(VALID)
    for place in FIELDS:
        key = place.rsplit(".", 1)[-1]
        power = 2 if key in ("noise", "sigma0") else 1
        if not place.startswith("game") and key not in ("lam", "gain", "A", "B", "normals"):
            tables = changed(tables, place, scaled(at(tables, place), unit**power))
    for place in LENGTHS:
        power = {"noise": 2, "effort": -1}.get(place.rsplit(".", 1)[-1], 1)
        tables = changed(tables, place, scaled(at(tables, place), unit**power))
    for place in ("agent.1.start", "agent.1.goal", "agent.2.goal"):
        tables = changed(tables, place, scaled(at(tables, place), unit))
    tables["agent"][2]["noise"] = 1.9 * unit**2
    return tables


@pytest.mark.parametrize("unit", first(2, [1e-9, 1e9, 1e-5, 1e-3, 1e3, 1e6]))
def test_a_game_in_another_unit_of_length_is_the_same_game(unit: float) -> None:
    game, plain = (game_from_tables(in_units(u), "game.toml") for u in (unit, 1.0))
    assert_is_usable(game)
    profiles = [
        make_profile(g, [straight_plan(a, g.horizon).controls for a in g.agents])  # type: ignore[union-attr]
        for g in (game, plain)
    ]
    one, other = (evaluate(g, p) for g, p in zip((game, plain), profiles, strict=True))
    assert one.arrival == other.arrival
    np.testing.assert_allclose(one.margins, other.margins, rtol=1e-5)


def test_a_control_disc_of_no_size_is_refused_with_its_place() -> None:
    tables = changed(VALID, "agent.0.control", {"disc": 1e-308})
    with pytest.raises(InputError, match=r"^x: agent\[0\]\.control: has the radius 1e-308"):
        game_from_tables(tables, "x")


def test_limits_are_those_of_the_tolerances() -> None:
    for width in (tol.SMALLEST, tol.LARGEST / 2):
        assert Polytope.box([width, width]).dim == 2
    for width in (tol.SMALLEST / 2, 2 * tol.LARGEST):
        with pytest.raises(InputError, match="double arithmetic"):
            Polytope.box([width, width])
