"""Ids of both registries, and a stored trajectory for each of them.

If a trajectory here changes, results of users change: raise ``VERSION`` in
``ppg_env/env/registration.py``, then store the new trajectories with
``python -m tests.ppg_env.env.test_ids``.
"""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test

from ppg_env import GameVectorEnv, InputError, SingleAgentEnv, make_game, parallel_env
from ppg_env.env.registration import (
    VERSION,
    gymnasium_id,
    pettingzoo_id,
    register_environments,
)
from ppg_env.formats.game_file import game_to_toml
from ppg_env.scenarios.registry import registry
from tests.marks import slow_if
from tests.ppg_env.env.conftest import compiles_again, needs_registry, record

STORED = Path(__file__).with_name("trajectories.json")
NAMES = list(registry())

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


def stored() -> dict[str, Any]:
    return json.loads(STORED.read_text())


def test_every_id_has_a_stored_trajectory() -> None:
    assert set(stored()) == {pettingzoo_id(name) for name in NAMES}


@needs_registry
@pytest.mark.parametrize("name", slow_if(compiles_again, NAMES))
def test_an_id_plays_its_stored_trajectory(name: str) -> None:
    before, now = stored()[pettingzoo_id(name)], record(name)
    assert now["agents"] == before["agents"]
    for key in ("positions", "rewards", "observed"):
        np.testing.assert_allclose(now[key], before[key], rtol=1e-6, atol=1e-6, err_msg=__doc__)


@needs_registry
@pytest.mark.parametrize("name", slow_if(compiles_again, NAMES))
def test_the_learner_of_a_gymnasium_id_plays_the_same_game(name: str) -> None:
    env = gymnasium.make(gymnasium_id(name))
    parallel = pettingzoo.make("parallel", pettingzoo_id(name))
    assert env.unwrapped.game == parallel.game == make_game(name)
    observation, _ = env.reset(seed=4)
    assert np.array_equal(observation, parallel.reset(seed=4)[0]["agent_0"])
    check_env(env.unwrapped, skip_render_check=True)


@needs_registry
@pytest.mark.parametrize("name", slow_if(compiles_again, NAMES))
def test_turn_based_ids_pass_the_api_test(name: str) -> None:
    api_test(pettingzoo.make("aec", pettingzoo_id(name)), num_cycles=20)


@needs_registry
def test_families_take_their_arguments_and_options() -> None:
    options: dict[str, Any] = {"n": np.int64(3), "lam": 0.2, "max_cycles": 9, "reward": "margin"}
    env = pettingzoo.make("parallel", pettingzoo_id("circle"), **options)
    assert env.game == make_game("circle(n=3)", lam=0.2)
    assert (env.max_cycles, env.rules.reward) == (9, "margin")
    parallel_api_test(env, num_cycles=20)
    turns = pettingzoo.make("aec", pettingzoo_id("circle"), n=3)
    assert turns.possible_agents == ["agent_0", "agent_1", "agent_2"]
    learner = gymnasium.make(gymnasium_id("circle"), n=3, learner=2)
    assert len(learner.unwrapped.game.agents) == 3
    assert learner.unwrapped.learner == 2


@needs_registry
def test_any_game_has_an_id_and_files_are_given_by_path(tmp_path: Path) -> None:
    game = make_game("circle(4)", lam=0.3)
    (tmp_path / "mine.toml").write_text(game_to_toml(game))
    for given in (tmp_path / "mine.toml", str(tmp_path / "mine.toml"), "circle(4)", game):
        env = pettingzoo.make("parallel", pettingzoo_id("game"), game=given)
        assert len(env.possible_agents) == 4
        assert len(gymnasium.make(gymnasium_id("game"), game=given).unwrapped.game.agents) == 4


def test_the_id_of_any_game_has_the_default_of_the_views() -> None:
    assert gymnasium.make("ppg/Game-v0").unwrapped.game == make_game("opposing")
    assert gymnasium.make_vec("ppg/Game-v0", 2).unwrapped.game == make_game("opposing")


def test_an_unknown_option_is_answered_with_each_name_once() -> None:
    with pytest.raises(InputError, match=r"^bogus: is not an option") as caught:
        gymnasium.make("ppg/HeadOn-v0", bogus=1)
    names = str(caught.value).split("use one of ")[1].rstrip(".").split(", ")
    assert len(names) == len({*names})


@pytest.mark.parametrize(
    ("view", "own"),
    [
        (parallel_env, "game, render_mode, observation, infos, randomize, arrival,"),
        (SingleAgentEnv, "game, learner, players, render_mode, observation, randomize, infos,"),
        (
            GameVectorEnv,
            "game, num_envs, autoreset_mode, learner, players, observation, randomize,",
        ),
    ],
)
def test_an_unknown_option_is_answered_with_the_view_s_own_parameters(view: Any, own: str) -> None:
    with pytest.raises(InputError, match=f"^qqq: is not an option; use one of {own}"):
        view("head_on", qqq=1)
    with pytest.raises(InputError, match=r"^speeed: is not an option; perhaps you mean 'speed'\."):
        view("head_on", speeed="l1")


def test_what_other_views_call_a_parameter_is_understood() -> None:
    with pytest.raises(InputError, match=r"^copies: is not an option; perhaps you mean 'num_envs'"):
        GameVectorEnv("head_on", copies=3)


@needs_registry
def test_unknown_arguments_are_refused_by_name() -> None:
    with pytest.raises(InputError, match="m: is not an option"):
        pettingzoo.make("parallel", pettingzoo_id("circle"), m=3)


@needs_registry
def test_registering_again_changes_nothing_and_warns_of_nothing() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register_environments()


def test_a_gymnasium_id_may_import_the_package() -> None:
    code = "import gymnasium; print(gymnasium.make('ppg_env:ppg/HeadOn-v0').unwrapped)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "SingleAgentEnv" in done.stdout


if __name__ == "__main__":
    content = {pettingzoo_id(name): record(name) for name in NAMES}
    lines = [f"{json.dumps(key)}: {json.dumps(content[key])}" for key in content]
    STORED.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    print(f"stored {len(content)} trajectories of version {VERSION}")  # noqa: T201  # a command's output
