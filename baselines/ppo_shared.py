"""PPO with one policy for everybody: a learned equilibrium, or a learned optimum.

With ``sharing="selfish"`` every agent is paid its own cost, with ``"social"`` everybody is paid
the sum of all.  The agents are told apart by what they see, so they need not behave alike.
"""

from __future__ import annotations

from baselines.policy import Team
from baselines.ppo import make_learner, policy_of
from baselines.training_loop import Args, Progress, in_pieces, take_turns
from baselines.warm_start import imitate_go_to_goal


def train(args: Args, progress: Progress = lambda _steps: None) -> Team:
    """Train one policy that all agents share."""
    learner = make_learner(args)
    rollouts = -(-args.steps // learner.rollout)
    take_turns(
        args,
        [learner],
        in_pieces(0, rollouts, args.checkpoint_every),
        prepare=lambda: imitate_go_to_goal(learner.model, learner.env, args.seed),
        progress=progress,
    )
    return (policy_of(args, learner),)
