r"""Best-response dynamics: one agent at a time plans anew until nobody gains.

With the exact potential Phi, every accepted update lowers Phi by at least
``tolerance / (1 - lam_i)``, so updates in turn end at an equilibrium; simultaneous updates may
cycle, which is detected.  Other rules of liability have other potentials, or none
(:mod:`solvers.liability`): right of way ends in turn all the same, and the rest may cycle.

Proofs are dear and early ones are soon out of date, so responses begin with little effort, and
more is spent once nobody gains by it.  A proof stays valid while only such plans change as the
reachable sets show to be out of the agent's way; it is then not made again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.agent import Agent
from ppg_env.game.evaluation import evaluate
from ppg_env.game.game import Game
from ppg_env.game.least_effort import straight_plan
from ppg_env.game.plan import Plan, Profile, make_profile
from ppg_env.support.frozen import frozen_array
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver
from solvers.engine.presolve import matters
from solvers.engine.refine import refine
from solvers.equilibrium.best_response import explain, respond
from solvers.equilibrium.certificate import proved_bound
from solvers.liability import Liability, make_rule
from solvers.search_result import SearchResult
from solvers.solution import ADVICE, Solution, Status, Update

STARTS = ("straight", "sequential")
FIRST_EFFORT, LAST_EFFORT = 1000, 100_000
"""Linear programs for one response: in the first sweeps, and at most before there is no limit."""

FEW = 5
"""Up to so many agents the first profile is straight flight."""

POLISH_AFTER = 3
"""Sweeps after which plans are polished in between: by then only details are left."""

ORDERS = ("cyclic", "random", "simultaneous")


def best_response_dynamics(
    game: Game,
    *,
    start: str | Profile | None = None,
    order: str | Sequence[int] = "cyclic",
    charge: str = "selfish",
    tolerance: float = tol.IMPROVEMENT,
    max_sweeps: int = 50,
    seed: int = 0,
    solver: str = ENGINE,
    time_limit: float | None = None,
    progress: Callable[[Update], None] | None = None,
) -> Solution:
    """A Nash equilibrium found by letting the agents respond to each other in turn.

    Parameters
    ----------
    start
        ``straight`` (everybody heads for its goal as if alone), ``sequential`` (each joins those
        before it in the order), or a profile; unless given, straight up to five agents and
        sequential beyond, where straight lines all cross at once, and with right of way, where
        nobody is to be held up by an agent that yields.
    order
        ``cyclic`` (the game's order, or that of priority), ``random`` (a new permutation each
        sweep, from ``seed``), ``simultaneous`` (all respond to the same profile), or a permutation
        of the agents.
    charge
        The rule of liability (:mod:`solvers.liability`): ``selfish``, ``partial:0.5``, ``pigou``,
        under which every update lowers the social cost, or ``right-of-way``.  Regret is about what
        agents pay.
    tolerance
        An agent keeps its plan unless it gains more than this.
    max_sweeps, time_limit
        PlannerOptions: rounds in which everybody moves once, and seconds.
    progress
        Called with every :class:`Update`.

    Returns
    -------
    Solution
        ``status`` is ``equilibrium``, ``cycle`` or ``limit``, or why an agent had no plan;
        ``regret`` is certified by the last responses' bounds; ``trace`` has every update.
    """
    check_order(game, order)
    rule, solver, budget = make_rule(game, charge), check_solver(solver), Budget(time_limit)
    starts = _default_starts(rule) if start is None else (start,)
    for first in starts:
        run = _Dynamics(rule, order, tolerance, solver, budget, seed, progress)
        solution = run.run(first, max_sweeps)
        if solution.status is not Status.INFEASIBLE:
            break
    return solution


def _default_starts(rule: Liability) -> tuple[str, ...]:
    """What to begin with, and what else if somebody finds no way through the straight lines."""
    crowd = len(rule.game.agents) > FEW or rule.priority is not None
    return ("sequential",) if crowd else STARTS


class _Dynamics:
    """State of one run: the profile, what is known of each agent's regret, and the trace."""

    def __init__(
        self,
        rule: Liability,
        order: str | Sequence[int],
        tolerance: float,
        solver: str,
        budget: Budget,
        seed: int,
        progress: Callable[[Update], None] | None,
    ) -> None:
        self.rule, self.game, self.order, self.tolerance = rule, rule.game, order, tolerance
        self.solver, self.budget, self.progress = solver, budget, progress
        self.random = np.random.default_rng(seed)
        self.trace: list[Update] = []
        self.costs = np.full(len(self.game.agents), np.inf)
        self.bounds = np.full(len(self.game.agents), -np.inf)

    def run(self, start: str | Profile, max_sweeps: int) -> Solution:
        profile, pending = _start(self.rule, start)
        seen = {profile}
        status = Status.NOT_CONVERGED
        effort: int | None = FIRST_EFFORT
        for sweep in range(1, max_sweeps + 1):
            before, self.changed = profile, False
            for agents in self._turns():
                found = {}
                for i in agents:
                    if i not in pending and self._proved(i):
                        continue
                    found[i] = self._respond(i, profile, effort)
                    if found[i].profile is None:
                        return self._failed(profile, pending, i, found[i])
                profile = self._adopt(sweep, profile, found, pending)
                pending -= set(agents)
            if not self.changed:
                if effort is None or all(self._proved(i) for i in range(len(profile))):
                    return self._settled(profile)
                effort = effort * 8 if effort < LAST_EFFORT else None
            elif profile in seen and profile != before:
                status = Status.CYCLE
                break
            elif sweep >= POLISH_AFTER and self.order != "simultaneous":
                profile = self._polished(profile)
            seen.add(profile)
            if self.budget.out:
                break
        return self._finished(profile, status)

    def _polished(self, profile: Profile) -> Profile:
        """Slow steps in one direction taken at once; they lower the potential as responses do."""
        falling = self.rule.potential
        if falling is None or not evaluate(self.game, profile).feasible:
            return profile
        after = refine(falling, profile, self.budget)
        for j, plan in enumerate(after):
            if plan is not profile[j] and plan != profile[j]:
                self.bounds[j] = -np.inf
                self._forget(j, profile[j], plan)
        return after

    def _respond(self, i: int, profile: Profile, effort: int | None) -> SearchResult:
        """A response to ``effort`` linear programs; more if it takes as many to find a plan."""
        while True:
            share = self.budget.child(effort)
            found = respond(self.rule, i, profile, self.solver, share)
            self.budget.charge(share)
            if found.status is not Status.NO_INCUMBENT or effort is None or self.budget.out:
                return found
            effort *= 8

    def _proved(self, i: int) -> bool:
        """Whether an answer that still holds says that agent i has nothing to gain."""
        return bool(self.costs[i] - self.bounds[i] <= self.tolerance)

    def _forget(self, j: int, before: Plan, after: Plan) -> None:
        """Drop the proofs that a change of j's plan may have made void."""
        for e, encounter in enumerate(self.game.encounters):
            if j not in encounter.agents or len(encounter.agents) < 2:
                continue
            i = next(k for k in encounter.agents if k != j)
            if np.isfinite(self.bounds[i]) and any(
                matters(self.game, e, i, plan, self._latest(i)) for plan in (before, after)
            ):
                self.bounds[i] = -np.inf

    def _latest(self, i: int) -> int:
        """The last arrival at which agent i might gain: time alone costs more from then on."""
        lam = self.game.agents[i].lam
        if lam <= 0:
            return self.game.horizon
        return int(min(self.game.horizon, np.floor(self.costs[i] / lam + tol.LENGTH)))

    def _turns(self) -> list[tuple[int, ...]]:
        """Who moves together, in turn: singletons, or everybody at once."""
        everybody = self.rule.priority or range(len(self.game.agents))
        if self.order == "simultaneous":
            return [tuple(everybody)]
        if self.order == "cyclic":
            return [(i,) for i in everybody]
        if self.order == "random":
            return [(int(i),) for i in self.random.permutation(len(everybody))]
        return [(int(i),) for i in self.order]

    def _adopt(
        self, sweep: int, profile: Profile, found: dict[int, SearchResult], pending: set[int]
    ) -> Profile:
        """Replace the plans of those who gain; note costs, bounds and potential."""
        if not found:
            return profile
        now = evaluate(self.game, profile, as_given=True)
        plans, costs = list(profile), dict[int, tuple[float, float]]()
        for i, answer in found.items():
            usable = i not in pending and not now.violations((i,))
            before = now.weighted(self.rule.costs[i]) if usable else float("inf")
            gains = before - answer.value > self.tolerance
            if gains:
                assert answer.profile is not None
                plans[i] = answer.profile[i]
                self.changed = True
            costs[i] = (before, answer.value if gains else before)
        after = tuple(plans)
        judged = evaluate(self.game, after, as_given=True)
        for i, answer in found.items():
            self.costs[i] = costs[i][1]
            self.bounds[i] = proved_bound(self.game, i, min(costs[i][1], answer.value), answer)
        for i in found:
            if plans[i] is not profile[i]:
                self._forget(i, profile[i], plans[i])
        whole = judged.feasible and not pending - set(found)
        falling = self.rule.potential
        potential = float("nan") if falling is None else judged.weighted(falling)
        potential = potential if whole else float("inf")
        for i, (cost_before, cost_after) in costs.items():
            self.trace.append(Update(sweep, i, cost_before, cost_after, potential))
            if self.progress is not None:
                self.progress(self.trace[-1])
        return after

    def _finished(self, profile: Profile, status: Status) -> Solution:
        evaluation = evaluate(self.game, profile)
        if not evaluation.feasible:  # simultaneous moves may collide
            return Solution(
                self.game,
                "nash",
                status,
                f"{ADVICE[status]}; {evaluation.violations()[0]}",
                trace=tuple(self.trace),
                seconds=self.budget.spent,
            )
        solution = Solution(
            self.game, "nash", status, ADVICE[status], profile, evaluation, trace=tuple(self.trace)
        )
        return replace(solution, seconds=self.budget.spent)

    def _settled(self, profile: Profile) -> Solution:
        """Nobody moved in the last sweep, so its bounds are about this very profile.

        It is called an equilibrium only if they prove it: responses that the time limit cut short
        may have missed a gain.
        """
        solution = self._finished(profile, Status.EQUILIBRIUM)
        if solution.evaluation is None:
            return solution
        costs = np.array([solution.evaluation.weighted(cost) for cost in self.rule.costs])
        regret = np.maximum(costs - self.bounds, 0.0)
        if regret.max() > tol.EQUILIBRIUM:
            solution = replace(
                solution, status=Status.NOT_CONVERGED, advice=ADVICE[Status.NOT_CONVERGED]
            )
        return replace(solution, regret=regret)

    def _failed(
        self, profile: Profile, pending: set[int], agent: int, found: SearchResult
    ) -> Solution:
        feasible = not pending and evaluate(self.game, profile).feasible
        if feasible and found.status is Status.NO_INCUMBENT:
            return self._finished(profile, Status.NOT_CONVERGED)
        status, advice = explain(self.game, found, (agent,))
        if status is Status.INFEASIBLE:
            advice = (
                f"{self.game.agent_names[agent]} has no plan free of overlap while the others keep "
                "theirs; start from another profile or order, or lengthen the horizon"
            )
        return Solution(
            self.game, "nash", status, advice, trace=tuple(self.trace), seconds=self.budget.spent
        )


