"""Normals drawn by compiled code are those of NumPy's generator, in the same state afterwards."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env.env import normals
from ppg_env.env.normals import Normals, compiled_fill
from ppg_env.env.simulator import Simulator


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(seed))


def state(random: np.random.Generator) -> str:
    return str(random.bit_generator.state)


def test_numbers_and_state_are_those_of_numpy() -> None:
    assert compiled_fill() is not None, "NumPy or Numba has changed: draws fall back to NumPy's"
    ours, theirs, draws = generator(3), generator(3), Normals()
    for size in (1, 7, 400_000):  # the tail beyond 3.65 is met a hundred times
        out = draws.fill(ours, np.empty((size, 2, 1)))
        assert np.array_equal(out, theirs.standard_normal(out.shape))
        assert state(ours) == state(theirs)
    assert np.abs(out).max() > 4
    assert ours.random() == theirs.random()


def test_other_generators_draw_their_own_numbers() -> None:
    draws = Normals()
    for kind in (np.random.PCG64, np.random.SFC64, np.random.MT19937):
        out = draws.fill(np.random.Generator(kind(1)), np.empty((5, 2, 2)))
        assert np.array_equal(out, np.random.Generator(kind(1)).standard_normal(out.shape))


def test_without_compiled_code_the_noise_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def played() -> np.ndarray:
        simulator = Simulator(make_game("circle(3)"), copies=5, seed=2)
        simulator.reset()
        for _ in range(3):
            simulator.step(np.zeros((5, 3, 2)))
        return simulator.state.copy()

    expected = played()
    monkeypatch.setattr(normals, "compiled_fill", lambda: None)
    assert np.array_equal(played(), expected)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_copy_draws_the_same_noise_and_leaves_the_original_alone(duplicate: Any) -> None:
    simulator = Simulator(make_game("head_on"), copies=3, seed=1)
    simulator.reset()
    simulator.step(np.zeros((3, 2, 2)))
    other, before = duplicate(simulator), state(simulator.random)
    other.step(np.zeros((3, 2, 2)))
    assert state(simulator.random) == before
    simulator.step(np.zeros((3, 2, 2)))
    assert np.array_equal(simulator.state, other.state)
    assert state(simulator.random) == state(other.random)


def test_copies_in_many_blocks_play_as_few_do() -> None:
    """The kernel works on blocks of copies; noise and actions of a copy decide what it does."""
    game, random = make_game("circle(4)", lam=0.4), np.random.default_rng(0)
    few, many = Simulator(game, copies=3), Simulator(game, copies=600)
    for simulator in (few, many):
        simulator.reset()
    for _ in range(12):
        noise, action = random.normal(size=(600, 4, 2)), random.uniform(-20, 20, (600, 4, 2))
        chosen = [0, 300, 599]
        one, all_of_them = few.step(action[chosen], noise[chosen]), many.step(action, noise)
        assert np.array_equal(few.bodies, many.bodies[chosen])
        for field in vars(one):
            assert np.array_equal(getattr(one, field), getattr(all_of_them, field)[chosen]), field
