"""What every planner returns: a feasible profile, or the reason why there is none."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile


class Status(StrEnum):
    """The way a planner ended; :data:`ADVICE` has a remedy for each."""

    OPTIMAL = "optimal"
    EQUILIBRIUM = "equilibrium"
    FEASIBLE = "feasible"
    CYCLE = "cycle"
    NOT_CONVERGED = "limit"
    INFEASIBLE = "infeasible"
    UNREACHABLE = "unreachable"
    NO_INCUMBENT = "time_limit"
    ERROR = "error"


ADVICE = {
    Status.OPTIMAL: "proved optimal",
    Status.EQUILIBRIUM: "no agent gains by a deviation",
    Status.FEASIBLE: "the time limit ended the search with a feasible plan; raise the time limit, "
    "or shorten the horizon, to close the gap",
    Status.CYCLE: "the updates repeat; update one agent at a time",
    Status.NOT_CONVERGED: "the limit on rounds or time came before the equilibrium; raise it, or "
    "start from another profile",
    Status.INFEASIBLE: "no plan avoids every overlap of means {when}; lengthen the horizon, move a "
    "start, or make the bodies smaller",
    Status.UNREACHABLE: "a goal is out of reach; lengthen the horizon, or raise the speed",
    Status.NO_INCUMBENT: "the time limit (or that on nodes) came before the first plan; "
    "raise it, or cut the horizon",
    Status.ERROR: "the back end failed; try another solver",
}
"""``{when}`` stands for the times at which bodies must keep apart in the game."""


@dataclass(frozen=True)
class Update:
    """One update of best-response dynamics.

    Attributes
    ----------
    sweep : number of the sweep, from 1.
    agent : the agent that responded.
    before, after : what it pays (its shifted cost, if selfish) with the old and the new plan.
    potential : Phi of the liability rule after the update; infinite while means overlap or agents
        lack a plan, NaN if the rule has no potential.
    """

    sweep: int
    agent: int
    before: float
    after: float
    potential: float


@dataclass(frozen=True)
class Solution:
    """A planner's result.

    Attributes
    ----------
    game, name : the game, and the solution concept (``nash``, ``potential``, ``social``, ...).
    status, advice : how the planner ended, and a sentence for the user.
    profile, evaluation : the plans and their evaluation; None without a plan.
    minimised : name of the minimised quantity, e.g. ``social_cost``; None for dynamics.
    value : its value at the profile, by the evaluator.
    bound : proved lower bound on it over all profiles, -inf if none was proved.
    regret : (N,) certified upper bounds on each agent's gain by a deviation; None if not computed.
    trace : the updates of best-response dynamics.
    seconds : wall time.
    """

    game: Game
    name: str
    status: Status
    advice: str
    profile: Profile | None = None
    evaluation: Evaluation | None = None
    minimised: str | None = None
    value: float = float("inf")
    bound: float = float("-inf")
    regret: np.ndarray | None = None
    trace: tuple[Update, ...] = field(default=())
    seconds: float = 0.0

    @property
    def gap(self) -> float:
        """Relative distance of ``value`` from ``bound``; infinite without a bound."""
        if not np.isfinite([self.value, self.bound]).all():
            return float("inf")
        return max(self.value - self.bound, 0.0) / max(abs(self.value), 1e-9)
