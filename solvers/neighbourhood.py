r"""Joint plans of many agents: descent by taking a few out and putting them back.

Best responses in turn lower the objective as far as one agent at a time can.  Then, again and
again, two to four agents that pass each other leave the game and come back one by one, each with
its best response to those who are there; what is cheaper stays.  At last pairs are planned
jointly.  All this finds plans and proves nothing: the proof comes from :mod:`solvers.bounds`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from ppg_env import objective
from ppg_env import tolerances as tol
from ppg_env.dynamics import earliest_arrival
from ppg_env.evaluate import evaluate
from ppg_env.game import Game
from ppg_env.plan import Profile
from solvers.clock import Clock
from solvers.dynamics import absent, best_response_dynamics
from solvers.minimise import minimise
from solvers.polish import polish
from solvers.response import respond

FALLING = {"selfish": objective.potential, "pigou": objective.social}
"""What falls with every best response, by who pays."""

SWEEPS = 6
"""Most rounds of responses before groups begin."""

GROUPS = (2, 3, 4)
"""How many agents leave together."""

QUIET = 10
"""Rounds per agent without a gain after which the search is over."""

EFFORTS = {1: 400, 2: 1500}
"""Linear programs for one agent's response, and for a pair's joint plan."""


def descent(
    game: Game,
    charge: str,
    solver: str,
    clock: Clock,
    seed: int = 0,
    progress: Callable[[float], None] = lambda value: None,
) -> Profile | None:
    """A profile of low social cost (``pigou``) or potential (``selfish``); None if there is none.

    ``progress`` is called with the value of every better one.
    """
    search = _Descent(game, charge, solver, clock, seed, progress)
    if not search.start():
        return None
    search.run()
    return search.profile


class _Descent:
    """The best profile so far, and the ways to a better one."""

    def __init__(
        self,
        game: Game,
        charge: str,
        solver: str,
        clock: Clock,
        seed: int,
        progress: Callable[[float], None],
    ) -> None:
        self.game, self.charge, self.solver, self.clock = game, charge, solver, clock
        self.progress, self.random = progress, np.random.default_rng(seed)
        self.weights = FALLING[charge](game)
        self.profile: Profile = ()
        self.value = float("inf")

    def start(self) -> bool:
        """Whether best responses found a feasible profile."""
        alone = best_response_dynamics(
            self.game,
            charge=self.charge,
            max_sweeps=SWEEPS,
            solver=self.solver,
            time_limit=self.clock.left,
        )
        return alone.profile is not None and self._keep(alone.profile)

    def run(self) -> None:
        """Descend until nothing helps, or the time is up."""
        size = len(self.game.agents)
        while not self.clock.out:
            quiet = 0
            while quiet < QUIET * size and not self.clock.out:
                tried = self._repaired(self._neighbours())
                quiet = 0 if tried is not None and self._keep(tried) else quiet + 1
            if not any(self._planned(pair) for pair in self._pairs()):
                break

    def _keep(self, profile: Profile) -> bool:
        """Take a profile, polished, if it is feasible and no dearer; whether it is cheaper.

        Steps aside that cost nothing lead out of many dead ends.
        """
        judged = evaluate(self.game, profile)
        value = float("inf") if judged.complaints() else judged.weighted(self.weights)
        if value > self.value - tol.IMPROVEMENT:
            if value <= self.value:
                self.profile, self.value = profile, value
            return False
        self.profile = polish(self.game, profile, self.weights, self.clock)
        self.value = evaluate(self.game, self.profile).weighted(self.weights)
        self.progress(self.value)
        return True

    def _neighbours(self) -> list[int]:
        """An agent drawn at random and a few others, likelier the nearer they pass."""
        size = len(self.game.agents)
        first = int(self.random.integers(size))
        others = [j for j in range(size) if j != first]
        means = np.array([plan.means[:, : self.game.dim] for plan in self.profile])
        far = np.linalg.norm(means[others] - means[first], axis=2).min(axis=1)
        scale = np.median(far) or 1.0
        chances = 1 / (scale + far)
        count = min(int(self.random.choice(GROUPS)) - 1, len(others))
        drawn = self.random.choice(others, size=count, replace=False, p=chances / chances.sum())
        return [int(i) for i in self.random.permutation([first, *drawn])]

    def _repaired(self, group: list[int]) -> Profile | None:
        """The profile with the group planned anew, one after the other, twice."""
        plans = list(self.profile)
        for i in group:
            plans[i] = absent(self.game.agents[i], self.game.horizon)
        for i in group + group:
            share = self.clock.share(EFFORTS[1])
            found = respond(self.game, i, tuple(plans), self.charge, self.solver, share)
            self.clock.take(share)
            if found.profile is None:
                return None
            plans[i] = found.profile[i]
        return tuple(plans)

    def _pairs(self) -> list[tuple[int, int]]:
        """Pairs, those first that pay most beyond the time of flying alone."""
        paid = evaluate(self.game, self.profile).shifted_cost
        agents, horizon = self.game.agents, self.game.horizon
        extra = paid - [agent.lam * (earliest_arrival(agent, horizon) or 0) for agent in agents]
        pairs = combinations(range(len(agents)), 2)
        return sorted(pairs, key=lambda pair: -(extra[pair[0]] + extra[pair[1]]))

    def _planned(self, pair: tuple[int, int]) -> bool:
        """Whether a joint plan of two is cheaper; it is then taken."""
        if self.clock.out:
            return False
        share = self.clock.share(EFFORTS[2])
        found = minimise(self.game, pair, self.weights, self.profile, self.solver, share)
        self.clock.take(share)
        return found.profile is not None and self._keep(found.profile)
