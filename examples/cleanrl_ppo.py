"""PPO for continuous actions in one file, as CleanRL writes it: python examples/cleanrl_ppo.py.

All agents share one network.  ``ppg_env.Simulator`` steps ``num_envs`` copies of the game at once
in place of ``gym.vector``; each agent of a copy is one row of the batch.
An agent that has left waits for the end of its copy, and ``acting`` masks its rows.  A time limit
ends an episode without bootstrap, because the clock is observed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from figures import report
from shaped_learner import SCALE, Potential
from task import cpu_seconds, read_task
from torch import nn
from torch.distributions.normal import Normal

from ppg_env import Simulator
from ppg_env.env import Rules


@dataclass
class Args:
    """The settings, under CleanRL's names; each time step moves all agents."""

    total_timesteps: int = 50_000
    learning_rate: float = 1e-3
    num_envs: int = 16
    num_steps: int = 64
    gamma: float = 0.99
    gae_lambda: float = 0.95
    minibatch_size: int = 256
    update_epochs: int = 10
    clip_coef: float = 0.2


class Agent(nn.Module):
    """The networks of actor and critic."""

    def __init__(self, observations: int, actions: int) -> None:
        super().__init__()
        self.critic = mlp(observations, 1, 1.0)
        self.actor_mean = mlp(observations, actions, 0.01)
        self.actor_logstd = nn.Parameter(torch.full((actions,), -0.5))

    def policy(self, x: torch.Tensor) -> Normal:
        """Return the distribution of actions."""
        return Normal(self.actor_mean(x), self.actor_logstd.exp())


def mlp(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    """Return a network with two hidden layers and orthogonal weights."""
    one, two, three = nn.Linear(inputs, 64), nn.Linear(64, 64), nn.Linear(64, outputs)
    for layer, std in ((one, 2**0.5), (two, 2**0.5), (three, gain)):
        nn.init.orthogonal_(layer.weight, std)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(one, nn.Tanh(), two, nn.Tanh(), three)


if __name__ == "__main__":
    task = read_task(steps=Args.total_timesteps)
    args, game = Args(total_timesteps=task.steps), task.game
    torch.manual_seed(1)
    torch.set_num_threads(1)  # the networks are small
    envs = Simulator(game, Rules(**task.rules), copies=args.num_envs, seed=1)
    slots = args.num_envs * len(game.agents)
    middle, half = (envs.high + envs.low) / 2, (envs.high - envs.low) / 2
    potential, start = Potential(game), cpu_seconds()
    agent = Agent(envs.observation_size, envs.action_size)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    obs = torch.zeros(args.num_steps, slots, envs.observation_size)
    actions = torch.zeros(args.num_steps, slots, envs.action_size)
    logprobs, rewards, values, dones, acting, advantages = torch.zeros(6, args.num_steps, slots)
    next_obs = torch.tensor(envs.reset().reshape(slots, -1))
    for _ in range(-(-args.total_timesteps // (args.num_steps * args.num_envs))):
        for step in range(args.num_steps):
            obs[step] = next_obs
            with torch.no_grad():
                policy = agent.policy(next_obs)
                actions[step], values[step] = policy.sample(), agent.critic(next_obs).flatten()
                logprobs[step] = policy.log_prob(actions[step]).sum(1)
            action = actions[step].clamp(-1, 1).numpy().reshape(args.num_envs, *half.shape)
            before = potential.of_all(envs.last.observation)
            out = envs.step(middle + half * action, restart=False)
            after = potential.of_all(out.observation)
            rewards[step] = torch.as_tensor((out.reward + after - before).ravel() / SCALE)
            dones[step] = torch.as_tensor((out.terminated | out.truncated).ravel())
            acting[step] = torch.as_tensor(out.acting.ravel())
            next_obs = torch.tensor(envs.reset(~envs.alive.any(axis=1)).reshape(slots, -1))
        with torch.no_grad():
            next_value, lastgaelam = agent.critic(next_obs).flatten(), torch.zeros(slots)
            for t in reversed(range(args.num_steps)):
                delta = rewards[t] + args.gamma * next_value * (1 - dones[t]) - values[t]
                lastgaelam = delta + args.gamma * args.gae_lambda * (1 - dones[t]) * lastgaelam
                advantages[t], next_value = lastgaelam, values[t]
            returns = (advantages + values).flatten()
        rows = torch.nonzero(acting.flatten()).flatten()  # those of agents in the game
        flat = [x.flatten(0, 1) for x in (obs, actions, logprobs, advantages)]
        for _ in range(args.update_epochs):
            for mb in rows[torch.randperm(len(rows))].split(args.minibatch_size):
                b_obs, b_actions, b_logprobs, b_advantages = (x[mb] for x in flat)
                ratio = (agent.policy(b_obs).log_prob(b_actions).sum(1) - b_logprobs).exp()
                b_advantages = (b_advantages - b_advantages.mean()) / (b_advantages.std() + 1e-8)
                clipped = ratio.clamp(1 - args.clip_coef, 1 + args.clip_coef)
                pg_loss = -torch.min(b_advantages * ratio, b_advantages * clipped).mean()
                v_loss = 0.25 * (agent.critic(b_obs).flatten() - returns[mb]).square().mean()
                optimizer.zero_grad()
                (pg_loss + v_loss).backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action."""
        with torch.no_grad():
            return agent.actor_mean(torch.as_tensor(observations)).numpy()

    steps, seconds = args.total_timesteps * len(game.agents), cpu_seconds() - start
    report("cleanrl-ppo", task, act, steps=steps, seconds=seconds)
