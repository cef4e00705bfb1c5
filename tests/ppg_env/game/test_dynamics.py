from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env import Agent, Game, Polytope, make_game, make_plan
from ppg_env import tolerances as tol
from ppg_env.errors import InputError
from ppg_env.game.dynamics import covariances, goal_selector, rollout
from ppg_env.game.reachability import BackwardReach, earliest_arrival, plan_upper, reach_upper
from tests.ppg_env.strategies import agents, double_integrator

SHAPE = Polytope.box([1.0, 1.0])
ROUNDING = 1e-9


def integrator(start: object, goal: object, control: Polytope, **fields: object) -> Agent:
    return Agent(start=start, goal=goal, shape=SHAPE, control=control, **fields)


def double(
    start: list[float],
    goal: list[float],
    limit: float = 1.0,
    dim: int = 1,
    later: dict[int, float] | None = None,
) -> Agent:
    """A double integrator; ``later`` holds further limits, by the step from which they hold."""
    A, B = double_integrator(dim)
    limits = {0: limit} | (later or {})
    control = [(first, Polytope.box([2 * most] * dim)) for first, most in limits.items()]
    return Agent(
        start, goal, Polytope.box([1.0] * dim), control, A=A, B=B, gain=np.zeros((dim, 2 * dim))
    )


def admissible(agent: Agent, random: np.random.Generator, steps: int) -> np.ndarray:
    """(steps, m) random points of U_t, corners among them."""
    corners = [agent.control_at(t).vertices for t in range(steps)]
    return np.array([random.dirichlet(np.full(len(c), 0.2)) @ c for c in corners])


movers = st.integers(1, 3).flatmap(lambda dim: agents(dim, np.zeros(dim)))
seeds = st.integers(0, 2**32 - 1)


@given(movers, seeds)
def test_rollout_follows_the_recursion(agent: Agent, seed: int) -> None:
    controls = admissible(agent, np.random.default_rng(seed), 6)
    means = rollout(agent, controls)
    assert means.shape == (7, agent.state_dim)
    np.testing.assert_array_equal(means[0], agent.start)
    for control, (before, after) in zip(controls, pairwise(means), strict=True):
        np.testing.assert_allclose(after, agent.A @ before + agent.B @ control, atol=1e-9)


@given(movers)
def test_covariances_are_the_sum_over_all_past_noises(agent: Agent) -> None:
    # Sigma_t = L^t sigma0 L'^t + sum_{k<t} L^k noise L'^k, L = A - B gain: no recursion.
    loop = agent.A - agent.B @ agent.gain
    found = covariances(agent, 4)
    for t in range(5):
        powers = [np.linalg.matrix_power(loop, k) for k in range(t + 1)]
        past = sum((p @ agent.noise @ p.T for p in powers[:t]), np.zeros_like(loop))
        expected = powers[t] @ agent.sigma0 @ powers[t].T + past
        np.testing.assert_allclose(found[t], expected, atol=1e-9 * max(1.0, np.abs(expected).max()))


def test_a_scalar_gain_halves_errors_by_hand() -> None:
    agent = integrator([0, 0], [9, 0], Polytope.box([20.0, 20.0]), gain=0.5, noise=1.9)
    assert covariances(agent, 2)[:, 0, 0].tolist() == [0.0, 1.9, 1.9 + 0.25 * 1.9]


