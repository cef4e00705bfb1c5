"""Equilibria collected and named; who passes whom follows from the plans."""

from __future__ import annotations

import pytest

from ppg_env import make_game
from solvers import certify, collect_equilibria
from solvers.equilibrium.enumeration import passing
from tests.marks import first


@pytest.mark.parametrize("name", first(1, ["intersection", "head_on"]))
def test_two_agents_pass_on_either_side(name):
    game = make_game(name, speed="l1")
    found = collect_equilibria(game, runs=6)
    assert {one.name for one in found} == {"0<1 left", "0<1 right"}
    assert sum(one.found for one in found) == 6
    for one in found:
        assert certify(game, one.solution.profile).epsilon <= 1e-5
        assert passing(game, one.solution.profile) == one.name


@pytest.mark.slow
def test_they_come_cheapest_first_and_are_the_same_for_the_same_seed():
    game = make_game("circle(4)", speed="l1")
    first, again = (collect_equilibria(game, runs=6, seed=3) for _ in range(2))
    costs = [one.solution.evaluation.social_cost for one in first]
    assert costs == sorted(costs)
    assert [one.name for one in first] == [one.name for one in again]
    assert [one.solution.profile for one in first] == [one.solution.profile for one in again]
    assert len(first) > 2


def test_sides_are_those_of_the_agents_eyes():
    """Agent 0 flies east and steps south, so it has agent 1, who comes west, on its left."""
    game = make_game("head_on", speed="l1")
    for one in collect_equilibria(game, runs=4):
        a, b = (plan.means for plan in one.solution.profile)
        nearest = min(range(9), key=lambda t: abs(a[t, 0] - b[t, 0]))
        assert (a[nearest, 1] < b[nearest, 1]) == (one.name == "0<1 left")


def test_in_space_kinds_differ_by_cost():
    found = collect_equilibria(make_game("intersection_3d"), runs=3)
    assert found
    assert all(one.name.startswith("social cost ") for one in found)
