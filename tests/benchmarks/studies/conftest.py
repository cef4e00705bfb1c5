"""A small choice of games, played once, and rows with chosen numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks import sweeps
from benchmarks.studies.study import StudyChoice
from solvers.feedback.grid import joint_model

SMALL = StudyChoice(("intersection",), ("l1",), (0.8,), episodes=2000)

STEP = 12.0
"""Distance of the positions of a coarse grid."""


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the tests keep rows that several of them need."""
    return tmp_path_factory.mktemp("studies") / "studies.db"


@pytest.fixture(scope="session")
def whole(store: Path) -> Callable[[Any], list[sweeps.Row]]:
    """The rows of a study's cells for the small choice, with games and plans.

    Feedback policies come from a coarse grid, in seconds and not in minutes.
    """

    def run(study: Any) -> list[sweeps.Row]:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(joint_model, "default_step", lambda *_: STEP)
            return sweeps.sweep(study.cells(SMALL), store)

    return run


def crashing(low: float, value: float, high: float, **others: Any) -> dict[str, Any]:
    """A row with this crash probability and its limits."""
    names = ("crash_probability_low", "crash_probability", "crash_probability_high")
    return dict(zip(names, (low, value, high), strict=True)) | others
