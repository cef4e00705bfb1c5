"""MAPPO of TorchRL on the batched environment: python examples/torchrl_mappo.py.

The program is that of TorchRL's tutorial on multi-agent PPO: all agents share one policy, and a
central critic sees all observations.  What differs: an agent that has ended waits for the end of
its copy, and ``mask`` takes these rows out of the loss; rewards are shaped and scaled; a time limit
ends the episode without bootstrap, because the clock is observed.  A line per batch says how many
of the agents whose copies ended in it have arrived, exploration included.
"""

from __future__ import annotations

import numpy as np
import torch
from figures import report
from shaped_learner import SCALE
from task import cpu_seconds, read_task
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torchrl.collectors import Collector
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import MultiAgentMLP, ProbabilisticActor, TanhNormal
from torchrl.objectives import ClipPPOLoss

from baselines import GameTorchRLEnv

COPIES, ROLLOUT, EPOCHS, MINIBATCH, RATE = 64, 32, 10, 512, 1e-3


def network(outputs: int, *, centralized: bool, env: GameTorchRLEnv) -> MultiAgentMLP:
    """Return a network that all agents share."""
    return MultiAgentMLP(
        n_agent_inputs=env.simulator.observation_size,
        n_agent_outputs=outputs,
        n_agents=len(env.agent_names),
        centralized=centralized,
        share_params=True,
        depth=2,
        num_cells=64,
        activation_class=torch.nn.Tanh,
    )


def make_actor(env: GameTorchRLEnv) -> ProbabilisticActor:
    """Return the policy, a squashed normal distribution over the box of controls."""
    inputs = env.simulator.action_size
    net = torch.nn.Sequential(
        network(2 * inputs, centralized=False, env=env),
        NormalParamExtractor(scale_mapping="biased_softplus_0.5"),
    )
    parameters = [("agents", "loc"), ("agents", "scale")]
    space = env.full_action_spec_unbatched["agents", "action"].space
    return ProbabilisticActor(
        TensorDictModule(net, [("agents", "observation")], parameters),
        in_keys=parameters,
        out_keys=[("agents", "action")],
        spec=env.full_action_spec_unbatched,
        distribution_class=TanhNormal,
        distribution_kwargs={"low": space.low, "high": space.high},
        return_log_prob=True,
        log_prob_key=("agents", "sample_log_prob"),
    )


if __name__ == "__main__":
    torch.manual_seed(1)
    torch.set_num_threads(1)  # the networks are small
    task = read_task(steps=600_000)  # of all agents
    game = task.game
    env = GameTorchRLEnv(game, COPIES, seed=1, shaping=True, reward_scale=SCALE, **task.rules)
    count = len(game.agents)
    actor = make_actor(env)
    critic = TensorDictModule(
        network(1, centralized=True, env=env),
        [("agents", "observation")],
        [("agents", "state_value")],
    )
    loss = ClipPPOLoss(actor, critic, clip_epsilon=0.2, entropy_coeff=0.0, reduction="none")
    loss.set_keys(
        reward=("agents", "reward"), action=("agents", "action"), value=("agents", "state_value"),
        done=("agents", "done"), terminated=("agents", "done"),
        sample_log_prob=("agents", "sample_log_prob"),
    )  # fmt: skip
    loss.make_value_estimator(gamma=0.99, lmbda=0.95)
    optimizer = torch.optim.Adam(loss.parameters(), lr=RATE)
    frames = COPIES * ROLLOUT
    total = -(-task.steps // (frames * count)) * frames
    options = {"frames_per_batch": frames, "total_frames": total}
    collector = Collector(env, actor, auto_register_policy_transforms=False, **options)
    start = cpu_seconds()
    for number, data in enumerate(collector):
        home = data["next", "agents", "info", "arrived"][data["next", "done"].squeeze(-1)]
        print(f"batch {number}: {100 * home.float().mean():.0f} % of {home.numel()} arrived")
        with torch.no_grad():
            loss.value_estimator(data)
        rows = data.reshape(-1)
        rows = rows[rows["agents", "mask"].any(dim=-1)]
        advantage, mask = rows["advantage"], rows["agents", "mask"]
        mean, std = advantage[mask].mean(), advantage[mask].std()
        rows["advantage"] = (advantage - mean) / (std + 1e-8)
        for _ in range(EPOCHS):
            for batch in rows[torch.randperm(len(rows))].split(MINIBATCH // count):
                parts, acting = loss(batch), batch["agents", "mask"]
                objective, value = (
                    parts[key].reshape(*acting.shape, -1)[acting].mean()
                    for key in ("loss_objective", "loss_critic")
                )
                optimizer.zero_grad()
                (objective + value).backward()
                torch.nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
    seconds = cpu_seconds() - start
    collector.shutdown()

    def act(agent: int, observations: np.ndarray) -> np.ndarray:
        """Return the most likely action; the policy acts for all agents, ``agent`` is one."""
        seen = torch.as_tensor(observations)[:, None].expand(-1, count, -1)
        batch = TensorDict({"agents": {"observation": seen}}, [len(observations)])
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            inputs = actor(batch)["agents", "action"][:, agent].numpy()
        return inputs / env.simulator.high[agent]

    report("torchrl-mappo", task, act, steps=total * count, seconds=seconds)
