"""The engine against the paper's formulation on HiGHS, and interrupted at many points."""

from __future__ import annotations

import pytest

from ppg_env import evaluate, make_game
from ppg_env.game import objective
from ppg_env.game.least_effort import straight_plan
from ppg_env.scenarios.make import SPEEDS
from solvers.budget import Budget
from solvers.dispatch import ENGINE, check_solver, minimise
from solvers.engine.arrival_search import engine_search
from solvers.solution import Status
from tests.solvers.test_random_games import drawn_plan, random_game

PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")


class Steps(Budget):
    """A budget that runs out after a number of checks: an interruption that can be repeated."""

    def __init__(self, looks: int) -> None:
        super().__init__(None)
        self.looks = looks

    @property
    def out(self) -> bool:
        self.looks -= 1
        return self.looks < 0


def both(weights, movers, given):
    found = [minimise(weights, movers, given, s, Budget(None)) for s in (ENGINE, "HIGHS")]
    assert found[0].status is found[1].status
    if found[0].profile is not None:
        value = found[1].value
        near = pytest.approx(value, rel=1e-6, abs=1e-6)
        assert found[0].value == near
        assert found[0].bound == near
        assert found[0].bound <= value + 1e-7 * max(1.0, abs(value))
    return found


@pytest.mark.parametrize("name", PAPER)
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("kind", ["margin", "risk"])
@pytest.mark.parametrize(("lam", "gain"), [(0.2, 0.5), (0.8, 0.0)])
def test_best_responses_agree_with_the_reference(name, speed, kind, lam, gain):
    game = make_game(name, speed=speed, objective=kind, lam=lam, gain=gain)
    straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
    both(objective.selfish(game, 0), (0,), straight)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAPER[:4])
@pytest.mark.parametrize("speed", ["box", "l1"])
@pytest.mark.parametrize("kind", ["margin", "risk"])
def test_joint_optima_agree_with_the_reference(name, speed, kind):
    game = make_game(name, speed=speed, objective=kind, lam=0.8)
    for weights in (objective.social(game), objective.potential(game)):
        both(weights, (0, 1), None)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 200))
def test_random_games_agree_with_the_reference(seed):
    game, random = random_game(seed)
    plans = [
        next((plan for _ in range(200) if (plan := drawn_plan(agent, random))), None)
        for agent in game.agents
    ]
    if None in plans:
        pytest.skip("no plan was drawn for an agent")
    both(objective.selfish(game, 0), (0,), tuple(plans))
    if len(game.agents) == 2:
        both(objective.social(game), (0, 1), None)


def test_obstacles_and_three_dimensions_agree_with_the_reference():
    for name in ("course", "intersection_3d"):
        game = make_game(name, objective="risk", lam=0.7)
        straight = tuple(straight_plan(agent, game.horizon) for agent in game.agents)
        both(objective.selfish(game, 0), (0,), straight)


@pytest.mark.parametrize("kind", ["margin", "risk"])
def test_cut_short_anywhere_it_has_sound_plans_and_a_valid_bound(kind):
    game = make_game("intersection", speed="l1", objective=kind, lam=0.8, gain=0.0)
    weights = objective.social(game)
    optimum = engine_search(weights, (0, 1), None, Budget(None))
    assert optimum.status is Status.OPTIMAL
    seen = set()
    for looks in (0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233):
        found = engine_search(weights, (0, 1), None, Steps(looks))
        seen.add(found.status)
        assert found.bound <= optimum.value + 1e-7
        if found.profile is None:
            assert found.status is Status.NO_INCUMBENT
        else:
            assert evaluate(game, found.profile).violations() == ()
            assert found.value >= optimum.value - 1e-7
    assert {Status.NO_INCUMBENT, Status.FEASIBLE} <= seen


def test_it_is_deterministic():
    game = make_game("intersection3", speed="l1", lam=0.8)
    one, two = (
        engine_search(objective.social(game), range(3), None, Budget(None)) for _ in range(2)
    )
    assert one.profile == two.profile
    assert one.bound == two.bound


def test_its_name_is_known_in_any_letters():
    assert check_solver("engine") == ENGINE
    assert check_solver("highs") == "HIGHS"
