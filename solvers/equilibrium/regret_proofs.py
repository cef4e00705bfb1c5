"""Proofs that agents gain nothing, kept while the plans that they depend on do not change.

A proof is the cost of an agent and a lower bound on it over the agent's own plans.  It stays valid
while only those agents change their plans that the reachable sets show to be out of its way.
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan
from ppg_env.game.reachability import earliest_arrival
from solvers.engine.presolve import matters
from solvers.search_result import SearchResult


class RegretProofs:
    """Costs and lower bounds of all agents in the current profile.

    Attributes
    ----------
    costs : (N,) what each agent pays; infinite before its first response.
    bounds : (N,) proved lower bound on what it could pay; -inf if no proof is valid.
    """

    def __init__(self, game: Game, tolerance: float) -> None:
        self._game, self._tolerance = game, tolerance
        self.costs = np.full(len(game.agents), np.inf)
        self.bounds = np.full(len(game.agents), -np.inf)

    def holds(self, agent: int) -> bool:
        """Return whether a valid proof shows that ``agent`` gains at most the tolerance."""
        return bool(self.costs[agent] - self.bounds[agent] <= self._tolerance)

    def record(self, agent: int, cost: float, response: SearchResult) -> None:
        """Store what ``agent`` pays and the bound of its response."""
        self.costs[agent] = cost
        least = min(cost, response.value)
        self.bounds[agent] = proved_bound(self._game, agent, least, response)

    def discard(self, agent: int) -> None:
        """Discard the proof of ``agent``."""
        self.bounds[agent] = -np.inf

    def invalidate(self, j: int, before: Plan, after: Plan) -> None:
        """Discard the proofs of other agents that a change of agent ``j``'s plan may affect."""
        for e, encounter in enumerate(self._game.encounters):
            if j not in encounter.agents or len(encounter.agents) < 2:
                continue
            i = next(k for k in encounter.agents if k != j)
            if np.isfinite(self.bounds[i]) and any(
                matters(self._game, e, i, plan, self._latest(i)) for plan in (before, after)
            ):
                self.discard(i)

    def _latest(self, agent: int) -> int:
        """Return the latest arrival with which ``agent`` may gain: time alone costs more later."""
        lam = self._game.agents[agent].lam
        if lam <= 0:
            return self._game.horizon
        return int(min(self._game.horizon, np.floor(self.costs[agent] / lam + tol.LENGTH)))


def proved_bound(game: Game, agent: int, cost: float, response: SearchResult) -> float:
    """Return the bound of a best response, unless a plan of cost ``cost`` refutes it.

    A bound above the cost of a known plan is an error of the back end; the cost of the agent's
    time at top speed, without losses, then replaces it.
    """
    if response.bound <= cost + tol.AGREEMENT * max(1.0, abs(cost)):
        return response.bound
    fastest = earliest_arrival(game.agents[agent], game.horizon) or 0
    return game.agents[agent].lam * fastest
