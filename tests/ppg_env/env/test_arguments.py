"""What simulators and views are made of: anything else is refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ppg_env import GameVectorEnv, InputError, Simulator, SingleAgentEnv, make_game
from ppg_env.env import GoToGoal

GAME = make_game("head_on")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"game": "head_on"}, r"^game: is 'head_on'; give a Game, as make_game makes"),
        ({"rules": {"reward": "margin"}}, r"^rules: are \{'reward': 'margin'\}; give Rules"),
        *(({"copies": c}, r"^copies: is .*; ask for a whole number") for c in (0, 2.5, "x", True)),
    ],
)
def test_a_simulator_needs_a_game_rules_and_copies(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Simulator(**{"game": GAME} | arguments)


@pytest.mark.parametrize("view", [SingleAgentEnv, GameVectorEnv])
def test_a_learner_is_a_number_and_others_play(view: Any) -> None:
    for learner in ("agent_1", 1.0, 2, -1, True, None):
        with pytest.raises(InputError, match=r"^learner: is .* of 2; count from 0"):
            view("head_on", learner=learner)
    for agent in (0, 2, "agent_1"):
        with pytest.raises(InputError, match=r"^players: names agent .*; name the other agents"):
            view("head_on", players={agent: GoToGoal(GAME, 1)})
    with pytest.raises(InputError, match=r"^players\[1\]: is 'stay'; give an object with a method"):
        view("head_on", players={1: "stay"})
    for players in (5, [GoToGoal(GAME, 1)]):
        with pytest.raises(InputError, match=r"^players: are .*; write a dictionary from agents"):
            view("head_on", players=players)
    view("head_on", learner=np.int64(1), players={0: GoToGoal(GAME, 0)}).reset(seed=0)


NUMBERLESS = ["up", None, np.ones((2, 2), complex), [["1", "2"], ["3", "4"]]]


@pytest.mark.parametrize("bad", [*NUMBERLESS, [[1], [1, 2]], [[10**400, 0], [0, 0]]])
def test_the_vector_view_refuses_actions_that_are_no_numbers(bad: Any) -> None:
    envs = GameVectorEnv("head_on", 2)
    envs.reset(seed=0)
    with pytest.raises(InputError, match=r"^actions: are .* of shape .*; give one of 2 numbers"):
        envs.step(bad)
    envs.step([[1, 2], [3, 4]])


@pytest.mark.parametrize("options", ["x", 5, [1], True])
def test_reset_options_of_all_views_are_dictionaries(options: Any) -> None:
    for env in (SingleAgentEnv("head_on"), GameVectorEnv("head_on", 2)):
        with pytest.raises(InputError, match=r"^options: are .*; write a dictionary, as in"):
            env.reset(seed=0, options=options)
    with pytest.raises(InputError, match=r"^options: are"):
        Simulator(GAME).reset(options=options)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"max_cycles": 2**31 - 1}, "^max_cycles: is .*; write a whole number of steps from 1 to"),
        ({"max_cycles": 10**400}, "^max_cycles: is"),
        ({"tolerance": 10**400}, "^tolerance: is .*; write a length, zero or more"),
        ({"tolerance": 1e18}, "^tolerance: is"),
        ({"arrival": "schedule", "schedule": (1, 10**30)}, "^schedule: is"),
    ],
)
def test_rules_hold_numbers_that_the_kernel_can_hold(rule: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        SingleAgentEnv("head_on", **rule)
    SingleAgentEnv("head_on", max_cycles=2**31 - 2).reset(seed=0)


def test_options_of_single_environments_are_refused_by_batches() -> None:
    options: list[dict[str, Any]] = [{"infos": "names"}, {"render_mode": "rgb_array"}]
    for option in options:
        with pytest.raises(InputError, match=rf"^{next(iter(option))}: is '.*'; leave it out"):
            GameVectorEnv("head_on", 2, **option)
    GameVectorEnv("head_on", 2, infos="numbers").reset(seed=0)
