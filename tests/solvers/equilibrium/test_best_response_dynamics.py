"""Best-response dynamics: the potential falls, the end has a reason, the regret is proved."""

from __future__ import annotations

import numpy as np
import pytest

from ppg_env import (
    Agent,
    Game,
    InputError,
    Polytope,
    evaluate,
    make_game,
    make_profile,
)
from solvers import best_response_dynamics, certify, social_optimum
from solvers.solution import Status
from tests.marks import first

SMALLEST_GAIN = 1e-6
PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")


def assert_the_potential_never_rises(solution):
    heights = [update.potential for update in solution.trace]
    finite = np.isfinite(heights)
    assert finite[-1]
    assert (np.diff(finite.astype(int)) >= 0).all()  # once whole, a profile stays whole
    assert (np.diff(np.array(heights)[finite]) <= 1e-9).all()


def test_on_the_papers_scenarios_dynamics_end_at_a_certified_equilibrium(paper_game, nash):
    assert nash.status is Status.EQUILIBRIUM
    assert nash.evaluation.violations() == ()
    assert nash.regret.max() <= 1e-5
    assert_the_potential_never_rises(nash)


def test_an_update_lowers_the_potential_by_the_gain_over_one_minus_lam(paper_game, nash):
    for earlier, later in zip(nash.trace, nash.trace[1:], strict=False):
        if np.isfinite([earlier.potential, later.before]).all():
            care = 1 - paper_game.agents[later.agent].lam
            fall = earlier.potential - later.potential
            assert fall * care == pytest.approx(later.before - later.after, abs=1e-6)


@pytest.mark.parametrize(
    ("start", "order"),
    [
        ("straight", "random"),
        ("straight", "backwards"),
        ("sequential", "cyclic"),
        ("sequential", "backwards"),
        ("idle", "random"),
        ("social", "cyclic"),
    ],
)
@pytest.mark.parametrize(
    ("name", "speed", "objective"),
    [("intersection", "l1", "margin"), ("intersection3", "box", "risk")],
)
def test_the_potential_never_rises_whatever_the_start_and_order(
    name, speed, objective, start, order
):
    game = make_game(name, speed=speed, objective=objective)
    if start == "idle":
        start = make_profile(game, [np.zeros((game.horizon, 2))] * len(game.agents))
    elif start == "social":
        start = social_optimum(game).profile
    order = list(range(len(game.agents)))[::-1] if order == "backwards" else order
    solution = best_response_dynamics(game, start=start, order=order)
    assert solution.status is Status.EQUILIBRIUM
    assert_the_potential_never_rises(solution)
    assert certify(game, solution.profile).epsilon <= 1e-5


@pytest.mark.parametrize("seed", first(1, range(3)))
def test_the_potential_never_rises_for_unequal_lams_and_any_seed(seed):
    game = make_game("intersection3", lam=[0.2, 0.5, 0.85], objective="risk", noise=4.0)
    solution = best_response_dynamics(game, order="random", seed=seed)
    assert solution.status is Status.EQUILIBRIUM
    assert_the_potential_never_rises(solution)


def test_a_sweep_of_a_random_order_asks_no_agent_twice_and_seeds_matter():
    game = make_game("circle(4)")
    orders = set()
    for seed in range(3):
        trace = best_response_dynamics(game, order="random", seed=seed, max_sweeps=2).trace
        for sweep in {update.sweep for update in trace}:
            asked = [u.agent for u in trace if u.sweep == sweep]
            assert len(asked) == len(set(asked))  # agents whose last proof still holds are skipped
            assert sweep > 1 or sorted(asked) == [0, 1, 2, 3]
        orders.add(tuple(update.agent for update in trace))
    assert len(orders) > 1


def test_one_sweep_is_not_enough_and_says_so():
    game = make_game("intersection", speed="l1")
    solution = best_response_dynamics(game, max_sweeps=1)
    assert solution.status is Status.NOT_CONVERGED
    assert "limit" in solution.advice
    assert max(update.sweep for update in solution.trace) == 1
    assert solution.regret is None
    assert evaluate(game, solution.profile).feasible


