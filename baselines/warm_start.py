r"""Warm start: the network first imitates the straight way to the goal, or feedback players.

    minimise  mean |policy(x) - go_to_goal(x)|^2

over states of agents with random disturbances.  From a random network PPO often converges to a safe
and useless policy, to move away from all others: near them every step is dangerous, and far away
the way back is long.  From the straight way it only has to learn when to give way.

With feedback players, imitation (:mod:`baselines.imitation`) is followed by descent on the costs
that they know (:mod:`baselines.cost_descent`), and the value network is fitted next, while the
policy stays as it is: the first estimates of a random one would undo what was imitated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from baselines.cost_descent import descend
from baselines.export import actor_layers, mean_action
from baselines.imitation import imitate_feedback, make_demonstrations
from baselines.training_loop import Activity, Args, Learner, silent
from baselines.vec_env import GameVecEnv
from ppg_env.env.players import GoToGoal

STEPS = 48
"""Steps of each copy: a few episodes."""

PUSH = 0.7
"""Standard deviation of the disturbances, in units of the largest control."""

UPDATES, BATCH, RATE = 1500, 1024, 2e-3

CRITIC_ROLLOUTS, CRITIC_RATE = 20, 1e-3
"""Rollouts, and learning rate, that fit the value network to the policy that was imitated."""


def warm_start(args: Args, learner: Learner, activity: Activity = silent) -> None:
    """Let the network of ``learner`` imitate feedback players or straight ways."""
    if args.imitate_feedback:
        random = np.random.default_rng(args.seed)
        demonstrations = make_demonstrations(args, learner.env.learners, activity)
        imitate_feedback(learner.model, demonstrations, random, activity)
        descend(learner.model, demonstrations, random, activity)
        activity("fitting the value network")
        _fit_critic(learner)
    else:
        activity("imitating straight ways")
        imitate_go_to_goal(learner.model, learner.env, args.seed)
    activity("")


def _fit_critic(learner: Learner) -> None:
    """Train the value network of ``learner``, and no other parameter."""
    model = learner.model
    actor = [value for layer in actor_layers(model) for value in layer.parameters()]
    frozen = [*actor, model.policy.log_std]
    for value in frozen:
        value.requires_grad_(False)
    schedule, model.lr_schedule = model.lr_schedule, lambda _left: CRITIC_RATE
    model.learn(CRITIC_ROLLOUTS * learner.rollout, tb_log_name="critic")
    model.lr_schedule, model.num_timesteps = schedule, 0
    for value in frozen:
        value.requires_grad_(True)


def imitate_go_to_goal(model: Any, env: GameVecEnv, seed: int) -> None:
    """Fit the mean policy of ``model`` to the straight way in the game of ``env``."""
    random = np.random.default_rng(seed)
    observations, actions = _examples(env, random)
    inputs, targets = torch.as_tensor(observations), torch.as_tensor(actions)
    optimiser = torch.optim.Adam(model.policy.parameters(), lr=RATE)
    for _ in range(UPDATES):
        some = torch.as_tensor(random.integers(len(inputs), size=BATCH))
        loss = ((mean_action(model, inputs[some]) - targets[some]) ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()


def _examples(env: GameVecEnv, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs (K, W) and straight actions (K, m) of learners with disturbances."""
    players = {i: GoToGoal(env.simulator.game, i) for i in env.learners}
    shape = (env.simulator.copies, len(env.learners), env.simulator.action_size)
    observations, actions = [], []
    observation: Any = env.reset()
    push = random.normal(size=shape) * PUSH
    for _ in range(STEPS):
        action = np.zeros(shape, dtype=np.float32)
        for k, i in enumerate(env.learners):
            action[:, k] = env.normalised(i, players[i].act(env.simulator.view(i)))
        observations.append(observation)
        actions.append(action.reshape(-1, shape[2]))
        changes = random.random((shape[0], 1, 1)) < 0.2
        push = np.where(changes, random.normal(size=shape) * PUSH, push)
        keeps = random.random((*shape[:2], 1)) < 0.5
        moved = np.clip(action * keeps + push, -1.0, 1.0)
        observation = env.step(moved.reshape(-1, shape[2]))[0]
    return np.concatenate(observations), np.concatenate(actions)
