"""The outcome of dynamic programming on a grid, and the players that it makes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game

KINDS = ("optimum", "equilibrium", "response")


class Policies(Protocol):
    """What the players of a solution share."""

    def players(self) -> list[Player]:
        """Return one player per agent."""
        ...


@dataclass(frozen=True, eq=False)
class FeedbackSolution:
    """Feedback policies from a grid.

    The value is an estimate and never a bound; what counts is the cost of the policies in
    simulated episodes.

    Attributes
    ----------
    game, rules : what was solved.
    kind : ``optimum``, ``equilibrium`` or ``response``.
    agents : the agents that were solved for: both, or the one that responds.
    value : grid value at the start of each of ``agents``.
    step : distance between neighbouring positions of the grid.
    stages : number of stages that were computed.
    stationary : whether earlier stages are the same as the last one that was computed.
    without_equilibrium : share of joint grid states, over all stages, in whose stage game best
        responses cycle; a pair of small regret is played there.
    memory : bytes of the arrays that were in use at the same time, at most.
    seconds : duration.
    """

    game: Game
    rules: Rules
    kind: str
    agents: tuple[int, ...]
    value: tuple[float, ...]
    step: float
    stages: int
    stationary: bool
    without_equilibrium: float
    memory: int
    seconds: float
    policy: Policies

    def players(self) -> list[Player]:
        """Return one player per agent; the given player where another agent responds to it."""
        return self.policy.players()

    @property
    def player(self) -> Player:
        """The player of the agent that is solved for, if it is one."""
        require(len(self.agents) == 1, "player", "is not of one agent", "use players()")
        return self.players()[self.agents[0]]


@dataclass(frozen=True, eq=False)
class PairwiseSolution:
    """Policies of three and more agents from the solutions of all pairs.

    They are neither an optimum nor an equilibrium; what counts is their cost in simulated episodes.

    Attributes
    ----------
    game, rules : what is played.
    social : whether the sum of all costs counts, or each agent's own.
    pairs : the solution of the game of agents i < j, for each pair (i, j).
    seconds : duration of all solutions.
    """

    game: Game
    rules: Rules
    social: bool
    pairs: dict[tuple[int, int], FeedbackSolution]
    seconds: float
    policy: Policies

    def players(self) -> list[Player]:
        """Return one player per agent; they share their decisions."""
        return self.policy.players()
