"""Soft actor-critic for one agent, against the others flying straight.

The one-learner view with a method that learns from old experience too: it needs a tenth of PPO's
steps, and takes longer for each.
"""

from __future__ import annotations

from stable_baselines3 import SAC

from baselines.export import export_policy
from baselines.policy import Policy, Team
from baselines.training_loop import Args, Learner, Progress, in_pieces, one_thread, take_turns
from baselines.vec_env import GameVecEnv
from ppg_env.env.rules import Rules
from ppg_env.errors import require

COPIES = 32
BUFFER, BATCH, RATE = 200_000, 512, 1e-3
UPDATES = 8  # for the 32 steps that a step of all copies brings

ENTROPY = 0.003
"""Fixed weight of entropy: rewards are of order one, and the best action hardly matters less."""

ROLLOUT = 100
"""Steps of all copies that count as one rollout, between which checkpoints may be written."""


@one_thread()
def train(args: Args, progress: Progress = lambda _steps: None, *, learner: int = 0) -> Team:
    """Train the policy of one agent, the ``learner``; everybody else flies straight."""
    count = len(args.game.agents)
    require(0 <= learner < count, "learner", f"is {learner} of {count}", "count agents from 0")
    env = GameVecEnv(
        args.game,
        Rules(sharing=args.sharing),
        COPIES,
        learners=[learner],
        weights=args.lam,
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
    team[learner] = export_policy(model, conditioned=args.lam is not None)
    return tuple(team)
