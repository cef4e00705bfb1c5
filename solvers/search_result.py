r"""What a search returns: status, bound and plans, for the engine and the reference alike.

:func:`conclude` is the only place that sets status and bound of a search.  It takes what a search
claims, the plans that the evaluator priced, and a ``floor`` that needs no back end, and returns

    optimal        value and bound agree
    feasible       they do not, whatever the search claims
    infeasible     the search excluded all plans, and the evaluator rejected none on the way
    time_limit     the search was stopped without plans
    error          anything else: rejected points, values that are not finite, failures

A bound that is not finite, or above the value of known plans, is refuted; the floor replaces it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

from ppg_env import tolerances as tol
from ppg_env.game.evaluation import Evaluation
from ppg_env.game.plan import Profile
from solvers.pricing import PricedProfile
from solvers.solution import Status

UNPROVED = (
    "the search ended, but its bound does not agree with the cost of its plans, so that they are "
    "not proved optimal; try another solver"
)
"""Detail of a search that claims to be complete with plans that it does not prove optimal."""

REFUTED = (
    "the back end claimed that there are no plans, or none as cheap as those returned, which is "
    "wrong, so that nothing is proved; try another solver"
)
"""Detail of a search whose claims known plans refute."""

REJECTED = "the evaluator rejected every plan that the back end returned"
"""Detail of a search without plans, although the back end returned some."""


@dataclass(frozen=True)
class SearchResult:
    """Status, bound and plans; ``profile`` is complete and includes the given agents' plans."""

    status: Status
    bound: float
    profile: Profile | None = None
    evaluation: Evaluation | None = None
    value: float = inf
    detail: str = ""

    @classmethod
    def of(
        cls, status: Status, bound: float, best: PricedProfile | None, detail: str = ""
    ) -> SearchResult:
        """Return the result with the plans of ``best``, if any."""
        if best is None:
            return cls(status, bound, detail=detail)
        return cls(status, bound, best.profile, best.evaluation, best.value, detail)

    @property
    def priced(self) -> PricedProfile | None:
        """The plans with their evaluation and value; None without plans."""
        if self.profile is None or self.evaluation is None:
            return None
        return PricedProfile(self.profile, self.evaluation, self.value)


@dataclass(frozen=True)
class Claims:
    """What a search says about its own outcome.

    Attributes
    ----------
    bound : lower bound on the cost of all plans; infinite if there are none.
    complete : whether the search ended by itself, neither by a limit nor by a failure.
    failed : whether the back end failed.
    rejected : whether the evaluator rejected a point that the back end returned.
    refuted : whether a plan costs less than the back end claimed to be possible.
    detail : what the back end reported.
    """

    bound: float
    complete: bool
    failed: bool = False
    rejected: bool = False
    refuted: bool = False
    detail: str = ""


def conclude(best: PricedProfile | None, claims: Claims, floor: float = -inf) -> SearchResult:
    """Return the result that ``claims`` and the evaluator's price of the ``best`` plans prove.

    ``floor`` is a lower bound on the cost of all plans that does not depend on the back end.
    """
    if best is not None and isfinite(best.value):
        return _with_plans(best, claims, floor)
    if best is not None or claims.failed or claims.rejected or claims.refuted:
        detail = REJECTED if claims.rejected else claims.detail
        return SearchResult(Status.ERROR, floor, detail=detail)
    if claims.complete and claims.bound == inf:
        return SearchResult(Status.INFEASIBLE, inf, detail=claims.detail)
    bound = claims.bound if isfinite(claims.bound) else floor
    return SearchResult(Status.NO_INCUMBENT, bound, detail=claims.detail)


def _with_plans(best: PricedProfile, claims: Claims, floor: float) -> SearchResult:
    """Return the result with plans of finite cost."""
    slack = tol.AGREEMENT * max(1.0, abs(best.value))
    if claims.refuted or claims.bound > best.value + slack:
        return SearchResult.of(Status.FEASIBLE, min(floor, best.value), best, REFUTED)
    bound = min(claims.bound if isfinite(claims.bound) else floor, best.value)
    if best.value - bound <= slack:
        return SearchResult.of(Status.OPTIMAL, bound, best, claims.detail)
    detail = UNPROVED if claims.complete else claims.detail
    return SearchResult.of(Status.FEASIBLE, bound, best, detail)
