"""One PPO per agent, learning in turns against the others as they are.

Two methods differ in how long a turn is:

    independent     a rollout each, in turn: everybody chases everybody (independent PPO)
    best response   many rollouts each: every learner answers the frozen others before they move,
                    the learning twin of best-response dynamics (iterated best response)
"""

from __future__ import annotations

from baselines.policy import Team
from baselines.ppo import COPIES, make_learner, player_of, policy_of
from baselines.training_loop import Args, Progress, Turn, take_turns
from baselines.warm_start import imitate_go_to_goal

ROUNDS = 4
"""Rounds of iterated best response; the steps are shared out among them."""


def independent(args: Args, progress: Progress = lambda _steps: None) -> Team:
    """Independent PPO: a policy for each agent, all learning together."""
    return _train(args, None, progress)


def best_response(args: Args, progress: Progress = lambda _steps: None) -> Team:
    """Iterated best response in policy space: a policy for each agent."""
    return _train(args, ROUNDS, progress)


def _train(args: Args, rounds: int | None, progress: Progress) -> Team:
    everybody = range(len(args.game.agents))
    learners = [make_learner(args, [i], copies=2 * COPIES) for i in everybody]
    each = -(-args.steps // (learners[0].rollout * len(learners)))  # rollouts
    length = 1 if rounds is None else max(each // rounds, 1)
    turns = [Turn(i, length) for _ in range(-(-each // length)) for i in everybody]

    def prepare() -> None:
        for learner in learners:
            imitate_go_to_goal(learner.model, learner.env, args.seed)

    def meet_the_others(turn: Turn) -> None:
        for j in everybody:
            if j != turn.learner:
                learners[turn.learner].env.players[j] = player_of(args, learners[j], j)

    take_turns(args, learners, turns, prepare=prepare, before=meet_the_others, progress=progress)
    return tuple(policy_of(args, learner) for learner in learners)
