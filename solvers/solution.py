"""What every planner returns: a plan that the evaluator accepted, or the reason there is none."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile


class Status(StrEnum):
    """How a planner ended; :data:`ADVICE` says what to do about it."""

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
    Status.EQUILIBRIUM: "nobody can gain by changing alone",
    Status.FEASIBLE: "the time limit ended the search with a plan in hand; raise the time limit, "
    "or shorten the horizon, to close the gap",
    Status.CYCLE: "the updates repeat themselves; update one agent at a time",
    Status.NOT_CONVERGED: "the limit on rounds or time came before the equilibrium; raise it, or "
    "start from another profile",
    Status.INFEASIBLE: "no plan avoids every overlap of means; lengthen the horizon, move a start, "
    "or make the bodies smaller",
    Status.UNREACHABLE: "a goal is out of reach; lengthen the horizon, or raise the speed",
    Status.NO_INCUMBENT: "the time limit (or that on nodes) came before the first plan; "
    "raise it, or cut the horizon",
    Status.ERROR: "the back end failed; try another solver",
}


@dataclass(frozen=True)
class Update:
    """One step of best-response dynamics.

    Attributes
    ----------
    sweep : count of rounds, from 1.
    agent : who moved.
    before, after : what it pays, its shifted cost if selfish, with the old and the new plan.
    potential : Phi of the rule of liability after the step; infinite while some means still
        overlap or lack a plan, NaN if the rule has no potential.
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
    game, name : what was solved, and for what (``nash``, ``potential``, ``social``, ...).
    status, advice : how it ended, in a word and in a sentence.
    profile, evaluation : the plans and the evaluator's judgement; None without a plan.
    minimised : the quantity that was minimised, e.g. ``social_cost``; None for dynamics.
    value : its value at the profile, by the evaluator.
    bound : proved lower bound on it over all profiles, -inf if none was proved.
    regret : (N,) certified upper bounds on what each agent could gain alone; None if not asked.
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
