"""The outcome of dynamic programming on a grid, and the players that it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.moves import stencils
from solvers.feedback.grid.player import FeedbackPlayer, Policy
from solvers.feedback.grid.state_grid import padded

KINDS = ("optimum", "equilibrium", "response")


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
    policy: Policy

    def players(self) -> list[Player]:
        """Return one player per agent; the given player where another agent responds to it."""
        if self.policy.partner is None:
            return [FeedbackPlayer(self.policy, i) for i in range(len(self.game.agents))]
        players: list[Player] = [self.policy.partner] * 2
        players[self.agents[0]] = self.player
        return players

    @property
    def player(self) -> FeedbackPlayer:
        """The player of the agent that responds."""
        require(self.kind == "response", "player", "is not of one agent", "use players()")
        return FeedbackPlayer(self.policy, self.agents[0])


def value_at_start(model: JointModel, values: np.ndarray) -> float:
    """Return the interpolant of ``values`` (K0, K1) at the starts."""
    result = values
    for i in (1, 0):
        start = padded(model.game.agents[i].start[None])
        index, weight = stencils(model.grids[i], start)
        result = result[..., index[0]] @ weight[0]
    return float(result)
