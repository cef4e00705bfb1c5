"""Proximal policy optimisation with the settings of all PPO methods here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from stable_baselines3 import PPO
from torch import nn

from baselines.experts import ExpertPolicy
from baselines.export import actor_layers, export_policy
from baselines.policy import LearnedPlayer, Policy
from baselines.training_loop import Args, Learner, one_thread
from baselines.vec_env import GameVecEnv

COPIES = 256
ROLLOUT = 16  # steps of each copy between two updates: longer than an episode
BATCH, EPOCHS, RATE = 2048, 5, 2e-3  # large batches: small ones leave the cores idle
LOG_STD = -1.0  # exploration of 0.37 of the largest control: with more, all agents crash at first

FINE_RATE, FINE_LOG_STD = 5e-4, -2.3
"""The same after a warm start from feedback players: what was imitated is not to be lost."""

EXPERTS = 3
"""Experts of networks that imitate feedback players."""

GAMMA = 1.0
"""Episodes are finite, and costs are not discounted."""

GAE_LAMBDA = 0.9
"""Less than the usual 0.95: crashes are rare and costly, and their noise reaches back less far."""


@one_thread()
def make_learner(
    args: Args, learners: Sequence[int] | None = None, *, copies: int = COPIES
) -> Learner:
    """Create a PPO in its own environment.

    The network is stable-baselines3's default, with experts if it imitates feedback players.
    """
    env = GameVecEnv(
        args.game,
        args.rules,
        copies,
        learners=learners,
        weights=args.lam,
        randomize=args.randomize,
        bootstrap=False,
        seed=args.seed,
    )
    fine = args.imitate_feedback
    options: dict[str, Any] = {"log_std_init": FINE_LOG_STD if fine else LOG_STD}
    if fine:
        options["experts"] = EXPERTS
    model = PPO(
        ExpertPolicy if fine else "MlpPolicy",
        env,
        learning_rate=FINE_RATE if fine else RATE,
        n_steps=ROLLOUT,
        batch_size=min(BATCH, ROLLOUT * env.num_envs),
        n_epochs=EPOCHS,
        gamma=GAMMA,
        gae_lambda=GAE_LAMBDA,
        policy_kwargs=options,
        tensorboard_log=None if args.tensorboard is None else str(args.tensorboard),
        seed=args.seed,
        device="cpu",
    )
    return Learner(model, env, ROLLOUT * env.num_envs)


def policy_of(args: Args, learner: Learner) -> Policy:
    """Return the learner's policy as arrays."""
    return export_policy(learner.model, conditioned=args.lam is not None, randomize=args.randomize)


def player_of(args: Args, learner: Learner, agent: int) -> LearnedPlayer:
    """Return the learner's current policy as a player of ``agent``."""
    return LearnedPlayer(args.game, agent, policy_of(args, learner))


def copy_policy(policy: Policy, learner: Learner) -> bool:
    """Copy ``policy`` to the learner; return False, without a change, if its network differs."""
    layers = [layer for layer in actor_layers(learner.model) if isinstance(layer, nn.Linear)]
    shapes = [tuple(layer.weight.shape) for layer in layers]
    same = shapes == [weight.shape for weight in policy.weights]
    if policy.activation != "tanh" or policy.experts > 1 or not same:
        return False
    with torch.no_grad():
        for layer, weight, bias in zip(layers, policy.weights, policy.biases, strict=True):
            layer.weight.copy_(torch.tensor(weight))
            layer.bias.copy_(torch.tensor(bias))
    return True
