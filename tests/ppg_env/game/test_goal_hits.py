"""Arrivals at which a moving obstacle hits an agent at its goal, held against the evaluator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import Agent, Game, Polytope, evaluate, make_plan
from ppg_env.game.earliest_way import earliest_way
from ppg_env.game.goal_hits import hit_arrivals
from ppg_env.game.obstacle import Obstacle
from tests.marks import first
from tests.oracles.mixed_games import FLAT, mixed_game

RULES = [("instants", "remove"), ("instants", "stay"), ("swept", "remove"), ("swept", "stay")]


def crossed(collisions: str, on_goal: str, start: float = -4.0, **fields: object) -> Game:
    """A unit box that flies up to the origin, which another one crosses: it is there at t = 4."""
    agent = Agent([0.0, start], [0.0, 0.0], Polytope.box([1.0, 1.0]), Polytope.box([4.0, 4.0]))
    path = np.column_stack([np.arange(-4.0, 5.0), np.zeros(9)])
    walls = [Obstacle(Polytope.box([1.0, 1.0]), path=path, **fields)]
    return Game((agent,), walls, horizon=8, collisions=collisions, on_goal=on_goal)


@pytest.mark.parametrize(
    ("rules", "hit"),
    [
        (RULES[0], []),
        (RULES[1], [0, 1, 2, 3, 4]),
        (RULES[2], [4]),
        # From 3 to 4 and from 4 to 5 it overlaps, and at 5 it touches.
        (RULES[3], [0, 1, 2, 3, 4]),
    ],
)
def test_hits_are_at_the_times_at_which_the_obstacle_is_over_the_goal(
    rules: tuple[str, str], hit: list[int]
) -> None:
    game = crossed(*rules)
    assert np.flatnonzero(hit_arrivals(game, 0)[0]).tolist() == hit
    assert earliest_way(game, 0) == (5 if rules[1] == "stay" else 2)
    assert not hit_arrivals(crossed(*rules, until=3), 0).any()


@pytest.mark.parametrize("collisions", ["instants", "swept"])
def test_an_agent_that_starts_at_its_goal_is_hit_there_or_gone(collisions: str) -> None:
    assert earliest_way(crossed(collisions, "stay", 0.0), 0) is None
    assert earliest_way(crossed(collisions, "remove", 0.0), 0) == 0
    assert earliest_way(crossed(collisions, "stay", 0.0, until=3), 0) == 0


@pytest.mark.parametrize("rules", first(2, RULES))
def test_a_body_at_its_goal_from_the_start_is_hit_iff_the_evaluator_finds_an_overlap(
    rules: tuple[str, str],
) -> None:
    random, verdicts = np.random.default_rng(5), []
    agent = Agent([0.0, 0.0], [0.0, 0.0], Polytope.l1(1.0), Polytope.box([4.0, 4.0]))
    for _ in range(60):
        path = np.concatenate([[[-6.0, 0.0]], random.integers(-3, 4, (5, 2)), [[0.0, 6.0]]])
        until = int(random.integers(1, 9))
        wall = Obstacle(Polytope.disc(0.75, 5), path=path, until=until)
        game = Game((agent,), [wall], horizon=7, collisions=rules[0], on_goal=rules[1])
        verdicts.append(evaluate(game, (make_plan(agent, np.zeros((7, 2))),)).feasible)
        assert hit_arrivals(game, 0)[0, 0] == (not verdicts[-1])
    assert rules[1] == "remove" or 5 < sum(verdicts) < 55


@pytest.mark.parametrize("rules", first(1, RULES[1:]))
def test_no_plan_that_is_free_of_overlap_arrives_when_it_is_hit_or_before_the_bound(
    rules: tuple[str, str],
) -> None:
    random, hits, free = np.random.default_rng(2), 0, 0
    for seed in FLAT[:40]:
        mixed = mixed_game(seed)
        agent, drawn = mixed.game.agents[0], mixed.profile[0]
        goal, dim = agent.goal[: mixed.game.dim], mixed.game.dim
        way = goal + random.integers(-3, 4, (int(random.integers(2, 7)), dim))
        path = np.concatenate([[goal + 30.0], way, [goal - 30.0]])
        until = int(random.integers(3, 8)) if random.random() < 0.5 else None
        wall = Obstacle(Polytope.box([0.5] * dim), path=path, until=until)
        game = replace(
            mixed.game, agents=(agent,), obstacles=(wall,), collisions=rules[0], on_goal=rules[1]
        )
        plan, hit = make_plan(agent, drawn.controls), hit_arrivals(game, 0)[0]
        if evaluate(game, (plan,)).feasible:
            free += 1
            assert not hit[plan.arrival]
            assert earliest_way(game, 0) <= plan.arrival
        hits += hit[plan.arrival]
    assert hits >= 3
    assert free >= 5
