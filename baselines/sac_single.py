"""Soft actor-critic for one agent, against others on their straight plans.

The method is off-policy: it needs a tenth of the steps of PPO, and more time for each.
"""

from __future__ import annotations

from stable_baselines3 import SAC

from baselines.export import export_policy
from baselines.policy import Policy, Team
from baselines.training_loop import (
    Activity,
    Args,
    Learner,
    Progress,
    in_pieces,
    one_thread,
    silent,
    take_turns,
)
from baselines.vec_env import GameVecEnv
from ppg_env.errors import require

COPIES = 32
BUFFER, BATCH, RATE = 200_000, 512, 1e-3
UPDATES = 8  # for the 32 steps that a step of all copies brings

ENTROPY = 0.003
"""Fixed weight of entropy, small because rewards are of order one."""

ROLLOUT = 100
"""Steps of all copies in one rollout; checkpoints are written between rollouts."""


@one_thread()
def train(
    args: Args,
    progress: Progress = lambda _steps: None,
    _activity: Activity = silent,
    *,
    learner: int = 0,
) -> Team:
    """Train the policy of one agent, the ``learner``; all others follow their straight plans."""
    count = len(args.game.agents)
    require(0 <= learner < count, "learner", f"is {learner} of {count}", "count agents from 0")
    env = GameVecEnv(
        args.game,
        args.rules,
        COPIES,
        learners=[learner],
        weights=args.lam,
        randomize=args.randomize,
        bootstrap=False,
        seed=args.seed,
    )
    model = SAC(
        "MlpPolicy",
        env,
        learning_rate=RATE,
        buffer_size=BUFFER,
        batch_size=BATCH,
        learning_starts=ROLLOUT * COPIES // 2,
        gamma=1.0,
        train_freq=1,
        gradient_steps=UPDATES,
        ent_coef=ENTROPY,
        policy_kwargs={"net_arch": [64, 64]},
        tensorboard_log=None if args.tensorboard is None else str(args.tensorboard),
        seed=args.seed,
        device="cpu",
    )
    rollout = ROLLOUT * COPIES
    rollouts = -(-args.steps // rollout)
    take_turns(
        args,
        [Learner(model, env, rollout)],
        in_pieces(0, rollouts, args.checkpoint_every),
        progress=progress,
    )
    team: list[Policy | None] = [None] * count
    team[learner] = export_policy(model, conditioned=args.lam is not None, randomize=args.randomize)
    return tuple(team)