@pytest.mark.parametrize("order", ["integrator", "double integrator"])
def test_covariances_match_samples_of_the_loop(order: str) -> None:
    noise = np.array([[1.0, 0.3], [0.3, 0.5]])
    if order == "integrator":
        gain = np.array([[0.5, 0.2], [-0.1, 0.3]])
        agent = integrator([0, 0], [9, 0], Polytope.box([20.0, 20.0]), gain=gain, noise=noise)
    else:
        agent = double([0.0, 0.0], [9.0, 0.0])
        agent = Agent(
            agent.start, agent.goal, agent.shape, agent.control, 0.5, [[0.3, 0.8]], noise,
            agent.A, agent.B, np.diag([0.5, 0.1]),
        )  # fmt: skip
    random, episodes = np.random.default_rng(7), 40_000
    controls = admissible(agent, random, 5)
    means, expected = rollout(agent, controls), covariances(agent, 5)
    state = random.multivariate_normal(agent.start, agent.sigma0, episodes)
    for t in range(5):
        played = controls[t] - (state - means[t]) @ agent.gain.T
        state = state @ agent.A.T + played @ agent.B.T
        state += random.multivariate_normal(np.zeros(2), noise, episodes)
        sampled, exact = np.cov(state.T), expected[t + 1]
        error = np.sqrt((exact**2 + np.outer(np.diag(exact), np.diag(exact))) / episodes)
        assert (np.abs(sampled - exact) < 5 * error).all()


@given(movers, seeds)
def test_reach_upper_is_never_exceeded_and_is_attained(agent: Agent, seed: int) -> None:
    random, steps = np.random.default_rng(seed), 4
    directions = random.standard_normal((3, agent.state_dim))
    upper = reach_upper(agent, directions, steps)
    scale = max(1.0, np.abs(upper).max())
    for _ in range(5):
        means = rollout(agent, admissible(agent, random, steps))
        assert (means @ directions.T <= upper + ROUNDING * scale).all()
    for row, direction in enumerate(directions):  # the best control of each step, by hand
        best = np.empty((steps, agent.control_dim))
        for k in range(steps):
            pull = agent.B.T @ np.linalg.matrix_power(agent.A.T, steps - 1 - k) @ direction
            corners = agent.control_at(k).vertices
            best[k] = corners[np.argmax(corners @ pull)]
        assert rollout(agent, best)[-1] @ direction == pytest.approx(
            upper[-1, row], abs=1e-9 * scale
        )


@given(st.integers(1, 3), seeds)
def test_plan_upper_is_never_exceeded_by_a_plan_that_arrives(dim: int, seed: int) -> None:
    random, horizon = np.random.default_rng(seed), 7
    turn = np.linalg.qr(random.standard_normal((dim, dim)))[0]
    A = np.eye(dim) if seed % 2 else turn  # turning about the origin leaves only 0 at rest
    control = Polytope.l1(3.0, dim) if seed % 3 else Polytope.box([4.0] * dim)
    if seed % 5 > 1:
        control = ((0, control), (seed % 5, Polytope.box([1.0 + seed % 7] * dim)))
    steps = int(random.integers(1, horizon + 1))
    probe = Agent(np.zeros(dim), np.zeros(dim), Polytope.box([1.0] * dim), control, A=A)
    moves = admissible(probe, random, steps)
    start, goal = np.zeros(dim), rollout(probe, moves)[-1]
    if A is turn:  # played from where it leads to the origin
        for move in moves[::-1]:
            start = turn.T @ (start - move)
        goal = np.zeros(dim)
    agent = Agent(start, goal, probe.shape, control, A=A)
    controls = np.zeros((horizon, dim))
    controls[:steps] = moves
    plan = make_plan(agent, controls)
    assert plan.arrival is not None
    directions = np.concatenate([np.eye(dim), random.standard_normal((4, dim))])
    upper = plan_upper(agent, directions, horizon)
    near = 10 * tol.LENGTH  # a mean that close has arrived, and stays near its goal
    assert (plan.means @ directions.T <= upper + near).all()


def test_plan_upper_is_attained_both_ways_on_a_line() -> None:
    agent = Agent([0.0], [4.0], Polytope.box([1.0]), Polytope.box([4.0]))
    upper = plan_upper(agent, np.array([[1.0], [-1.0]]), 6)
    # Away at speed 2 until it must turn back: 4 + 2 (6 - t) meets 2 t at t = 4.
    assert upper[:, 0].tolist() == [0, 2, 4, 6, 8, 6, 4]
    assert upper[:, 1].tolist() == [0, 2, 4, 2, 0, -2, -4]


