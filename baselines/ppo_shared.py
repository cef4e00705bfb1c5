"""PPO with one policy for all agents: a learned equilibrium, or a learned optimum.

With ``sharing="selfish"`` the reward of an agent is minus its own cost, with ``"social"`` minus the
sum of all costs.  Observations differ between agents, so their behaviour can differ too.
"""

from __future__ import annotations

from baselines.policy import Team
from baselines.ppo import make_learner, policy_of
from baselines.training_loop import Activity, Args, Progress, in_pieces, silent, take_turns
from baselines.warm_start import warm_start


def train(
    args: Args, progress: Progress = lambda _steps: None, activity: Activity = silent
) -> Team:
    """Train one policy for all agents."""
    learner = make_learner(args)
    rollouts = -(-args.steps // learner.rollout)
    take_turns(
        args,
        [learner],
        in_pieces(0, rollouts, args.checkpoint_every),
        prepare=lambda: warm_start(args, learner, activity),
        progress=progress,
    )
    return (policy_of(args, learner),)
