"""Solutions: a gap that means something, and advice for every way to end."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import make_game
from solvers import Solution, Status
from solvers.solution import ADVICE


def test_every_status_has_advice_of_its_own():
    assert set(ADVICE) == set(Status)
    assert len(set(ADVICE.values())) == len(Status)


def test_a_status_prints_as_its_plain_word():
    assert f"{Status.NO_INCUMBENT}" == "time_limit"
    assert Status("optimal") is Status.OPTIMAL


@pytest.mark.parametrize(
    ("value", "bound", "gap"),
    [
        (10.0, 9.0, 0.1),
        (10.0, 10.0 + 1e-9, 0.0),
        (0.0, 0.0, 0.0),
        (5.0, -np.inf, np.inf),
        (np.inf, 1.0, np.inf),
    ],
)
def test_the_gap_is_relative_and_never_negative(value, bound, gap):
    solution = Solution(
        make_game("head_on"), "social", Status.FEASIBLE, "", value=value, bound=bound
    )
    assert solution.gap == pytest.approx(gap)