def test_plan_upper_knows_that_a_way_back_may_be_slower() -> None:
    # Forwards at 3, backwards at 1: from 0 to 2 by the time 6.
    control = Polytope.from_vertices([[-1.0], [3.0]])
    agent = Agent([0.0], [2.0], Polytope.box([1.0]), control)
    upper = plan_upper(agent, np.array([[1.0], [-1.0]]), 6)
    assert upper[:, 0].tolist() == [0, 3, 6, 5, 4, 3, 2]
    assert upper[:, 1].tolist() == [0, 1, 2, 3, 4, 1, -2]


def test_plan_upper_is_the_forward_bound_where_no_agent_can_rest_at_the_goal() -> None:
    drifting = double([0.0, 0.0], [3.0, 1.0])
    directions = np.eye(2)
    np.testing.assert_array_equal(
        plan_upper(drifting, directions, 5), reach_upper(drifting, directions, 5)
    )


@pytest.mark.parametrize("kind", ["box", "l1", "disc"])
@given(data=st.data())
def test_earliest_arrival_of_an_integrator_is_distance_over_speed(
    kind: str, data: st.DataObject
) -> None:
    # A = B = I: t U is t times as large, so the goal is reached first when t covers its gauge.
    control = {"box": Polytope.box([6, 10]), "l1": Polytope.l1(4), "disc": Polytope.disc(4)}[kind]
    goal = np.array(data.draw(st.lists(st.integers(-30, 30), min_size=2, max_size=2)), float)
    gauge = max(0.0, float((control.normals @ goal / control.offsets).max()))
    expected = int(np.ceil(gauge - 1e-9))
    start = np.array([1.0, -2.0])
    agent = integrator(start, start + goal, control)
    assert earliest_arrival(agent, 20) == expected
    assert earliest_arrival(agent, expected) == expected
    assert expected == 0 or earliest_arrival(agent, expected - 1) is None


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("speed", [-2, 0, 1])
@pytest.mark.parametrize("goal", [-4, -1, 0, 1, 3, 6])
def test_earliest_arrival_of_a_double_integrator_agrees_with_brute_force(
    goal: int, speed: int, whole: bool
) -> None:
    agent = double([0.0, float(speed)], [float(goal), 0.0] if whole else [float(goal)], limit=2.0)
    assert earliest_arrival(agent, 6) == brute_force(agent, 6)


@given(st.integers(-12, 12), st.integers(-2, 2), st.booleans(), st.integers(1, 4), st.booleans())
def test_earliest_arrival_reckons_with_sets_that_change(
    goal: int, speed: int, whole: bool, first: int, faster: bool
) -> None:
    ends = [0.0, float(speed)], [float(goal), 0.0] if whole else [float(goal)]
    agent = double(*ends, limit=1.0, later={first: 2.0 if faster else 0.5})
    assert earliest_arrival(agent, 6) == brute_force(agent, 6)


def test_plan_upper_is_attained_both_ways_by_who_is_slower_later() -> None:
    slower = ((0, Polytope.box([4.0])), (3, Polytope.box([2.0])))
    agent = Agent([0.0], [4.0], Polytope.box([1.0]), slower)
    upper = plan_upper(agent, np.array([[1.0], [-1.0]]), 6)
    # Out at speed 2, and home at speed 1 from time 3 on: at most 4 + (6 - t) then.
    assert upper[:, 0].tolist() == [0, 2, 4, 6, 6, 5, 4]
    assert upper[:, 1].tolist() == [0, 2, 1, -1, -2, -3, -4]


