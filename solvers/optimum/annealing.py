r"""Joint plans of many agents: annealing that removes two agents and inserts them again.

Best responses in turn lower the objective as far as single agents can.  Then, repeatedly, two
agents that pass each other leave the game and return one after the other, each with its best
response to the agents that are present.  An increase of v is accepted with probability
exp(-v / heat), and the heat falls from the cost of one time step of an agent to zero: arrivals are
whole steps, so that there are few small steps down.  Finally pairs are planned jointly.  The
result has no proof; bounds come from :mod:`solvers.optimum.pair_bound`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import earliest_arrival
from solvers.budget import Budget
from solvers.dispatch import minimise
from solvers.engine.refine import refine
from solvers.equilibrium.best_response import respond
from solvers.equilibrium.best_response_dynamics import run_dynamics
from solvers.equilibrium.dynamics_run import Purpose
from solvers.equilibrium.start_profile import absent_plan
from solvers.liability import Liability, make_rule
from solvers.pricing import PricedProfile, price_profile
from solvers.solution import Solution, Status

SWEEPS = 6
"""Largest number of sweeps of best responses before annealing."""

START_SHARE = 0.7
"""Part of the time limit that the first plans may take."""

CYCLES = 3
"""Number of times that the best profile is heated: single cycles end in local minima."""

COOLING = 20
"""Rounds per agent over which the heat falls to zero, sooner if a limit comes first."""

UNPROVED = Purpose(thorough=False)
"""Best responses whose proof is not needed."""

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
    on_progress: Callable[[float], None] = lambda value: None,
    on_start: Callable[[], None] = lambda: None,
    known: PricedProfile | None = None,
) -> PricedProfile | None:
    """Return a profile of low potential under ``rule``, which must have a potential.

    The result is None if no profile was found.  ``on_progress`` is called with the value of every
    improvement, ``on_start`` between the first plans and the search for better ones, which begins
    with plans that are ``known`` if they cost less.
    """
    search = _Descent(rule, solver, budget, seed, on_progress)
    search.start()
    on_start()
    search.accept(known)
    if search.best is not None:
        search.run()
    return search.best


class _Descent:
    """The best profile so far, and the moves that may improve it."""

    def __init__(
        self,
        rule: Liability,
        solver: str,
        budget: Budget,
        seed: int,
        on_progress: Callable[[float], None],
    ) -> None:
        self.rule, self.game, self.solver, self.budget = rule, rule.game, solver, budget
        self.on_progress, self.random = on_progress, np.random.default_rng(seed)
        assert rule.potential is not None
        self.objective = rule.potential
        self.best: PricedProfile | None = None

    @property
    def incumbent(self) -> PricedProfile:
        """The best profile, once there is one."""
        assert self.best is not None
        return self.best

    def start(self) -> None:
        """Find a first profile by best responses.

        Selfish responses come first: if they converge within their share of the limits, no result
        costs more than their equilibrium.  Where they have not converged, they go on after the
        others, and the result may cost more than an equilibrium.
        """
        rules = [self.rule]
        if self.rule.charge != "selfish":
            rules.insert(0, make_rule(self.game, "selfish"))
        limit = None if self.budget.left is None else START_SHARE * self.budget.left
        share, runs = Budget(limit), list[Solution]()
        for rule in rules:
            runs.append(self._respond_in_turn(rule, share, max_sweeps=SWEEPS))
        first = runs[0]
        if first.profile is not None and first.status is not Status.EQUILIBRIUM:
            self._respond_in_turn(rules[0], share, start=first.profile, purpose=UNPROVED)

    def _respond_in_turn(self, rule: Liability, share: Budget, **options: Any) -> Solution:
        """Accept the plans of best responses, by default from the best profile so far."""
        options = {"start": None if self.best is None else self.best.profile} | options
        solution = run_dynamics(rule, self.solver, Budget(share.left), **options)
        if solution.profile is not None:
            self.accept(price_profile(self.objective, solution.profile))
        return solution

    def run(self) -> None:
        """Search until no move helps or the budget is used up."""
        size = len(self.game.agents)
        for _ in range(CYCLES):
            self._anneal(COOLING * size, float(np.mean(self.objective.time)))
        while any(self._plan_jointly(pair) for pair in self._pairs()):
            self._anneal(QUIET * size, 0.0)

    def _anneal(self, rounds: int, heat: float) -> None:
        """Move ``rounds`` times from the best profile on, while ``heat`` falls to zero."""
        current = self.incumbent
        for k in range(rounds):
            if self.budget.out:
                return
            pair = self._draw_neighbours(current.profile)
            profile = self._reinserted(current.profile, pair)
            if profile is None:
                continue
            left = heat * (1 - max(k / rounds, self.budget.fraction_used))
            limit = current.value + left * self.random.exponential()
            moved = price_profile(self.objective, profile)
            if moved is not None and moved.value <= limit:
                current = self.incumbent if self.accept(moved) else moved

    def accept(self, candidate: PricedProfile | None) -> bool:
        """Refine a profile and make it the incumbent if it costs less; return whether it does."""
        if candidate is None:
            return False
        if self.best is not None and candidate.value > self.best.value - tol.IMPROVEMENT:
            return False
        refined = refine(self.objective, candidate.profile, self.budget)
        self.best = price_profile(self.objective, refined) or candidate
        self.on_progress(self.best.value)
        return True

    def _draw_neighbours(self, profile: Profile) -> list[int]:
        """Draw an agent, and another with a probability that falls with its distance."""
        size = len(self.game.agents)
        first = int(self.random.integers(size))
        others = [j for j in range(size) if j != first]
        means = np.array([plan.means[:, : self.game.dim] for plan in profile])
        distances = np.linalg.norm(means[others] - means[first], axis=2).min(axis=1)
        weights = 1 / (NEAR + distances)
        other = int(self.random.choice(others, p=weights / weights.sum()))
        return [int(i) for i in self.random.permutation([first, other])]

    def _reinserted(self, profile: Profile, group: list[int]) -> Profile | None:
        """Remove a group and insert its best responses one after the other, twice."""
        plans = list(profile)
        for i in group:
            plans[i] = absent_plan(self.game, i)
        for i in group + group:
            child = self.budget.child(EFFORTS[1])
            response = respond(self.rule, i, tuple(plans), self.solver, child)
            self.budget.charge(child)
            if response.profile is None:
                return None
            plans[i] = response.profile[i]
        return tuple(plans)

    def _pairs(self) -> list[tuple[int, int]]:
        """Return all pairs, those first that pay most beyond the time of their shortest flights."""
        paid = self.incumbent.evaluation.shifted_cost
        agents, horizon = self.game.agents, self.game.horizon
        extra = paid - [agent.lam * (earliest_arrival(agent, horizon) or 0) for agent in agents]
        pairs = combinations(range(len(agents)), 2)
        return sorted(pairs, key=lambda pair: -(extra[pair[0]] + extra[pair[1]]))

    def _plan_jointly(self, pair: tuple[int, int]) -> bool:
        """Plan a pair jointly and accept the plan if it costs less; return whether it does."""
        if self.budget.out:
            return False
        child = self.budget.child(EFFORTS[2])
        profile = self.incumbent.profile
        joint = minimise(self.objective, pair, profile, self.solver, child)
        self.budget.charge(child)
        if joint.profile is None:
            return False
        return self.accept(price_profile(self.objective, joint.profile))
