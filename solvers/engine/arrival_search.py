r"""The exact engine: search over arrival vectors, and over faces where it matters.

With the arrivals T of all movers fixed, time costs are known and the reachable sets are tight, so
what is left is small (:mod:`solvers.engine.fixed_arrival_lp`).  Vectors are taken in the order of
a lower bound,

    L(T) = sum_i tau_i T_i + sum_e omega_e (least loss that the reachable sets allow),

which is replaced by the value of the linear relaxation, cuts included, once a vector comes up.
The search ends when the next bound reaches the best plans in hand.  For each vector left a tree
is searched (:mod:`solvers.engine.branch_and_bound`).  The smallest of all bounds is the proof: it
holds whenever the search is stopped, since what was not finished counts with what is known of it.

Of vectors that a symmetry of the game maps to each other, one is enough.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence
from itertools import count

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import evaluate
from ppg_env.game.objective import Objective
from ppg_env.game.plan import Plan, Profile, make_plan
from ppg_env.game.reachability import earliest_arrival
from solvers.budget import Budget
from solvers.engine.branch_and_bound import Tree
from solvers.engine.cuts import CutPool, CutsAtArrivals
from solvers.engine.fixed_arrival_lp import FixedProgram
from solvers.engine.presolve import Subproblem, presolve_encounters
from solvers.engine.symmetry import Symmetry, identity, symmetries
from solvers.search_result import SearchResult
from solvers.solution import Status

MOST_AWAKE = 200
"""Trees that keep their linear programs; the others are built anew when their turn comes."""


def engine_search(
    objective: Objective,
    movers: Sequence[int],
    given: Profile | None,
    budget: Budget,
    tell: Callable[[str, float], None] = lambda what, value: None,
) -> SearchResult:
    """The cheapest plans of ``movers``, with a proved bound, while the others keep to ``given``.

    If ``given`` has sound plans of the movers too, only cheaper ones are looked for.  ``tell`` is
    called with every better ``value`` and ``bound``.
    """
    game = objective.game
    subproblem = Subproblem(objective, tuple(movers), _others(movers, given))
    first = {i: earliest_arrival(game.agents[i], game.horizon) for i in movers}
    if any(start is None for start in first.values()):
        return SearchResult(Status.UNREACHABLE, float("inf"))
    search = _Search(subproblem, _incumbent(subproblem, given), budget, tell)
    return search.run({i: int(t or 0) for i, t in first.items()})


class _Search:
    """One search: the best plans so far, and what the vectors that were dealt with proved."""

    def __init__(
        self,
        subproblem: Subproblem,
        best: SearchResult,
        budget: Budget,
        tell: Callable[[str, float], None],
    ) -> None:
        self._tell = tell
        everybody = set(subproblem.movers) == set(range(len(subproblem.game.agents)))
        self._symmetries: list[Symmetry] = (
            symmetries(subproblem.objective) if everybody else [identity(subproblem.game)]
        )
        self._subproblem, self.best, self._budget = subproblem, best, budget
        self._cuts = CutPool(subproblem, self._symmetries, budget)
        self._awake: dict[int, Tree] = {}

    def run(self, first: Mapping[int, int]) -> SearchResult:
        """Search all vectors from the earliest arrivals ``first`` on."""
        proved, told, vectors = (
            float("inf"),
            float("-inf"),
            _Vectors(self._subproblem, first, self._original),
        )
        while (vector := vectors.pop(self.best.value - tol.MIP_GAP)) is not None:
            bound, arrivals, tree = vector
            if bound > told:
                told = bound
                self._tell("bound", bound)
            if self._budget.out:
                return self._stopped(min(proved, bound))
            tree = tree or self._tree(arrivals)
            if tree.behind:
                tree.look()
            elif not tree.search(self.best.value, until=vectors.least):
                return self._stopped(min(proved, max(bound, tree.bound), vectors.least))
            proved = min(proved, tree.closed)
            if tree.waiting < float("inf"):
                vectors.push(max(bound, tree.waiting), arrivals, tree)
                self._spare(tree)
        if self.best.profile is None:
            return SearchResult(Status.INFEASIBLE, float("inf"))
        return self._found(Status.OPTIMAL, min(proved, self.best.value))

    def _spare(self, tree: Tree) -> None:
        """Keep the programs of the trees that were seen last, and let the others rest."""
        self._awake.pop(id(tree), None)
        self._awake[id(tree)] = tree
        if len(self._awake) > MOST_AWAKE:
            self._awake.pop(next(iter(self._awake))).rest()

    def _stopped(self, bound: float) -> SearchResult:
        status = Status.NO_INCUMBENT if self.best.profile is None else Status.FEASIBLE
        return self._found(status, min(bound, self.best.value))

    def _original(self, arrivals: Mapping[int, int]) -> bool:
        """Whether the vector stands for its orbit."""
        if len(self._symmetries) == 1:
            return True
        images = [one.moved(arrivals) for one in self._symmetries]
        return images[0] == min(images)

    def _tree(self, arrivals: Mapping[int, int]) -> Tree:
        subproblem = self._subproblem
        known = presolve_encounters(subproblem, subproblem.encounters, arrivals) or []
        spent = float(sum(subproblem.objective.time[i] * t for i, t in arrivals.items()))
        images = [one.moved(arrivals) for one in self._symmetries]
        return Tree(
            lambda: FixedProgram(subproblem, arrivals, known),
            spent,
            self.best.value,
            self._budget,
            self._price,
            CutsAtArrivals(self._cuts, arrivals),
            [
                one
                for one, image in zip(self._symmetries, images, strict=True)
                if image == images[0]
            ],
        )

    def _price(self, program: FixedProgram, point: np.ndarray, estimate: float) -> float:
        """Price a point's plans by the evaluator, and keep them if they are sound and cheaper."""
        subproblem, plans = self._subproblem, program.plans(point)
        # Given plans may be predictions; the movers' were made from their controls just now.
        evaluation = evaluate(subproblem.game, plans, as_given=True)
        if evaluation.violations(subproblem.movers):
            return float("inf")
        value = evaluation.weighted(subproblem.objective)
        if value < self.best.value:
            self.best = SearchResult(Status.FEASIBLE, float("-inf"), plans, evaluation, value)
            self._tell("value", value)
        return value

    def _found(self, status: Status, bound: float) -> SearchResult:
        best = self.best
        return SearchResult(status, bound, best.profile, best.evaluation, best.value)


