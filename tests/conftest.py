"""What all tests share: scenarios, the command ``ppg``, players, and short trainings."""

from __future__ import annotations

import gc
from functools import partial
from pathlib import Path
from random import Random

import pytest

from baselines import Learned, write_learned
from ppg_env import Game, make_game
from ppg_env.formats.game_file import game_to_tables
from ppg_env.scenarios.make import SPEEDS
from ppg_env.scenarios.registry import registry
from tests.baselines.small import shorten_trainings, small_policy
from tests.command import Ppg, run_ppg
from tests.profiles import register_profiles

register_profiles()

SMALL = {"circle": "circle(4)", "random": "random(4)", "streams": "streams(4)"}
"""Representatives of the families whose default size is more than a test needs."""


def scenario_calls() -> list[str]:
    """One call for each scenario and family; a new one is picked up here."""
    return [SMALL.get(name, name) for name in registry()]


def scenario_speeds() -> list[tuple[str, str]]:
    """Every scenario with every speed set; discs are for the plane only."""
    return [
        (call, speed)
        for call in scenario_calls()
        for speed in SPEEDS
        if speed != "disc" or make_game(call).agents[0].control_dim == 2
    ]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--shuffle", type=int, help="run the tests in the random order of this seed")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """No test may depend on the order of tests; the seed gives all workers the same one."""
    if (seed := config.getoption("--shuffle")) is not None:
        Random(seed).shuffle(items)


def pytest_collection_finish() -> None:
    """Keep the garbage collector away from what lives as long as the tests, a tenth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


@pytest.fixture(params=scenario_calls())
def scenario(request: pytest.FixtureRequest) -> str:
    """The call of every scenario, such as ``head_on`` or ``circle(4)``."""
    return request.param


@pytest.fixture(params=scenario_speeds(), ids=" ".join)
def game(request: pytest.FixtureRequest) -> Game:
    """Every scenario at every speed."""
    call, speed = request.param
    return make_game(call, speed=speed)


@pytest.fixture
def ppg(capsys: pytest.CaptureFixture[str]) -> Ppg:
    """Run ``ppg`` with these words, and expect this exit code."""
    return partial(run_ppg, capsys)


@pytest.fixture
def short_trainings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trainings of this process take a second."""
    shorten_trainings(monkeypatch)


@pytest.fixture(scope="session")
def learned_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Players of two agents with random weights, as a training would leave them."""
    game = make_game("intersection", speed="l1")
    about = {"player": "random", "game": game_to_tables(game), "lam": None}
    learned = Learned(((small_policy(game, 0),), (small_policy(game, 1),)), about)
    return write_learned(tmp_path_factory.mktemp("learned") / "random.npz", learned)