@pytest.mark.parametrize(
    ("name", "objective"),
    [("intersection", "margin"), ("intersection", "risk"), ("head_on", "margin")],
)
def test_simultaneous_updates_may_cycle_and_updates_in_turn_do_not(name, objective):
    game = make_game(name, objective=objective, gain=0.0)
    together = best_response_dynamics(game, order="simultaneous", start="sequential")
    assert together.status is Status.CYCLE
    assert "one agent at a time" in together.advice
    assert together.profile is None or evaluate(game, together.profile).feasible
    assert best_response_dynamics(game, start="sequential").status is Status.EQUILIBRIUM


def test_an_equilibrium_stays_where_it_is():
    game = make_game("head_on", speed="l1")
    first = best_response_dynamics(game)
    again = best_response_dynamics(game, start=first.profile)
    assert again.status is Status.EQUILIBRIUM
    assert again.profile == first.profile
    assert len(again.trace) == 2


def test_no_agent_moves_for_less_than_the_tolerance():
    game = make_game("intersection", speed="l1")
    start = best_response_dynamics(game, max_sweeps=1).profile
    lazy = best_response_dynamics(game, start=start, tolerance=1e3)
    # The tie rule alone changes plans, at no cost.
    paid = evaluate(game, start).shifted_cost
    assert (lazy.evaluation.shifted_cost <= paid + 1e-6).all()
    assert [p.arrival for p in lazy.profile] == [p.arrival for p in start]
    # No agent gains 1000, but that does not make the certified regret small.
    honest = certify(game, lazy.profile)
    np.testing.assert_allclose(lazy.regret, honest.regret, atol=1e-6)


@pytest.mark.parametrize("name", PAPER)
def test_the_trace_has_every_update_as_it_happens(name):
    seen = []
    solution = best_response_dynamics(make_game(name), progress=seen.append)
    assert tuple(seen) == solution.trace
    assert all(u.after <= u.before for u in seen)
    assert seen[-1].after == seen[-1].before  # the responses that ended the run: no agent gained
    assert solution.trace[-1].potential == pytest.approx(solution.evaluation.potential)


@pytest.mark.slow
def test_an_equilibrium_is_claimed_only_with_small_regret_whatever_the_time_limit():
    game = make_game("head_on", speed="l1", objective="risk", gain=0.0)
    start = best_response_dynamics(game).profile
    for limit in np.arange(0.2, 1.1, 0.15):
        solution = best_response_dynamics(game, start=start, time_limit=float(limit))
        assert solution.status in (Status.EQUILIBRIUM, Status.NOT_CONVERGED)
        assert evaluate(game, solution.profile).feasible
        if solution.status is Status.EQUILIBRIUM:
            assert solution.regret.max() <= 1e-5, f"claimed at a time limit of {limit:.2f} s"


def test_a_goal_out_of_reach_is_named_with_the_horizon_that_would_do():
    game = make_game("head_on", horizon=7)
    solution = best_response_dynamics(game)
    assert solution.status is Status.UNREACHABLE
    assert solution.profile is None
    assert "agent_0" in solution.advice
    assert "9" in solution.advice


def narrow_corridor() -> Game:
    """Two agents face each other where neither can turn aside, nor leap over the other."""
    walls = [
        Polytope.from_vertices([[-20, y], [40, y], [40, y + 5], [-20, y + 5]]) for y in (-6.1, 1.1)
    ]
    ends = [([0, 0], [20, 0]), ([20, 0], [0, 0])]
    body, speed = Polytope.box([3, 2]), Polytope.box([4, 4])
    agents = tuple(
        Agent(start=s, goal=g, shape=body, control=speed, gain=0.5, noise=0.01) for s, g in ends
    )
    return Game(agents=agents, obstacles=tuple(walls), horizon=12)


@pytest.mark.slow
def test_an_agent_that_the_others_leave_no_way_is_infeasible_with_advice():
    solution = best_response_dynamics(narrow_corridor())
    assert solution.status is Status.INFEASIBLE
    assert solution.profile is None
    assert "overlap" in solution.advice


@pytest.mark.parametrize("order", ["sideways", [0, 0], [0], [1, 2], [0, 1, 2]])
def test_an_order_must_be_known_or_a_permutation(order):
    with pytest.raises(InputError, match="order"):
        best_response_dynamics(make_game("head_on"), order=order)


@pytest.mark.parametrize("start", ["crooked", ()])
def test_a_start_must_be_known_or_a_full_profile(start):
    with pytest.raises(InputError, match="start"):
        best_response_dynamics(make_game("head_on"), start=start)
