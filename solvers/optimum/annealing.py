r"""Joint plans of many agents: annealing by taking two out and putting them back.

Best responses in turn lower the objective as far as one agent at a time can.  Then, again and
again, two agents that pass each other leave the game and come back one by one, each with its best
response to those who are there.  What costs v more is taken with probability exp(-v / heat), and
the heat falls from the price of one step of an agent's time to nothing: arrivals are whole steps,
so that there are few small ways down.  At last pairs are planned jointly.  All this finds plans
and proves nothing: the proof comes from :mod:`solvers.optimum.pair_bound`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import evaluate
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import earliest_arrival
from solvers.budget import Budget
from solvers.dispatch import minimise
from solvers.engine.fixed_arrival_lp import INF
from solvers.engine.refine import refine
from solvers.equilibrium.best_response import respond
from solvers.equilibrium.best_response_dynamics import absent, best_response_dynamics
from solvers.liability import Liability

SWEEPS = 6
"""Most rounds of responses before groups begin."""

CYCLES = 3
"""Times that the best profile is heated: where a cycle ends is a matter of luck."""

COOLING = 20
"""Rounds per agent over which the heat falls to nothing, sooner if a limit comes first."""

QUIET = 5
"""Rounds per agent without heat, after pairs were planned jointly."""

NEAR = 1.0
"""Length unit: an agent that passes at this distance is half as likely to be drawn as one at 0."""

EFFORTS = {1: 400, 2: 1500}
"""Linear programs for one agent's response, and for a pair's joint plan."""


def descent(
    rule: Liability,
    solver: str,
    budget: Budget,
    seed: int = 0,
    progress: Callable[[float], None] = lambda value: None,
) -> Profile | None:
    """Return a profile of low potential under ``rule``, which has one; None if none was found.

    ``progress`` is called with the value of every improvement.
    """
    search = _Descent(rule, solver, budget, seed, progress)
    if not search.start():
        return None
    search.run()
    return search.profile


class _Descent:
    """The best profile so far, and the ways to a better one."""

    def __init__(
        self,
        rule: Liability,
        solver: str,
        budget: Budget,
        seed: int,
        progress: Callable[[float], None],
    ) -> None:
        self.rule, self.game, self.solver, self.budget = rule, rule.game, solver, budget
        self.progress, self.random = progress, np.random.default_rng(seed)
        assert rule.potential is not None
        self.objective = rule.potential
        self.profile: Profile = ()
        self.value = INF

    def start(self) -> bool:
        """Whether best responses found a feasible profile.

        Selfish ones come first, so that nothing is returned that is dearer than an equilibrium.
        """
        for charge in dict.fromkeys(("selfish", self.rule.charge)):
            found = best_response_dynamics(
                self.game,
                start=self.profile or None,
                charge=charge,
                max_sweeps=SWEEPS,
                solver=self.solver,
                time_limit=self.budget.left,
            )
            if found.profile is not None:
                self._keep(found.profile, self._worth(found.profile))
        return bool(self.profile)

    def run(self) -> None:
        """Search until nothing helps, or the time is up."""
        size = len(self.game.agents)
        for _ in range(CYCLES):
            self._anneal(COOLING * size, float(np.mean(self.objective.time)))
        while any(self._planned(pair) for pair in self._pairs()):
            self._anneal(QUIET * size, 0.0)

    def _anneal(self, rounds: int, heat: float) -> None:
        """So many rounds from the best profile on, while ``heat`` falls to nothing."""
        profile, value = self.profile, self.value
        for k in range(rounds):
            if self.budget.out:
                return
            tried = self._repaired(profile, self._neighbours(profile))
            worth = INF if tried is None else self._worth(tried)
            left = heat * (1 - max(k / rounds, self.budget.fraction_used))
            if tried is not None and worth <= value + left * self.random.exponential():
                profile, value = tried, worth
                if self._keep(tried, worth):
                    profile, value = self.profile, self.value

    def _worth(self, profile: Profile) -> float:
        """What a profile costs; infinite if it is not feasible."""
        judged = evaluate(self.game, profile)
        return INF if judged.violations() else judged.weighted(self.objective)

    def _keep(self, profile: Profile, worth: float) -> bool:
        """Take a profile, polished, if what it is worth is less than the best."""
        if worth > self.value - tol.IMPROVEMENT:
            return False
        self.profile = refine(self.objective, profile, self.budget)
        self.value = self._worth(self.profile)
        self.progress(self.value)
        return True

    def _neighbours(self, profile: Profile) -> list[int]:
        """An agent drawn at random and another one, likelier the nearer they pass."""
        size = len(self.game.agents)
        first = int(self.random.integers(size))
        others = [j for j in range(size) if j != first]
        means = np.array([plan.means[:, : self.game.dim] for plan in profile])
        far = np.linalg.norm(means[others] - means[first], axis=2).min(axis=1)
        chances = 1 / (NEAR + far)
        other = int(self.random.choice(others, p=chances / chances.sum()))
        return [int(i) for i in self.random.permutation([first, other])]

    def _repaired(self, profile: Profile, group: list[int]) -> Profile | None:
        """The profile with the group planned anew, one after the other, twice."""
        plans = list(profile)
        for i in group:
            plans[i] = absent(self.game.agents[i], self.game.horizon)
        for i in group + group:
            share = self.budget.child(EFFORTS[1])
            found = respond(self.rule, i, tuple(plans), self.solver, share)
            self.budget.charge(share)
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
        if self.budget.out:
            return False
        share = self.budget.child(EFFORTS[2])
        found = minimise(self.objective, pair, self.profile, self.solver, share)
        self.budget.charge(share)
        return found.profile is not None and self._keep(found.profile, self._worth(found.profile))