@given(movers, seeds)
def test_the_backward_bound_is_what_a_linear_program_finds(agent: Agent, seed: int) -> None:
    from scipy.linalg import block_diag
    from scipy.optimize import linprog

    random, arrival, n = np.random.default_rng(seed), 5, agent.state_dim
    agent = replace(agent, goal=random.integers(-5, 6, n))
    directions = random.standard_normal((2, n))
    upper = BackwardReach(agent, directions, 7).upper(arrival)
    for t in range(arrival):
        blocks, power = [], np.eye(n)
        for _ in range(t, arrival):
            blocks.insert(0, power @ agent.B)
            power = power @ agent.A
        held = [agent.control_at(k) for k in range(t, arrival)]
        faces = block_diag(np.zeros((0, n)), *(one.normals for one in held))
        for direction, bound in zip(directions, upper[t], strict=True):
            answer = linprog(
                np.r_[-direction, np.zeros(faces.shape[1] - n)],
                A_ub=faces,
                b_ub=np.concatenate([one.offsets for one in held]),
                A_eq=np.hstack([power, *blocks]),
                b_eq=agent.goal,
                bounds=(None, None),
            )
            assert bound == pytest.approx(-answer.fun, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(upper[arrival], directions @ agent.goal, atol=1e-12)


def brute_force(agent: Agent, limit: int) -> int | None:
    """First t at which the goal is in the hull of all states that extreme controls lead to."""
    from scipy.optimize import linprog

    states, select = agent.start[None], goal_selector(agent)
    for t in range(limit + 1):
        seen = states @ select.T
        answer = linprog(
            np.zeros(len(seen)),
            A_eq=np.vstack([seen.T, np.ones(len(seen))]),
            b_eq=np.r_[agent.goal, 1.0],
        )
        if answer.status == 0:
            return t
        nexts = [states @ agent.A.T + agent.B @ corner for corner in agent.control_at(t).vertices]
        states = np.unique(np.concatenate(nexts), axis=0)
    return None


def test_earliest_arrival_knows_a_goal_that_cannot_be_reached() -> None:
    stuck = integrator([0, 0], [5, 1], Polytope.box([4.0, 0.0]))
    assert earliest_arrival(stuck, 200) is None
    assert earliest_arrival(integrator([0, 0], [0, 0], Polytope.box([4.0, 0.0])), 5) == 0


def test_every_scenario_is_reached_by_its_straight_plan_no_earlier_than_possible(
    game: Game,
) -> None:
    from ppg_env import straight_plan

    for agent in game.agents:
        first = earliest_arrival(agent, game.horizon)
        plan = straight_plan(agent, game.horizon)
        assert plan is not None
        assert first == plan.arrival  # A = B = I: the straight line is a fastest way


def test_the_warning_comes_with_a_gain_of_minus_a_half_and_explains_the_sign() -> None:
    from ppg_env import SpectralRadiusWarning

    with pytest.warns(SpectralRadiusWarning, match=r"1\.5.*u = ubar - gain"):
        make_game("head_on", gain=-0.5)
    with pytest.warns(SpectralRadiusWarning, match="never corrected"):
        make_game("head_on", gain=0.0)


@pytest.mark.filterwarnings("ignore:the spectral radius")
def test_states_and_errors_that_outgrow_double_arithmetic_are_refused() -> None:
    with pytest.raises(InputError, match=r"^agent\[0\]\.gain: lets position errors grow beyond"):
        make_game("head_on", gain=1e7)
    with pytest.raises(InputError, match=r"^agent\[0\]\.A: has powers beyond"):
        make_game("head_on", A=[[99.0, 0.0], [0.0, 99.0]], gain=99.0)
    (agent, *_) = make_game("head_on", gain=-0.5).agents
    with pytest.raises(InputError, match=r"^gain: lets position errors grow beyond"):
        covariances(agent, 1000)


def test_backward_bounds_are_infinite_where_powers_of_the_inverse_are_too_large() -> None:
    agent = make_game("head_on", A=[[0.01, 0.0], [0.0, 0.01]]).agents[0]
    upper = BackwardReach(agent, np.eye(2), 300).upper(300)
    assert np.isfinite(upper[-1]).all()
    assert (upper[0] == np.inf).all()
    assert not np.isnan(upper).any()
