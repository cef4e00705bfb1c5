"""What an agent can gain by another feedback policy, checked on a finer grid and simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ppg_env.env.episodes import evaluate, mean_interval
from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.game.game import Game
from ppg_env.support.statistics import Interval
from solvers.feedback.grid.dynamic_programming import MEMORY_LIMIT, best_feedback_response
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.player import FeedbackPlayer

FINER = 0.8
"""Step of the grid of deviations, as a part of the step of the solution."""


@dataclass(frozen=True)
class Deviation:
    """The best response of an agent to the others, and what it gains.

    Attributes
    ----------
    gain : mean decrease of the agent's cost over episodes with the same noise: a lower bound on its
        regret, with its interval.  It can be negative: then the agent's own policy is better.
    response : the policy.
    """

    gain: Interval
    response: FeedbackSolution


def feedback_deviation(
    game: Game,
    agent: int,
    players: Sequence[Player],
    rules: Rules | None = None,
    *,
    step: float | None = None,
    episodes: int = 16384,
    seed: int = 0,
    memory_limit: float = MEMORY_LIMIT,
    time_limit: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Deviation:
    """Return the best response of ``agent`` to the other one of ``players``, and its gain.

    Without a ``step``, and where the other is a player of a feedback solution, the grid is finer
    than that player's.  Other parameters are those of
    :func:`solvers.feedback_optimum`, :func:`ppg_env.env.evaluate`.
    """
    other = players[1 - agent]
    if step is None and isinstance(other, FeedbackPlayer):
        step = FINER * other.policy.model.step
    response = best_feedback_response(
        game, agent, players, rules, step=step, memory_limit=memory_limit, time_limit=time_limit,
        progress=progress,
    )  # fmt: skip
    deviating = list(players)
    deviating[agent] = response.player
    costs = [
        evaluate(game, team, episodes, seed, rules=rules).cost[:, agent]
        for team in (players, deviating)
    ]
    return Deviation(mean_interval(costs[0] - costs[1]), response)
