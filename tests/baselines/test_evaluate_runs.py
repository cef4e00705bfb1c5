"""Judging over runs: groups of episodes, and intervals that cover what they say."""

from __future__ import annotations

import numpy as np
import pytest

from baselines import evaluate_runs
from baselines.evaluate_runs import over_runs
from ppg_env import Game, InputError
from ppg_env.env import episodes as arena
from ppg_env.env.players import GoToGoal, straight_players


def test_run_r_plays_group_r(game: Game) -> None:
    runs = [straight_players(game), [GoToGoal(game, 0), GoToGoal(game, 1)]]
    judged = evaluate_runs(game, runs, 200, seed=3)
    for r, group in enumerate(judged.groups):
        alone = arena.evaluate(game, runs[r], 100, 3, group=r)
        np.testing.assert_array_equal(group.cost, alone.cost)
    assert (
        not np.array_equal(
            arena.evaluate(game, runs[0], 100, 3, group=0).arrival,
            arena.evaluate(game, runs[0], 100, 3, group=1).arrival,
        )
        or (judged.crashes == 1).all()
    )


def test_one_run_plays_all_groups(game: Game) -> None:
    judged = evaluate_runs(game, [straight_players(game)], 301, groups=3)
    assert [len(group.cost) for group in judged.groups] == [101, 101, 101]
    assert judged.summary.crash_any.samples == 303
    with pytest.raises(InputError, match="runs"):
        evaluate_runs(game, [straight_players(game)] * 2, 300, groups=3)


def test_the_interval_over_runs_covers_as_often_as_it_says() -> None:
    random = np.random.default_rng(0)
    draws = random.normal(3.0, 2.0, size=(4000, 5))
    hits = [(i := over_runs(row)).low <= 3.0 <= i.high for row in draws]
    assert np.mean(hits) == pytest.approx(0.95, abs=0.012)


def test_limits_stay_where_they_can_be_and_one_run_has_none() -> None:
    found = over_runs(np.array([0.0, 0.01, 0.0]), 0.0, 1.0)
    assert found.low == 0.0
    assert found.high > 0.01
    alone = over_runs(np.array([2.0]))
    assert alone.value == 2.0
    assert np.isnan([alone.low, alone.high]).all()
