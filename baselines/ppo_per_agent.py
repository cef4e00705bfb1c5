"""One PPO per agent, trained in turns against the current policies of the others.

Two methods differ in how long a turn is:

    independent     one rollout each, in turn (independent PPO)
    best response   many rollouts each: every learner approaches a best response to the frozen
                    others, as in best-response dynamics (iterated best response)
"""

from __future__ import annotations

from baselines.policy import Team
from baselines.ppo import COPIES, make_learner, player_of, policy_of
from baselines.training_loop import Activity, Args, Progress, Turn, silent, take_turns
from baselines.warm_start import warm_start

ROUNDS = 4
"""Rounds of iterated best response; the steps are divided among them."""


def independent(
    args: Args, progress: Progress = lambda _steps: None, activity: Activity = silent
) -> Team:
    """Train a policy for each agent by independent PPO, all together."""
    return _train(args, None, progress, activity)


def best_response(
    args: Args, progress: Progress = lambda _steps: None, activity: Activity = silent
) -> Team:
    """Train a policy for each agent by iterated best response in policy space."""
    return _train(args, ROUNDS, progress, activity)


def _train(args: Args, rounds: int | None, progress: Progress, activity: Activity) -> Team:
    agents = range(len(args.game.agents))
    learners = [make_learner(args, [i], copies=2 * COPIES) for i in agents]
    each = -(-args.steps // (learners[0].rollout * len(learners)))  # rollouts
    length = 1 if rounds is None else max(each // rounds, 1)
    turns = [Turn(i, length) for _ in range(-(-each // length)) for i in agents]

    def prepare() -> None:
        for learner in learners:
            warm_start(args, learner, activity)

    def update_opponents(turn: Turn) -> None:
        for j in agents:
            if j != turn.learner:
                learners[turn.learner].env.players[j] = player_of(args, learners[j], j)

    take_turns(args, learners, turns, prepare=prepare, before=update_opponents, progress=progress)
    return tuple(policy_of(args, learner) for learner in learners)
