"""What the batched simulator and the arena offer to learners: copies one by one, and paths."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import InputError, Simulator, make_game
from ppg_env.env import episodes as arena
from ppg_env.env.players import GoToGoal, straight_players
from ppg_env.env.rules import Rules


def test_each_copy_is_paid_by_its_own_lam() -> None:
    game = make_game("head_on", speed="l1", noise=0.0)
    for rules in (Rules(), Rules(sharing="social"), Rules(reward="margin")):
        simulator = Simulator(game, rules, copies=3)
        one = [
            Simulator(make_game("head_on", speed="l1", noise=0.0, lam=lam), rules) for lam in LAMS
        ]
        simulator.lam[:] = LAMS[:, None]
        for each in (simulator, *one):
            each.reset()
        homing = [GoToGoal(game, i) for i in range(2)]
        for _ in range(6):  # they crash on the way
            action = np.stack([h.act(simulator.view(i)) for i, h in enumerate(homing)], axis=1)
            paid = simulator.step(action, restart=False).reward
            alone = [s.step(action[k : k + 1], restart=False).reward[0] for k, s in enumerate(one)]
            np.testing.assert_array_equal(paid, alone)


LAMS = np.array([0.1, 0.5, 0.9])


def test_a_selection_of_copies_restarts() -> None:
    simulator = Simulator(make_game("parallel"), copies=4, seed=1)
    first = simulator.reset().copy()
    for _ in range(3):
        last = simulator.step(np.ones((4, 2, 2))).observation.copy()
    chosen = np.array([True, False, True, False])
    seen = simulator.reset(chosen)
    np.testing.assert_array_equal(seen[chosen], first[chosen])
    np.testing.assert_array_equal(seen[~chosen], last[~chosen])
    assert simulator.clock.tolist() == [0, 3, 0, 3]


def test_paths_are_those_of_the_first_episodes() -> None:
    game = make_game("intersection", speed="l1")
    players = [GoToGoal(game, 0), straight_players(make_game("intersection"))[1]]
    found = arena.evaluate(game, players, 60, seed=3)
    states = arena.trajectories(game, players, 50, seed=3)
    assert states.shape[0] == 50
    assert states.shape[2:] == (2, 2)
    np.testing.assert_array_equal(states[:, 0], np.tile([[10, 50], [50, 10]], (50, 1, 1)))
    there = np.isfinite(states[..., 0])
    last = there.sum(axis=1) - 1
    arrived = found.arrived[:50]
    np.testing.assert_array_equal(last[arrived], found.arrival[:50][arrived])
    assert not np.any(there[:, 1:] & ~there[:, :-1])  # who has left stays away
    for count in (0, arena.COPIES + 1):
        with pytest.raises(InputError, match="episodes"):
            arena.trajectories(game, players, count)


def test_groups_of_episodes_are_independent_and_each_repeats() -> None:
    game = make_game("parallel", speed="l1")
    players = straight_players(game)
    groups = [arena.evaluate(game, players, 500, seed=1, group=g).arrival for g in (0, 1, 0)]
    np.testing.assert_array_equal(groups[0], groups[2])
    assert not np.array_equal(groups[0], groups[1])
    joined = arena.Episodes.joined(
        [arena.evaluate(game, players, 10, seed=1, group=g) for g in (0, 1)]
    )
    np.testing.assert_array_equal(joined.arrival, np.vstack([groups[0][:10], groups[1][:10]]))
