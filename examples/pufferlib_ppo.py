"""PPO on PufferLib's vector environment, with its policy: python examples/pufferlib_ppo.py.

PufferLib runs two ``GamePufferEnv``, each with many copies of the game, and hands out one row per
copy and agent; all rows share ``pufferlib.models.Default``.  The loop is a plain PPO, because the
trainer of the wheels, ``pufferlib.pufferl``, loads only with the PyTorch that they were built with.
Rows of agents that wait for the end of their copy are ``masks`` unset and not learned from; rewards
are shaped and scaled.
"""

from __future__ import annotations

import numpy as np
import pufferlib.vector
import torch
from figures import report
from pufferlib.models import Default
from pufferlib.pytorch import sample_logits
from shaped_learner import SCALE
from task import cpu_seconds, read_task

from baselines import GamePufferEnv

COPIES, HORIZON, EPOCHS, MINIBATCH, RATE = 32, 32, 10, 512, 1e-3
GAMMA, LAMBDA = 0.99, 0.95

if __name__ == "__main__":
    torch.manual_seed(1)
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=600_000)  # of all agents
    game = task.game
    options = {"game": game, "copies": COPIES, "shaping": True, "reward_scale": SCALE} | task.rules
    envs = pufferlib.vector.make(
        GamePufferEnv, env_kwargs=options, backend=pufferlib.vector.Serial, num_envs=2, seed=1
    )
    rows, batch = envs.num_agents, envs.num_agents * HORIZON
    policy = Default(envs.driver_env, hidden_size=128)
    with torch.no_grad():
        policy.decoder_logstd.fill_(-0.5)
    optimizer = torch.optim.Adam(policy.parameters(), lr=RATE, eps=1e-5)
    obs = torch.zeros(HORIZON, rows, *envs.single_observation_space.shape)
    actions = torch.zeros(HORIZON, rows, *envs.single_action_space.shape)
    logprobs, rewards, values, ends = torch.zeros(4, HORIZON, rows)
    acting = torch.zeros(HORIZON, rows, dtype=torch.bool)

    envs.reset(seed=1)
    start = cpu_seconds()
    for _ in range(-(-task.steps // batch)):
        for t in range(HORIZON):
            obs[t], acting[t] = torch.as_tensor(envs.observations), torch.as_tensor(envs.masks)
            with torch.no_grad():
                normal, value = policy.forward_eval(obs[t])
                actions[t], logprobs[t], _ = sample_logits(normal)
            values[t] = value.flatten()
            _, reward, terminals, _, _ = envs.step(actions[t].clamp(-1, 1).numpy())
            rewards[t], ends[t] = torch.as_tensor(reward), torch.as_tensor(terminals)

        with torch.no_grad():
            following = policy.forward_eval(torch.as_tensor(envs.observations))[1].flatten()
            advantages, running = torch.zeros_like(rewards), torch.zeros(rows)
            for t in reversed(range(HORIZON)):
                delta = rewards[t] + GAMMA * following * (1 - ends[t]) - values[t]
                running = delta + GAMMA * LAMBDA * (1 - ends[t]) * running
                advantages[t], following = running, values[t]
            returns = advantages + values

        parts = (obs, actions, logprobs, advantages, returns)
        flat = [part.flatten(0, 1)[acting.flatten()] for part in parts]
        for _ in range(EPOCHS):
            for chosen in torch.randperm(len(flat[0])).split(MINIBATCH):
                seen, played, logprob, advantage, wanted = (part[chosen] for part in flat)
                normal, value = policy.forward_eval(seen)
                ratio = (sample_logits(normal, played)[1] - logprob).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(0.8, 1.2)
                objective = torch.min(advantage * ratio, advantage * clipped).mean()
                error = (value.flatten() - wanted).square().mean()
                optimizer.zero_grad()
                (0.25 * error - objective).backward()
                torch.nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
                optimizer.step()
    seconds = cpu_seconds() - start
    envs.close()

    def act(_: int, observations: np.ndarray) -> np.ndarray:
        """Return the mean action."""
        with torch.no_grad():
            return policy.forward_eval(torch.as_tensor(observations))[0].mean.numpy()

    report("pufferlib-ppo", task, act, steps=-(-task.steps // batch) * batch, seconds=seconds)
