"""What all tests share: hypothesis profiles, and every scenario at every speed as a fixture."""

from __future__ import annotations

import pytest

from ppg_env import Game, make_game
from ppg_env.scenarios.make import SPEEDS
from ppg_env.scenarios.registry import registry
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


@pytest.fixture(params=scenario_calls())
def scenario(request: pytest.FixtureRequest) -> str:
    """The call of every scenario, such as ``head_on`` or ``circle(4)``."""
    return request.param


@pytest.fixture(params=scenario_speeds(), ids=" ".join)
def game(request: pytest.FixtureRequest) -> Game:
    """Every scenario at every speed."""
    call, speed = request.param
    return make_game(call, speed=speed)
