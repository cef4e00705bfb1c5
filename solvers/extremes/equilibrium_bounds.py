r"""The best and the worst equilibrium of a game, between proved bounds.

For all epsilon-equilibria x in plans, with the profiles S that were sampled and certified,

    optimum bound  <=  best   <=  min over S          (least social cost)
    max over S     <=  worst  <=  max over T of high  (largest social cost)

where T runs over all vectors of arrivals.  Proofs for the vector with the largest upper limit, and
for the one with the smallest lower limit, improve the bounds until both intervals are narrow
(:mod:`solvers.extremes.arrival_vectors`).  Whatever ends the search, the bounds hold.

Where there are no such proofs, the worst equilibrium is bounded by the largest losses of bodies
that touch at all times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

from ppg_env import tolerances as tol
from ppg_env.game.canonical import frame_of
from ppg_env.game.evaluation import Evaluation
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from solvers.budget import Budget
from solvers.equilibrium.best_response_dynamics import best_response_dynamics
from solvers.equilibrium.enumeration import Equilibrium, collect_equilibria, passing
from solvers.extremes.arrival_vectors import ArrivalVector, all_vectors, refinable
from solvers.extremes.bounds_result import Between, EquilibriumBounds
from solvers.extremes.coarse_limits import largest_cost, risk_limits
from solvers.extremes.elimination import eliminate
from solvers.extremes.response_limit import ResponseLimits
from solvers.optimum.joint import social_optimum
from solvers.solution import Status

SAMPLING_SHARE, OPTIMUM_SHARE = 0.2, 0.2
"""Parts of the time limit for sampled equilibria, and for the social optimum."""

RESPONSE_ROUNDS = 4, 8, 24
"""Programs for each limit of what agents pay in response, in turn."""

NEARBY = 1.1
"""Vectors whose least cost is up to this many times that of the costliest known equilibrium are
searched first."""

MOST_FAILURES = 6
"""Proofs for one vector that do not end, before the search gives up."""


def equilibrium_bounds(
    game: Game,
    *,
    sampled: Sequence[Equilibrium] | None = None,
    runs: int = 12,
    seed: int = 0,
    gap: float = 0.01,
    epsilon: float = tol.EQUILIBRIUM,
    time_limit: float | None = None,
    progress: Callable[[EquilibriumBounds], None] | None = None,
) -> EquilibriumBounds:
    """Bound the social cost of the best and of the worst equilibrium.

    Parameters
    ----------
    sampled
        Equilibria that are known, of which those with a certified regret up to ``epsilon`` count.
    runs, seed
        Without ``sampled``, the number and the random seed of the runs of the dynamics that find
        some (:func:`solvers.collect_equilibria`).
    gap
        Relative width of both intervals at which the search ends.
    epsilon
        Gain that an equilibrium leaves to each agent at most, in time steps.  Smaller values
        exclude sampled equilibria that are certified less tightly.
    time_limit
        Seconds; None for no limit.  At the limit, the intervals are wider.
    progress
        Called with every better result.
    """
    search = _Search(game, epsilon, Budget(time_limit), progress or (lambda result: None))
    search.sample(sampled, runs, seed)
    search.refine(gap)
    return search.result


class _Search:
    """The bounds so far."""

    def __init__(
        self,
        game: Game,
        epsilon: float,
        budget: Budget,
        progress: Callable[[EquilibriumBounds], None],
    ) -> None:
        self._game, self._epsilon, self._budget, self._progress = game, epsilon, budget, progress
        self._sampled: tuple[Equilibrium, ...] = ()
        self._optimum = Between(0.0, inf)
        self._frame = frame_of(game)
        canonical = game if self._frame is None else self._frame.canonical
        self._responses = ResponseLimits(canonical, epsilon)
        self._vectors = (
            all_vectors(canonical, epsilon, self._responses) if refinable(canonical) else []
        )
        self._refined = bool(self._vectors)

    def sample(self, known: Sequence[Equilibrium] | None, runs: int, seed: int) -> None:
        """Sample equilibria, if none are known, and bound the social optimum."""
        limit = self._budget.limit
        each = None if limit is None else SAMPLING_SHARE * limit / max(runs, 1)
        if known is None:
            known = collect_equilibria(self._game, runs=runs, seed=seed, time_limit=each)
        self._sampled = self._certified(known)
        share = None if limit is None else OPTIMUM_SHARE * limit
        start = self._sampled[0].solution.profile if self._sampled else None
        optimum = social_optimum(self._game, start=start, time_limit=share, seed=seed)
        self._optimum = Between(max(optimum.bound, 0.0), optimum.value)
        self._progress(self.result)

    def refine(self, gap: float) -> None:
        """Prove more about vectors of arrivals until both intervals are narrow."""
        for vector in self._vectors:
            if self._budget.out:
                return
            vector.find_least(self._budget)
        self._limit_responses(gap)
        self._look_nearby(gap)
        while not self._budget.out:
            before = self.result
            lowering = self._dearest(before.worst.low * (1 + gap))
            refuting = self._cheapest(before.best.high * (1 - gap))
            if lowering is None and refuting is None:
                return
            if refuting is None or (lowering is not None and lowering.failed <= refuting.failed):
                assert lowering is not None
                lowering.lower(before.worst.low * (1 + gap), self._budget)
            else:
                refuting.raise_low(before.best.high * (1 - gap), self._budget)
            for each in (lowering, refuting):
                self._add_sample(None if each is None else each.take_candidate())
            if (before.best, before.worst) != (self.result.best, self.result.worst):
                self._progress(self.result)

    def _limit_responses(self, gap: float) -> None:
        """Use what agents pay at most in response to any plan of the other."""
        for rounds in RESPONSE_ROUNDS:
            goal = self.result.worst.low * (1 + gap)
            eliminate(self._vectors, self._responses, goal, rounds, self._budget)
            for witness in self._responses.take_witnesses():
                self._add_sample(witness)
            self._progress(self.result)

    def _look_nearby(self, gap: float) -> None:
        """Look for equilibria that cost little more than the sampled ones."""
        goal = self.result.worst.low * (1 + gap)
        for vector in sorted(self._vectors, key=lambda v: v.low):
            if vector.low <= NEARBY * goal and vector.high > goal and not self._budget.out:
                vector.lower(goal, self._budget)
                self._add_sample(vector.take_candidate())
        self._progress(self.result)

    def _add_sample(self, profile: Profile | None) -> None:
        """Add the equilibria that the dynamics reach from a profile of the canonical game.

        Each agent responds first in turn: the plan of the other may hinder it.
        """
        if profile is None:
            return
        start = profile if self._frame is None else self._frame.back(profile)
        for order in ((0, 1), (1, 0)):
            solution = best_response_dynamics(
                self._game, start=start, order=order, time_limit=self._budget.left
            )
            if solution.status is Status.EQUILIBRIUM and solution.profile is not None:
                kind = Equilibrium(passing(self._game, solution.profile), solution, 1)
                if not any(_alike(kind, other) for other in self._sampled):
                    self._sampled = self._certified([*self._sampled, kind])

    def _certified(self, kinds: Sequence[Equilibrium]) -> tuple[Equilibrium, ...]:
        """Return the epsilon-equilibria among ``kinds``, cheapest first."""
        regrets = [kind.solution.regret for kind in kinds]
        proved = [
            kind
            for kind, regret in zip(kinds, regrets, strict=True)
            if regret is not None and regret.max() <= self._epsilon
        ]
        return tuple(sorted(proved, key=lambda kind: _evaluation(kind).social_cost))

    def _dearest(self, goal: float) -> ArrivalVector | None:
        """Return the vector with the largest upper limit, if that is above the ``goal``."""
        vectors = [v for v in self._vectors if v.high > goal + tol.AGREEMENT]
        vector = max(vectors, key=lambda v: v.high, default=None)
        return None if vector is None or vector.failed >= MOST_FAILURES else vector

    def _cheapest(self, goal: float) -> ArrivalVector | None:
        """Return the vector with the smallest lower limit, if that is below the ``goal``."""
        vectors = [v for v in self._vectors if v.low < goal - tol.AGREEMENT]
        vector = min(vectors, key=lambda v: v.low, default=None)
        return None if vector is None or vector.failed >= MOST_FAILURES else vector

    @property
    def result(self) -> EquilibriumBounds:
        """What is proved so far."""
        costs = [_evaluation(kind).social_cost for kind in self._sampled]
        live = [v for v in self._vectors if v.most > -inf]
        low = max(self._optimum.low, min((v.low for v in live), default=0.0) - tol.AGREEMENT)
        most = max((v.high for v in live), default=-inf) + tol.AGREEMENT
        if not self._refined or most < max(costs, default=low):  # a sample refutes the proofs
            most = largest_cost(self._game)
        if low > min(costs, default=most):
            low = min(self._optimum.low, *costs)
        high, worst = min(costs, default=most), max(costs, default=low)
        risk = risk_limits(self._game, live) if self._refined else Between(0.0, inf)
        return EquilibriumBounds(
            game=self._game,
            epsilon=self._epsilon,
            optimum=self._optimum,
            best=Between(low, high),
            worst=Between(worst, most),
            risk=risk,
            sampled=self._sampled,
            refined=self._refined,
            arrivals=len(self._vectors),
            open=sum(v.failed > 0 and v.high > worst for v in live),
            inequalities=sum(v.inequalities for v in self._vectors),
            seconds=self._budget.spent,
        )


def _alike(kind: Equilibrium, other: Equilibrium) -> bool:
    """Return whether two equilibria have the same name and cost."""
    costs = [_evaluation(each).social_cost for each in (kind, other)]
    return kind.name == other.name and abs(costs[0] - costs[1]) <= tol.IMPROVEMENT


def _evaluation(kind: Equilibrium) -> Evaluation:
    assert kind.solution.evaluation is not None
    return kind.solution.evaluation
