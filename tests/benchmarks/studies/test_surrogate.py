"""Scores of plans: those that planners minimise."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.studies.surrogate import data, study
from benchmarks.studies.surrogate.data import CAPS
from ppg_env.game.objective import crash_risk


@pytest.mark.slow
def test_scores_are_those_that_the_planners_minimise(whole):
    """At a plan's own cap its deficit is the sweep's; the bound is that of the risk objective."""
    checked = set()
    for row in whole(study.STUDY):
        found = data.digest(row)
        scores = found["scores"]
        if row.objective == "margin":
            assert scores[CAPS.index(row.margin_cap)] == pytest.approx(sum(row.deficit), abs=1e-9)
            assert scores[-1] <= row.risk_bound_any * (1 + 1e-9)  # a higher cap adds less
        else:
            steps = len(found["margins"])
            slack = steps * float(crash_risk(np.array(row.margin_cap)))
            assert scores[-1] == pytest.approx(row.risk_bound_any, abs=slack)
        assert scores[: len(CAPS)] == sorted(scores[: len(CAPS)])
        assert min(found["margins"]) <= CAPS[-1]
        checked.add((row.objective, row.player))
    assert len(checked) == 2 * len(data.PLAYERS) + 1
