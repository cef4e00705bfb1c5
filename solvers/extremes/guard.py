r"""What a plan costs its agent at most, against all plans of a set of the other agent.

With R_t(a) >= a . r_j(t) for every plan of the set P_j, face p of the pair's collision set has at
least the clearance

    c_p(t) = a_p . r_i(t) - b_p - R_t(a_p)        (i is the first of the pair; else mirrored)

and the best face bounds the loss.  Where no face is sure to be clear, the loss is infinite.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env.game import objective
from ppg_env.game.game import Game
from ppg_env.game.margins import encounter_units, event_margins
from ppg_env.game.plan import Plan
from solvers.extremes.plan_set import PlanSet

PAIR = 0
"""Index of the encounter of the two agents."""


def directions_of(game: Game, agent: int) -> np.ndarray:
    """Return (F, d) directions in which ``agent`` reduces the clearance of each face."""
    return np.asarray(game.encounters[PAIR].collision.normals * (-1.0 if agent == 0 else 1.0))


@dataclass(frozen=True)
class Guard:
    """Agent ``agent`` against every plan of the other agent in a set.

    Attributes
    ----------
    game, agent : a game of two agents, and the one that deviates.
    nearest : (T_j, F) upper bounds on where the other is, along ``directions_of`` it.
    """

    game: Game
    agent: int
    nearest: np.ndarray

    @classmethod
    def against(
        cls, game: Game, others: PlanSet, share: float = 1.0, around: Plan | None = None
    ) -> Guard:
        """Return the guard against a set, or against a ``share`` of it ``around`` one plan.

        Only with the whole set do its values bound costs.
        """
        nearest = others.reach
        if around is not None:
            centre = around.means[: others.arrival, : game.dim] @ others.directions.T
            nearest = share * nearest + (1 - share) * centre
        mover = int(np.array_equal(others.directions, directions_of(game, 0)))
        return cls(game, mover, nearest)

    @cached_property
    def units(self) -> np.ndarray:
        """(H+1, F) lengths of one unit of margin."""
        return encounter_units(self.game, self.game.encounters[PAIR], (self.game.horizon,) * 2)

    def clearances(self, plan: Plan) -> np.ndarray:
        """Return (K, F) the least clearance of each face, while both are in traffic."""
        assert plan.arrival is not None
        count = min(plan.arrival, len(self.nearest))
        own = plan.means[:count, : self.game.dim] @ directions_of(self.game, self.agent).T
        offsets = self.game.encounters[PAIR].collision.offsets
        return np.asarray(-own - offsets - self.nearest[:count])

    def losses(self, plan: Plan) -> np.ndarray:
        """Return (K,) the largest loss of each event; infinite where bodies may overlap."""
        clear = self.clearances(plan)
        margins = event_margins(self.game, clear, self.units[: len(clear)])
        losses = objective.loss(self.game, np.maximum(margins, 0.0))
        return np.where(margins >= 0, losses, np.inf)

    def time_cost(self, plan: Plan) -> float:
        """Return what the arrival of a plan costs."""
        assert plan.arrival is not None
        return self.game.agents[self.agent].lam * plan.arrival

    def cost(self, plan: Plan) -> float:
        """Return the most that ``plan`` costs its agent."""
        care = 1 - self.game.agents[self.agent].lam
        return float(self.time_cost(plan) + care * self.losses(plan).sum())
