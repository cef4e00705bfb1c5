"""The bound on overlaps during steps: closed forms, the cheapest cover, and corners."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.special import ndtr

from ppg_env import Agent, Game, Polytope, evaluate, make_game, make_profile
from ppg_env.game.swept_bound import _cheapest, swept_covers
from tests.oracles.plain_monte_carlo import case


def test_one_agent_and_a_wall_count_every_instant_once() -> None:
    """A face so wide that its ends are nowhere near; the end of the last step counts too."""
    body = Polytope.box([2.0, 2.0])
    agent = Agent([0, 6], [5, 6], body, Polytope.box([4, 4]), noise=1.0)
    wall = Polytope.from_vertices([[-500, 0], [500, 0], [500, -500], [-500, -500]])
    game = Game((agent,), (wall,), horizon=7, collisions="swept")
    judged = evaluate(game, make_profile(game, [np.tile([1.0, 0.0], (7, 1))]))
    assert judged.arrival == (5,)
    tails = ndtr(-5.0 / np.sqrt(np.arange(1, 6)))
    assert judged.risk_bound_any == pytest.approx(tails.sum(), rel=1e-9)
    assert judged.risk_bound[0] == judged.risk_bound_any
    assert judged.risk_sum_any > 1.5 * judged.risk_bound_any


@pytest.mark.parametrize("seed", range(6))
def test_the_cover_is_the_cheapest_of_all_sequences(seed: int) -> None:
    tails = np.exp(np.random.default_rng(seed).normal(0, 2, (5, 3)))

    def cost(sequence: tuple[int, ...]) -> float:
        total = sum(tails[t + 1, h] for t, h in enumerate(sequence))
        fresh = [t for t in range(4) if t == 0 or sequence[t] != sequence[t - 1]]
        return total + sum(tails[t, sequence[t]] for t in fresh)

    times, chosen = _cheapest(tails)
    assert (np.diff(times) >= 0).all()
    best = min(cost(sequence) for sequence in product(range(3), repeat=4))
    assert tails[times, chosen].sum() == pytest.approx(best)


def test_half_spaces_of_a_cover_contain_the_collision_set() -> None:
    game, profile = case("crowd 1e-3")
    game = replace(game, collisions="swept")
    for cover, encounter in zip(swept_covers(game, profile), game.encounters, strict=True):
        noisy = cover.deviations > 0
        times, normals = cover.times[noisy], cover.normals[noisy]
        mean = profile[encounter.agents[0]].means[times, :2]
        if encounter.obstacle is None:
            mean = mean - profile[encounter.agents[1]].means[times, :2]
        edge = (mean * normals).sum(axis=1) - cover.levels[noisy] * cover.deviations[noisy]
        reach = encounter.collision.vertices @ normals.T
        assert (reach.max(axis=0) <= edge + 1e-9).all()
        assert noisy.any()


def test_a_corner_that_is_passed_between_two_steps_is_no_face() -> None:
    game, profile = case("corner 1e-3")
    judged = evaluate(replace(game, collisions="swept"), profile)
    assert judged.risk_bound_any < 0.1 * judged.risk_sum_any


def test_a_bound_too_small_for_a_number_is_not_called_zero() -> None:
    game = make_game("parallel", noise=1e-5, collisions="swept")
    profile = make_profile(game, [np.tile([9.0, 0.0], (15, 1))] * 2)
    assert 0 < evaluate(game, profile).risk_bound_any < 1e-290
    still = replace(game, agents=tuple(replace(agent, noise=0.0) for agent in game.agents))
    assert evaluate(still, profile).risk_bound_any == 0
