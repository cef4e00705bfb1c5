r"""The least losses m_S(a) among a set S of agents that all arrive by times a.

One program bounds them for all arrivals up to a.  Its agents arrive exactly at a, and each pair
counts until the earliest possible arrival of either: an agent that can wait at its goal may as well
arrive there early.  So values fall as a rises.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.input_sets import pieces
from ppg_env.game.objective import Objective
from ppg_env.game.reserve import planned_controls
from solvers.budget import Budget
from solvers.engine.cuts import bound_of_losses, losses_alone
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.engine.symmetry import Symmetry

NODES = 600
"""Linear programs for one value."""

EFFORT = 3000
"""Linear programs for all values if no time limit ends the search."""

MOST = 2.0
"""Values are not raised above this, in the mean cost of a time step."""


class CoreValues:
    """Lower bounds on losses, computed once for all sets that symmetries map to each other.

    Attributes
    ----------
    possible : whether the bounds hold: agents leave at their goals and could wait there.
    step : mean cost of a time step.
    """

    def __init__(
        self,
        objective: Objective,
        symmetries: Sequence[Symmetry],
        first: Sequence[int],
        budget: Budget,
    ) -> None:
        game, self.step = objective.game, float(np.mean(objective.time))
        self._subproblem = losses_alone(Subproblem(objective, tuple(range(len(first))), {}))
        self._symmetries, self._first = symmetries, first
        self.budget = budget.child(EFFORT if budget.limit is None else None)
        self._pairs = {e.agents: k for k, e in enumerate(game.encounters) if e.obstacle is None}
        self._values: dict[tuple[tuple[int, int], ...], float] = {}
        self.possible = game.on_goal == "remove" and all(
            _can_wait(agent, game.horizon) for agent in game.agents
        )

    def encounters(self, group: Iterable[int]) -> list[int]:
        """Return the encounters of every two agents of a group."""
        return [self._pairs[pair] for pair in combinations(sorted(group), 2)]

    def value(self, latest: Mapping[int, int]) -> float:
        """Return a lower bound on the weighted losses of agents that arrive by ``latest``."""
        images = (sorted((s.agents[i], t) for i, t in latest.items()) for s in self._symmetries)
        key = min(tuple(image) for image in images)
        if key not in self._values:
            self._values[key] = self._solved(dict(key))
        return self._values[key]

    def _solved(self, latest: Mapping[int, int]) -> float:
        counted = {i: self._first[i] for i in latest}
        part, most = self.encounters(latest), MOST * self.step
        presolved = presolve_encounters(self._subproblem, part, latest, counted)
        if presolved is None:
            return most
        child = self.budget.child(NODES)
        value = bound_of_losses(self._subproblem, latest, presolved, most, child)
        self.budget.charge(child)
        return min(value, most)


def _can_wait(agent: Agent, horizon: int) -> bool:
    """Return whether an agent can stay where it is without a control, as at its goal."""
    if agent.goal.size < agent.state_dim or not np.array_equal(agent.A, np.eye(agent.state_dim)):
        return False
    sets = pieces(planned_controls(agent, horizon))
    return all(bool((control.offsets >= 0).all()) for _, control in sets)
