r"""The exact engine: search over arrival vectors, and over faces where they matter.

With the arrivals T of all movers fixed, time costs are known and the reachable sets are tight, so
a small program remains (:mod:`solvers.engine.fixed_arrival_lp`).  Vectors are taken in the order
of a lower bound (:mod:`solvers.engine.arrival_queue`),

    L(T) = sum_i tau_i T_i + sum_e omega_e (least loss that the reachable sets allow),

which is replaced by the value of the linear relaxation, cuts included, once a vector comes up.
The search ends when the next bound reaches the incumbent.  Each remaining vector is searched by
branch and bound (:mod:`solvers.engine.branch_and_bound`).  The smallest of all bounds is proved
whenever the search stops, since unfinished vectors count with their bounds.

Of vectors that a symmetry of the game maps to each other, one is searched.

A search that has no plan after some linear programs looks for ways of all movers
(:mod:`solvers.engine.joint_plans`), and one that has become long asks its caller for plans.

Where bodies keep apart between steps, plans that the search finds are improved by one mover after
the other while the rest keep theirs: these searches are small, and a cheaper incumbent prunes more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.engine.arrival_queue import ArrivalQueue
from solvers.engine.branch_and_bound import BranchAndBound
from solvers.engine.confinement import arrives_at, counted_steps, is_confined, is_crowded
from solvers.engine.cuts import CutPool, CutsAtArrivals
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.joint_plans import find_joint_plans
from solvers.engine.presolve import Subproblem
from solvers.engine.symmetry import Symmetry, identity, symmetries
from solvers.engine.way_finding import find_first_plans
from solvers.pricing import PricedProfile, price
from solvers.search_result import Claims, SearchResult, conclude
from solvers.solution import Status

FIRST_LOOK = 300
"""Linear programs for a single mover among walls before a way through cells is looked for."""

WAYS_AFTER = 500
"""Linear programs without a plan before ways of all movers are looked for."""

ADVICE_AFTER = 3000
"""Linear programs before a search that goes on asks its caller for plans."""

DESCENT_AFTER = 3000
"""Linear programs before the first descent, in which one mover after the other improves the
incumbent; further ones follow after twice as many each time."""

DESCENT_EFFORT = 400
"""Linear programs for one mover in a descent."""

FAILED = "a linear program could not be solved"

MOST_LOADED = 200
"""Searches that keep their linear programs; the others rebuild them when they continue."""


def engine_search(
    objective: Objective,
    movers: Sequence[int],
    given: Profile | None,
    budget: Budget,
    on_progress: Callable[[str, float], None] = lambda what, value: None,
    advise: Callable[[], Profile | None] = lambda: None,
) -> SearchResult:
    """Return the cheapest plans of ``movers`` and a proved bound; other agents keep ``given``.

    If ``given`` has feasible plans of the movers too, they are the first incumbent.
    ``on_progress`` is called with every better ``value`` and ``bound``.  ``advise`` is called once
    the search has become long, and returns plans of all agents, or None.
    """
    others = {i: plan for i, plan in enumerate(given or ()) if i not in movers}
    subproblem = Subproblem(objective, tuple(movers), others)
    first = {i: earliest_way(objective.game, i) for i in movers}
    if any(start is None for start in first.values()):
        return SearchResult(Status.UNREACHABLE, inf)
    incumbent = None
    if given is not None:
        incumbent = price(objective, {i: given[i].controls for i in movers}, others)
    crowded = is_crowded(subproblem)
    if incumbent is None and crowded:
        incumbent = find_joint_plans(subproblem, budget)
    if incumbent is not None:
        on_progress("value", incumbent.value)
    earliest = {i: int(t or 0) for i, t in first.items()}
    if crowded:
        earliest = counted_steps(subproblem, earliest, incumbent)
    if is_confined(subproblem) and any(earliest.values()) and not arrives_at(incumbent, earliest):
        child = budget.child(0 if crowded else FIRST_LOOK)
        look = _ArrivalSearch(subproblem, incumbent, child, on_progress)
        result = look.run(earliest)
        budget.charge(child)
        incumbent = look.incumbent
        if result.status in (Status.OPTIMAL, Status.INFEASIBLE) or budget.out:
            return result
        if incumbent is None or crowded:
            (mover,) = movers
            ways = find_first_plans(subproblem, earliest[mover], budget)
            if ways.earliest is None:
                return SearchResult(Status.INFEASIBLE, inf)
            earliest[mover], plans = ways.earliest, ways.plans
            if incumbent is None and plans is None and not crowded and not budget.out:
                plans = find_joint_plans(subproblem, budget)
            if plans is not None and (incumbent is None or plans.value < incumbent.value):
                incumbent = plans
                on_progress("value", incumbent.value)
        earliest = counted_steps(subproblem, earliest, incumbent)
    search = _ArrivalSearch(subproblem, incumbent, budget, on_progress, advise)
    return search.run(earliest)


class _ArrivalSearch:
    """One search: the incumbent, the cuts, and the symmetries."""

    def __init__(
        self,
        subproblem: Subproblem,
        incumbent: PricedProfile | None,
        budget: Budget,
        on_progress: Callable[[str, float], None],
        advise: Callable[[], Profile | None] = lambda: None,
    ) -> None:
        self._subproblem, self.incumbent = subproblem, incumbent
        self._budget, self._on_progress, self._advise = budget, on_progress, advise
        all_move = set(subproblem.movers) == set(range(len(subproblem.game.agents)))
        self._symmetries: list[Symmetry] = (
            symmetries(subproblem.objective) if all_move else [identity(subproblem.game)]
        )
        self._cuts = CutPool(subproblem, self._symmetries, budget)
        self._loaded: dict[int, BranchAndBound] = {}
        self._first: Mapping[int, int] = {}
        self._failed = self._rejected = self._refuted = False
        descends = subproblem.game.collisions == "swept" and len(subproblem.movers) > 1
        self._next_descent = budget.used + DESCENT_AFTER if descends else inf
        self._descended = inf
        self._next_ways = inf if incumbent is not None else budget.used + WAYS_AFTER
        self._next_advice: float = budget.used + ADVICE_AFTER

    @property
    def _upper(self) -> float:
        """Cost of the incumbent; infinite without one."""
        return inf if self.incumbent is None else self.incumbent.value

    def run(self, first: Mapping[int, int]) -> SearchResult:
        """Search all vectors from the earliest arrivals ``first`` on."""
        proved, reported, self._first = inf, -inf, first
        queue = ArrivalQueue(self._subproblem, first, self._is_representative)
        while (vector := queue.pop(self._upper - tol.MIP_GAP)) is not None:
            bound, arrivals, tree = vector
            if bound > reported:
                reported = bound
                self._on_progress("bound", bound)
            if self._budget.out:
                return self._stopped(min(proved, bound))
            tree = tree or self._branch_and_bound(arrivals, queue)
            if tree.root_pending:
                tree.process_root()
            elif not tree.search(self._upper, until=queue.least, pause=self._pause):
                return self._stopped(min(proved, max(bound, tree.bound), queue.least), tree)
            self._note_faults(tree)
            proved = min(proved, tree.leaf_bound)
            if tree.open_bound < inf:
                queue.push(max(bound, tree.open_bound), arrivals, tree)
                self._keep_loaded(tree)
            self._improve()
        return self._concluded(min(proved, self._upper), complete=True)

    @property
    def _pause(self) -> float:
        """Number of linear programs at which the search pauses to look for plans otherwise."""
        ways = self._next_ways if self.incumbent is None else inf
        return min(ways, self._next_advice, self._next_descent)

    def _improve(self) -> None:
        """Look for plans otherwise than by branching, where that is due."""
        if self._budget.used < self._pause or self._budget.out:
            return
        if self.incumbent is None and self._budget.used >= self._next_ways:
            self._next_ways = inf
            self._accept(find_joint_plans(self._subproblem, self._budget))
        if self._budget.used >= self._next_advice:
            self._next_advice, profile = inf, self._advise()
            if profile is not None:
                controls = {i: profile[i].controls for i in self._subproblem.movers}
                self._accept(price(self._subproblem.objective, controls, self._subproblem.given))
        if self._budget.used >= self._next_descent:
            self._descend()

    def _accept(self, plans: PricedProfile | None) -> None:
        """Make plans the incumbent if they cost less."""
        if plans is not None and plans.value < self._upper - tol.IMPROVEMENT:
            self.incumbent = plans
            self._on_progress("value", plans.value)

    def _descend(self) -> None:
        """Let one mover after the other improve the incumbent, until none does."""
        objective, idle = self._subproblem.objective, 0
        while self._upper < self._descended and idle < len(self._subproblem.movers):
            for i in self._subproblem.movers:
                assert self.incumbent is not None
                child = self._budget.child(DESCENT_EFFORT)
                response = engine_search(objective, (i,), self.incumbent.profile, child)
                self._budget.charge(child)
                idle += 1
                if response.value < self._upper - tol.IMPROVEMENT:
                    idle = 0
                    self._accept(response.priced)
                if idle >= len(self._subproblem.movers) or self._budget.out:
                    break
            if self._budget.out:
                break
        self._descended = self._upper
        self._next_descent = 2 * self._budget.used

    def _keep_loaded(self, tree: BranchAndBound) -> None:
        """Keep the linear programs of the most recent searches; release the oldest."""
        self._loaded.pop(id(tree), None)
        self._loaded[id(tree)] = tree
        if len(self._loaded) > MOST_LOADED:
            self._loaded.pop(next(iter(self._loaded))).release()

    def _stopped(self, bound: float, tree: BranchAndBound | None = None) -> SearchResult:
        """Return the incumbent, if any, when a limit or a failure in ``tree`` ends the search."""
        if tree is not None:
            self._note_faults(tree)
        return self._concluded(min(bound, self._upper), complete=False)

    def _note_faults(self, tree: BranchAndBound) -> None:
        """Remember what the evaluator and the linear programs of a search disagree on."""
        self._failed |= tree.failed
        self._rejected |= tree.rejected

    def _concluded(self, bound: float, *, complete: bool) -> SearchResult:
        """Return the result of the search, as far as it is proved."""
        times, first = self._subproblem.objective.time, self._first
        floor = float(sum(times[i] * t for i, t in first.items()))
        claims = Claims(
            bound, complete, self._failed, self._rejected, self._refuted, FAILED * self._failed
        )
        return conclude(self.incumbent, claims, floor)

    def _is_representative(self, arrivals: Mapping[int, int]) -> bool:
        """Return whether the vector stands for its orbit."""
        if len(self._symmetries) == 1:
            return True
        images = [symmetry.moved(arrivals) for symmetry in self._symmetries]
        return images[0] == min(images)

    def _branch_and_bound(self, arrivals: Mapping[int, int], queue: ArrivalQueue) -> BranchAndBound:
        """Return the search of one vector."""
        subproblem = self._subproblem
        presolved = queue.presolved(tuple(arrivals[i] for i in subproblem.movers)) or []
        spent = float(sum(subproblem.objective.time[i] * t for i, t in arrivals.items()))
        unchanged = self._symmetries[0].moved(arrivals)
        return BranchAndBound(
            lambda: FixedProgram(subproblem, arrivals, presolved),
            spent,
            self._upper,
            self._budget,
            self._price,
            CutsAtArrivals(self._cuts, arrivals),
            [symmetry for symmetry in self._symmetries if symmetry.moved(arrivals) == unchanged],
        )

    def _price(
        self, program: FixedProgram, point: np.ndarray, estimate: float, spare: float
    ) -> float:
        """Return the cost of a point's plans; they become the incumbent if they are cheaper.

        Plans that cost less than the linear program says refute its value, unless they arrive
        before the arrivals of the program.
        """
        subproblem = self._subproblem
        priced = price(subproblem.objective, program.controls_at(point), subproblem.given)
        if priced is None or not isfinite(priced.value):
            return inf
        if priced.value < estimate + spare - tol.AGREEMENT * max(1.0, abs(priced.value)):
            arrivals = program.arrivals.items()
            self._refuted |= all(priced.profile[i].arrival == t for i, t in arrivals)
        if priced.value < self._upper:
            self.incumbent = priced
            self._on_progress("value", priced.value)
        return priced.value
