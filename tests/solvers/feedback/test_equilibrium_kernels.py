"""Stage games whose costs are given matrices: every move ends at the point of its number."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.feedback.grid.equilibrium_kernels import SLACK, stage_equilibria
from solvers.feedback.grid.event_table import no_events
from solvers.feedback.grid.stage_kernels import Side

ACTIONS = 5
ROUNDS = 12


def side() -> Side:
    index = np.tile(np.arange(ACTIONS, dtype=np.int32), (ACTIONS, 1))[..., None]
    ones, plane = np.ones((ACTIONS, ACTIONS, 1), np.float32), np.zeros((ACTIONS, ACTIONS, 2))
    window = np.tile(np.array([0, ACTIONS - 1, 0, 0]), (ACTIONS, 1))
    return Side(
        index, ones, plane.astype(np.float32), ones[..., 0], 0 * ones[..., 0], plane[0].copy(),
        window, 1,
    )  # fmt: skip


def play(one, two, tolerance=SLACK, swapped=False):
    """Return pairs (2, A, A) and regrets (A, A) from every pair of actions as the first one."""
    choice = np.stack(np.meshgrid(np.arange(ACTIONS), np.arange(ACTIONS), indexing="ij"))
    choice, regret = choice.astype(np.int32), np.empty((ACTIONS, ACTIONS), np.float32)
    stage_equilibria(
        np.ascontiguousarray(one.T), two, side(), side(), no_events(), np.full(2, 20.0),
        np.zeros((ACTIONS, 4), np.float32), np.zeros((ACTIONS, 4), np.float32), swapped, ROUNDS,
        np.full(regret.shape, tolerance, np.float32), choice, regret,
    )  # fmt: skip
    return choice, regret


def regrets(one, two):
    return np.maximum(one - one.min(axis=0), two - two.min(axis=1, keepdims=True))


def matrices(seed):
    return np.random.default_rng(seed).normal(size=(2, ACTIONS, ACTIONS)).astype(np.float32)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("swapped", [False, True])
def test_the_regret_is_that_of_the_pair_and_zero_where_answers_end(seed, swapped):
    one, two = matrices(seed)
    choice, regret = play(one, two, swapped=swapped)
    assert regret == pytest.approx(regrets(one, two)[choice[0], choice[1]], abs=1e-6)
    assert (regret <= regrets(one, two) + 2 * SLACK).all()


def test_answers_in_a_common_interest_end_in_an_equilibrium():
    one, _ = matrices(3)
    choice, regret = play(one, one)
    assert regret.max() == 0.0
    assert regrets(one, one)[choice[0], choice[1]].max() == 0.0


def test_a_cycle_keeps_the_given_pair_unless_another_is_better_by_more_than_the_tolerance():
    shifts = (np.arange(ACTIONS)[:, None] - np.arange(ACTIONS)[None]) % ACTIONS
    one = (shifts != 0).astype(np.float32)  # seeks the other's action, which flees to the next
    two = (shifts != ACTIONS - 1).astype(np.float32)
    choice, regret = play(one, two)
    assert regret.min() == 1.0
    assert np.array_equal(choice, np.indices((ACTIONS, ACTIONS)))
    two[0, 1] = 0.9
    choice, _ = play(one, two)
    assert (choice[0] == 0).any()
    assert np.array_equal(play(one, two, tolerance=2.0)[0], np.indices((ACTIONS, ACTIONS)))
