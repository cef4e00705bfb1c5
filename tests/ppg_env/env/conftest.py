"""Rules in all combinations, and the games they are tried on."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pettingzoo
import pytest

from ppg_env import make_game
from ppg_env.env.registration import pettingzoo_id
from ppg_env.env.rules import CHOICES
from tests.conftest import scenario_calls
from tests.marks import slow_if

LIFE_CYCLES: list[dict[str, Any]] = [
    {"arrival": arrival, "on_goal": goal, "on_crash": crash, "sharing": sharing}
    for arrival, goal, crash, sharing in product(
        CHOICES["arrival"], CHOICES["on_goal"], CHOICES["on_crash"], CHOICES["sharing"]
    )
]


def compiles_again(scenario: str) -> bool:
    """Whether the kernel is compiled for this scenario alone, for its dimensions."""
    return make_game(scenario).dim != 2


@pytest.fixture(params=slow_if(compiles_again, scenario_calls()))
def scenario(request: pytest.FixtureRequest) -> str:
    """The call of every scenario; ``test_rules`` has those in space for every change."""
    return request.param


needs_registry = pytest.mark.skipif(
    not hasattr(pettingzoo, "make"), reason="PettingZoo before 1.27 has no ids"
)


def with_schedule(options: dict[str, Any], agents: int, times: int = 6) -> dict[str, Any]:
    """Add the arrival times that ``arrival='schedule'`` needs."""
    if options.get("arrival") != "schedule":
        return options
    return options | {"schedule": tuple(times + i for i in range(agents))}


def name(options: dict[str, Any]) -> str:
    return "-".join(str(value) for value in options.values())


def record(name: str, steps: int = 4) -> dict[str, Any]:
    """Play a few steps from a fixed seed: positions, rewards and what the first agent observes."""
    env = pettingzoo.make("parallel", pettingzoo_id(name))
    observations, _ = env.reset(seed=1)
    record: dict[str, Any] = {"agents": env.agents, "positions": [], "rewards": []}
    record["observed"] = observations["agent_0"].tolist()
    for t in range(steps):
        actions = {
            agent: env.action_space(agent).high * np.cos(i + t).astype(np.float32)
            for i, agent in enumerate(env.agents)
        }
        rewards = env.step(actions)[1]
        record["positions"].append(env.simulator.state[0].round(9).tolist())
        record["rewards"].append(sum(rewards.values()))
    return record
