"""Exported networks compute what torch computes, and play within the control's box."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from baselines import GameVecEnv, LearnedPlayer, Policy, export_policy
from baselines.policy import team_players
from ppg_env import Game, InputError, make_game
from ppg_env.env.simulator import Simulator
from tests.baselines.small import small_policy


@pytest.mark.parametrize("kind", [PPO, A2C, SAC])
@pytest.mark.parametrize("weights", [None, (0.1, 0.9)])
def test_an_exported_policy_acts_as_the_model_does(game: Game, kind, weights) -> None:
    env = GameVecEnv(game, copies=4, weights=weights)
    model = kind("MlpPolicy", env, seed=1, device="cpu")
    if kind is not SAC:
        with torch.no_grad():
            model.policy.action_net.weight.mul_(300)  # out of the dull middle, into the clipping
    policy = export_policy(model, conditioned=weights is not None)
    seen = np.random.default_rng(0).normal(size=(200, *env.observation_space.shape))
    seen = seen.astype(np.float32)
    wanted, _ = model.predict(seen, deterministic=True)
    np.testing.assert_allclose(policy(seen), wanted, atol=2e-5)
    assert np.abs(wanted).max() <= 1
    assert policy.conditioned == (weights is not None)


def test_normalised_observations_are_refused(game: Game) -> None:
    model = PPO("MlpPolicy", VecNormalize(GameVecEnv(game, copies=2)), device="cpu")
    with pytest.raises(InputError, match="norm_obs=False"):
        export_policy(model)
    fine = VecNormalize(GameVecEnv(game, copies=2), norm_obs=False)
    assert export_policy(PPO("MlpPolicy", fine, device="cpu")).inputs == 9


def test_strange_networks_are_refused(game: Game) -> None:
    net = {"activation_fn": torch.nn.ELU}
    model = PPO("MlpPolicy", GameVecEnv(game, copies=2), policy_kwargs=net, device="cpu")
    with pytest.raises(InputError, match="tanh or relu"):
        export_policy(model)


@pytest.mark.parametrize("conditioned", [False, True])
def test_a_player_sees_what_its_policy_was_trained_on(game: Game, conditioned: bool) -> None:
    policy = small_policy(game, conditioned=conditioned)
    simulator = Simulator(game, copies=5, seed=1)
    simulator.lam[:] = np.linspace(0.1, 0.9, 10).reshape(5, 2)
    seen = simulator.reset()[:, 1]
    if conditioned:
        seen = np.hstack([seen, simulator.lam[:, 1:].astype(np.float32)])
    action = LearnedPlayer(game, 1, policy).act(simulator.view(1))
    np.testing.assert_allclose(action, 10 * policy(seen), rtol=1e-6)
    assert np.abs(action).max() <= 10


def test_actions_fill_the_box_around_a_control_set_that_is_not_centred() -> None:
    control = {"vertices": [[-1, -2], [5, -2], [5, 4], [-1, 4]]}
    game = make_game("parallel", control=control)
    width = small_policy(game).inputs
    for sign, corner in ((-1, [-1, -2]), (1, [5, 4])):
        policy = Policy((np.zeros((2, width)),), (np.full(2, 3.0 * sign),))
        view = Simulator(game).view(0)
        np.testing.assert_allclose(LearnedPlayer(game, 0, policy).act(view), [corner])


def test_a_team_of_another_size_is_refused(game: Game) -> None:
    policy = small_policy(game)
    three = make_game("intersection3")
    with pytest.raises(InputError, match="9 inputs"):
        team_players(three, (policy,))
    with pytest.raises(InputError, match="for 2 agents"):
        team_players(three, (policy, policy))
    assert len(team_players(game, (None, policy))) == 2


def test_weights_that_do_not_fit_together_are_refused() -> None:
    good = np.zeros((2, 3)), np.zeros(2)
    with pytest.raises(InputError, match="do not fit"):
        Policy((good[0], np.zeros((2, 3))), (good[1], np.zeros(2)))
    with pytest.raises(InputError, match="finite"):
        Policy((good[0] * np.nan,), (good[1],))
    with pytest.raises(InputError, match="activation"):
        Policy((good[0],), (good[1],), "sine")
    with pytest.raises(InputError, match="do not fit"):
        Policy((), ())