def _start(rule: Liability, start: str | Profile) -> tuple[Profile, set[int]]:
    """The first profile, and the agents in it that have no plan yet and are out of the way."""
    game = rule.game
    if not isinstance(start, str):
        require(
            len(start) == len(game.agents),
            "start",
            "does not have one plan per agent",
            "give a full profile",
        )
        return make_profile(game, [plan.controls for plan in start]), set()
    require(start in STARTS, "start", f"is {start!r}", "write " + " or ".join(STARTS))
    plans: list[Plan] = []
    pending = set()
    for i, agent in enumerate(game.agents):
        plan = straight_plan(agent, game.horizon) if start == "straight" else None
        if plan is None:
            pending.add(i)
            plan = absent(agent, game.horizon)
        plans.append(plan)
    return tuple(plans), pending


def absent(agent: Agent, horizon: int) -> Plan:
    """A stand-in that is never in traffic, for an agent that has not planned yet."""
    means = np.tile(agent.start, (horizon + 1, 1))
    return Plan(frozen_array(np.zeros((horizon, agent.control_dim))), frozen_array(means), 0)


def check_order(game: Game, order: str | Sequence[int]) -> None:
    """Refuse an order that is neither a known word nor a permutation of the agents."""
    known = (
        order in ORDERS
        if isinstance(order, str)
        else (sorted(order) == list(range(len(game.agents))))
    )
    if not known:
        raise InputError(
            "order",
            f"is {order!r}",
            "write " + ", ".join(ORDERS) + " or a permutation of the agents",
        )
