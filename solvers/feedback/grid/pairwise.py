"""Feedback policies of three and more agents from the solutions of their pairs.

The joint state of more than two agents is too large for a grid.  Each pair of agents is solved as a
game of its own, and the agents look one step ahead on the sum of the pairs' costs
(:mod:`solvers.feedback.grid.pairwise_player`).  The sum is exact where each agent meets at most one
other; elsewhere it is an approximation, of which the simulated cost of the policies says how good
it is.  The policies are neither an optimum nor an equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from time import monotonic

from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from solvers.feedback.grid.dynamic_programming import (
    MEMORY_LIMIT,
    feedback_equilibrium,
    feedback_optimum,
)
from solvers.feedback.grid.feedback_solution import FeedbackSolution, PairwiseSolution
from solvers.feedback.grid.pairwise_player import JointDecisions
from solvers.feedback.grid.player import Policy


def pairwise_policies(
    game: Game,
    rules: Rules | None = None,
    *,
    social: bool,
    step: float | None = None,
    memory_limit: float = MEMORY_LIMIT,
    time_limit: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> PairwiseSolution:
    """Return policies that look ahead on the sum of the costs of all pairs.

    Parameters
    ----------
    game, rules
        A game of two or more agents with up to two state components each, of which arrived
        bodies leave; and the rules of play.
    social
        Minimise the sum of all costs, with the optimum of each pair, or each agent's own, with
        the equilibrium of each pair.
    memory_limit
        Largest number of bytes for all pairs together.
    time_limit
        Seconds after which the work ends with an error.

    Other parameters are those of :func:`feedback_optimum`; progress counts the stages of all pairs.

    Raises
    ------
    InputError
        If the game does not fit, or a limit does not suffice.
    """
    began, count = monotonic(), len(game.agents)
    rules = (Rules() if rules is None else rules).of(game)
    require(count > 1, "game", "has one agent", "use feedback_optimum")
    require(
        rules.on_goal == "remove",
        "on_goal",
        "is 'stay'",
        "use 'remove', or players that plan again (receding-social)",
    )
    solve = feedback_optimum if social else feedback_equilibrium
    keys = list(combinations(range(count), 2))
    pairs: dict[tuple[int, int], FeedbackSolution] = {}
    left = memory_limit
    for k, (i, j) in enumerate(keys):
        spent = monotonic() - began
        pairs[i, j] = solve(
            replace(game, agents=(game.agents[i], game.agents[j])),
            rules,
            step=step,
            memory_limit=left,
            time_limit=None if time_limit is None else max(time_limit - spent, 0.0),
            progress=_later(progress, k, len(keys)),
        )
        left -= _kept(pairs[i, j])
    policies = {pair: _policy(solution) for pair, solution in pairs.items()}
    return PairwiseSolution(
        game, rules, social, pairs, monotonic() - began, JointDecisions(game, policies)
    )


def _later(
    progress: Callable[[int, int], None] | None, done: int, pairs: int
) -> Callable[[int, int], None] | None:
    """Return a report of the stages of one pair, as a part of those of all pairs."""
    if progress is None:
        return None
    return lambda stage, total: progress(done * total + stage, pairs * total)


def _policy(solution: FeedbackSolution) -> Policy:
    """Return the policy of a solution of two agents."""
    assert isinstance(solution.policy, Policy)
    return solution.policy


def _kept(solution: FeedbackSolution) -> float:
    """Return the bytes of what a solution keeps."""
    stages = _policy(solution).stages
    return float(stages.fields.nbytes + stages.choice.nbytes)
