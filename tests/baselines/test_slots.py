"""What stable-baselines3 asks of slots: arguments, options, methods and pictures of a video."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baselines import GameVecEnv
from ppg_env import InputError, make_game

GAME = make_game("head_on")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"reward_scale": 0}, "^reward_scale: is 0; give a positive number"),
        ({"reward_scale": "a"}, "^reward_scale: is 'a', not a finite number; give a positive"),
        ({"reward_scale": np.inf}, "^reward_scale: is inf, not a finite number"),
        ({"weights": 0.5}, "^weights: are 0.5; give a range of lam"),
        ({"weights": (0.6, 0.5)}, "^weights: are .*; give a range of lam"),
        ({"weights": ("a", "b")}, "^weights: is not made of numbers; give a range of lam"),
        ({"shaping": "x"}, "^shaping: is 'x'; write True or False"),
        ({"bootstrap": 3}, "^bootstrap: is 3; write True or False"),
        ({"render_mode": "human"}, "^render_mode: is 'human'; write rgb_array"),
        ({"players": 5}, "^players: are 5; write a dictionary"),
    ],
)
def test_arguments_are_refused_by_name(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        GameVecEnv(GAME, copies=1, **arguments)


@pytest.mark.parametrize("bad", ["x", 5, [1, 2], [{}, 3], []])
def test_options_are_dictionaries(bad: Any) -> None:
    env = GameVecEnv(GAME, copies=1)
    env.set_options(bad)
    with pytest.raises(InputError, match=r"^options: are .*; set one dictionary for all slots"):
        env.reset()


@pytest.mark.parametrize("bad", [[[1], [1, 2]], "up", None, [[10**400, 0], [0, 0]], 0.5])
def test_actions_that_are_no_array_are_refused(bad: Any) -> None:
    env = GameVecEnv(GAME, copies=1)
    env.reset()
    with pytest.raises(InputError, match=r"^actions: are an array of shape .*, a row per slot"):
        env.step(bad)
    env.step([[1, 0], [0, 1]])


def test_a_method_answers_once_per_slot_and_is_called_once() -> None:
    env = GameVecEnv(GAME, copies=2)
    assert len(env.env_method("seed", 3)) == env.num_envs == 4
    assert env.env_method("normalised", 0, np.zeros((2, 2)), indices=[1, 3])[1].shape == (2, 2)
    first = env.reset()
    env.env_method("seed", 3, indices=0)
    np.testing.assert_array_equal(env.reset(), first)


def test_pictures_show_the_first_copy() -> None:
    pytest.importorskip("PIL")
    env = GameVecEnv(GAME, copies=3, render_mode="rgb_array")
    with pytest.raises(InputError, match=r"^render: comes before the first reset"):
        env.render()
    env.reset()
    first = env.render()
    env.step(np.tile([[1.0, 0.0], [-1.0, 0.0]], (3, 1)))
    second = env.render()
    assert first is not None
    assert second is not None
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert first.shape[2] == 3
    assert not np.array_equal(first, second)
