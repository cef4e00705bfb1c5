"""What a search returns: status, bound and plans, for the engine and the reference alike."""

from __future__ import annotations

from dataclasses import dataclass

from ppg_env.game.evaluation import Evaluation
from ppg_env.game.plan import Profile
from solvers.pricing import PricedProfile
from solvers.solution import Status


@dataclass(frozen=True)
class SearchResult:
    """Status, bound and plans; ``profile`` is complete and includes the given agents' plans."""

    status: Status
    bound: float
    profile: Profile | None = None
    evaluation: Evaluation | None = None
    value: float = float("inf")
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