def _others(movers: Sequence[int], given: Profile | None) -> dict[int, Plan]:
    if given is None:
        return {}
    return {i: plan for i, plan in enumerate(given) if i not in movers}


def _incumbent(subproblem: Subproblem, given: Profile | None) -> SearchResult:
    """The plans in hand, if they are sound; their cost cuts the search short from the start."""
    nothing = SearchResult(Status.INFEASIBLE, float("inf"))
    if given is None:
        return nothing
    # What the others do may be a prediction; the movers' plans have to be what their controls do.
    plans = tuple(
        make_plan(agent, plan.controls) if i in subproblem.movers else plan
        for i, (agent, plan) in enumerate(zip(subproblem.game.agents, given, strict=True))
    )
    if any(plans[i].arrival is None for i in subproblem.movers):
        return nothing
    evaluation = evaluate(subproblem.game, plans, as_given=True)
    if evaluation.violations(subproblem.movers):
        return nothing
    value = evaluation.weighted(subproblem.objective)
    return SearchResult(Status.FEASIBLE, float("-inf"), plans, evaluation, value)


class _Vectors:
    """Arrival vectors that the reachable sets allow, cheapest bound first.

    A vector waits with the cost of its time, which is quickly known, until it comes up; only
    then are its presolve_encounters looked at, and its successors, which cost no less, let in:
    those one
    step later in the coordinate that was raised last, or in one after it.  Of vectors that a
    symmetry maps to each other, the ``original`` one comes up.
    """

    def __init__(
        self,
        subproblem: Subproblem,
        first: Mapping[int, int],
        original: Callable[[Mapping[int, int]], bool],
    ) -> None:
        self._subproblem, self._original = subproblem, original
        self._order = count()
        self._queue: list[tuple[float, int, tuple[int, ...], int | None, Tree | None]] = []
        self._wait(tuple(first[i] for i in subproblem.movers), 0)

    @property
    def least(self) -> float:
        """Lower bound on whatever is still to come."""
        return self._queue[0][0] if self._queue else float("inf")

    def push(self, bound: float, arrivals: Mapping[int, int], tree: Tree | None) -> None:
        """Let a vector wait with a bound, and with the tree that was begun."""
        times = tuple(arrivals[i] for i in self._subproblem.movers)
        heapq.heappush(self._queue, (bound, next(self._order), times, None, tree))

    def pop(self, below: float) -> tuple[float, dict[int, int], Tree | None] | None:
        """The next vector with its bound and tree; None if none is left below a cost."""
        subproblem = self._subproblem
        while self._queue and self.least < below:
            bound, _, times, raised, tree = heapq.heappop(self._queue)
            arrivals = dict(zip(subproblem.movers, times, strict=True))
            if raised is None:
                return bound, arrivals, tree
            for k in range(raised, len(times)):
                if times[k] < subproblem.game.horizon:
                    self._wait((*times[:k], times[k] + 1, *times[k + 1 :]), k)
            if not self._original(arrivals):
                continue
            known = presolve_encounters(subproblem, subproblem.encounters, arrivals)
            if known is not None:
                losses = sum(
                    subproblem.objective.encounter[m.index] * (m.fixed_loss + m.least)
                    for m in known
                )
                self.push(bound + float(losses), arrivals, None)
        return None

    def _wait(self, times: tuple[int, ...], raised: int) -> None:
        spent = zip(self._subproblem.movers, times, strict=True)
        bound = float(sum(self._subproblem.objective.time[i] * t for i, t in spent))
        heapq.heappush(self._queue, (bound, next(self._order), times, raised, None))
