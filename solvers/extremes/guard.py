r"""What a plan costs its agent at most, against all plans of the other agent near a given one.

With R_t(a) >= a . r_j(t) for all of those plans, face p of the pair's collision set has at least
the clearance

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
from solvers.engine.reachability_bounds import reach_of

PAIR = 0
"""Index of the encounter of the two agents."""


def directions_of(game: Game, agent: int) -> np.ndarray:
    """Return (F, d) directions in which ``agent`` reduces the clearance of each face."""
    return np.asarray(game.encounters[PAIR].collision.normals * (-1.0 if agent == 0 else 1.0))


def reach_along(game: Game, agent: int, arrival: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (T, F) the lowest and highest position along ``directions_of`` the agent."""
    rows = tuple(map(tuple, directions_of(game, agent).tolist()))
    return reach_of(game.agents[agent], rows, game.horizon).bounds(arrival, arrival)


def pair_units(game: Game) -> np.ndarray:
    """Return (H+1, F) lengths of one unit of margin."""
    return encounter_units(game, game.encounters[PAIR], (game.horizon,) * 2)


@dataclass(frozen=True)
class Guard:
    """Agent ``agent`` against plans of the other agent.

    Attributes
    ----------
    game, agent : a game of two agents, and the one that deviates.
    nearest : (T_j, F) upper bounds on where the other is, along ``directions_of`` it.
    """

    game: Game
    agent: int
    nearest: np.ndarray

    @classmethod
    def around(cls, game: Game, agent: int, other: Plan, arrival: int, share: float) -> Guard:
        """Return the guard against ``other``, and a ``share`` of what its agent can reach."""
        directions = directions_of(game, 1 - agent)
        centre = other.means[:arrival, : game.dim] @ directions.T
        _, high = reach_along(game, 1 - agent, arrival)
        return cls(game, agent, share * high + (1 - share) * centre)

    @classmethod
    def anywhere(cls, game: Game, agent: int, arrival: int) -> Guard:
        """Return the guard against all plans of the other agent with an arrival."""
        _, high = reach_along(game, 1 - agent, arrival)
        return cls(game, agent, high)

    @cached_property
    def units(self) -> np.ndarray:
        """(H+1, F) lengths of one unit of margin."""
        return pair_units(self.game)

    def losses(self, plan: Plan) -> np.ndarray:
        """Return (K,) the largest loss of each event; infinite where bodies may overlap."""
        assert plan.arrival is not None
        count = min(plan.arrival, len(self.nearest))
        own = plan.means[:count, : self.game.dim] @ directions_of(self.game, self.agent).T
        clear = -own - self.game.encounters[PAIR].collision.offsets - self.nearest[:count]
        margins = event_margins(self.game, clear, self.units[:count])
        losses = objective.loss(self.game, np.maximum(margins, 0.0))
        return np.where(margins >= 0, losses, np.inf)

    def cost(self, plan: Plan) -> float:
        """Return the most that ``plan`` costs its agent."""
        assert plan.arrival is not None
        agent = self.game.agents[self.agent]
        return float(agent.lam * plan.arrival + (1 - agent.lam) * self.losses(plan).sum())
