"""What a search returns, whatever did the searching."""

from __future__ import annotations

from dataclasses import dataclass

from ppg_env.game.evaluation import Evaluation
from ppg_env.game.plan import Profile
from solvers.solution import Status


@dataclass(frozen=True)
class SearchResult:
    """Status, bound and plans; ``profile`` is complete, the given agents' plans included."""

    status: Status
    bound: float
    profile: Profile | None = None
    evaluation: Evaluation | None = None
    value: float = float("inf")
    detail: str = ""
