"""Any game can be trained on: flat and one-sided sets, unequal agents, one to three axes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.env_checker import check_env

from baselines import GameVecEnv, train_players
from baselines.training_loop import one_thread
from ppg_env import Agent, Game, Polytope, SingleAgentEnv, parallel_env
from tests.baselines.small_games import BODY, FULL, line, sizes, space
from tests.marks import slow_if

SETS = {
    "zero width": Polytope.box([10.0, 0.0]),
    "a point": Polytope.from_vertices([[3, 1]]),
    "nothing": Polytope.box([0.0, 0.0]),
    "one-sided": Polytope.from_vertices([[1, -2], [6, -2], [6, 2], [1, 2]]),
    "slanted": Polytope.from_vertices([[-2, -1], [6, 3]]),
}


def two(control: Polytope) -> Game:
    """An agent with this control set, and one that may do anything."""
    agents = (
        Agent([0, 0], [30, 10], BODY, control, gain=0.3),
        Agent([30, 2], [0, 2], BODY, FULL, gain=0.5),
    )
    return Game(agents, horizon=10)


GAMES: dict[str, Callable[[], Game]] = {
    **{name: lambda control=control: two(control) for name, control in SETS.items()},
    "sizes": sizes,
    "line": line,
    "space": space,
}


@pytest.mark.parametrize("kind", GAMES)
def test_spaces_are_finite_and_as_wide_as_algorithms_need_them(kind: str) -> None:
    game = GAMES[kind]()
    env = parallel_env(game)
    for i, agent in enumerate(game.agents):
        space = env.action_space(f"agent_{i}")
        assert space.shape == (agent.control_dim,)
        assert np.isfinite(space.low).all()
        assert np.isfinite(space.high).all()
        assert (space.low < space.high).all()
        low, high = (bound.astype(np.float32) for bound in agent.control.bounds)
        wide = high > low
        np.testing.assert_array_equal(space.low[wide], low[wide])
        np.testing.assert_array_equal(space.high[wide], high[wide])
        np.testing.assert_allclose((space.low + space.high)[~wide], 2 * low[~wide], atol=1e-6)


def test_inputs_that_cannot_vary_keep_their_value() -> None:
    env = parallel_env(two(SETS["zero width"]), noise=0.0)
    env.reset(seed=0)
    env.step({"agent_0": env.action_space("agent_0").high, "agent_1": [0.0, 0.0]})
    assert env.simulator.state[0, 0].tolist() == [5.0, 0.0]
    free = parallel_env(two(SETS["zero width"]), saturation="none").action_space("agent_0")
    assert (free.low[1], free.high[1]) == (0.0, 0.0), "taken as it is, it must be in the set"


@one_thread()
@pytest.mark.parametrize("kind", slow_if(lambda kind: kind == "space", GAMES))
def test_ppo_takes_its_steps_in_all_slots(kind: str) -> None:
    env = GameVecEnv(GAMES[kind](), copies=4)
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(16 * env.num_envs)
    assert all(bool(parameter.isfinite().all()) for parameter in model.policy.parameters())
    assert np.isfinite(env.simulator.last.reward).all()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:We recommend you to use a symmetric:UserWarning")
@one_thread()
@pytest.mark.parametrize("kind", GAMES)
def test_sac_takes_its_steps_as_one_learner(kind: str) -> None:
    """SAC divides by the widths of the action space."""
    for learner in (0, 1):
        env = SingleAgentEnv(GAMES[kind](), learner=learner, max_cycles=12)
        check_env(env)
        wrapped = RescaleAction(env, np.float32(-1), np.float32(1))
        for each in (env, wrapped):
            model = SAC("MlpPolicy", each, learning_starts=8, batch_size=16, seed=0, device="cpu")
            model.learn(24)
            assert all(bool(parameter.isfinite().all()) for parameter in model.policy.parameters())


@pytest.mark.slow
@pytest.mark.usefixtures("short_trainings")
@pytest.mark.parametrize("method", ["shared", "best-response", "off-policy"])
@pytest.mark.parametrize("kind", GAMES)
def test_every_kind_of_game_has_trained_players(kind: str, method: str) -> None:
    learned = train_players(GAMES[kind](), method, lam=None, steps=1024)
    assert np.isfinite(learned.about["figures"][0]["expected_cost"]["value"])
