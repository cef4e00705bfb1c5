"""The likeliest crash: closed forms head on, norms of its noise, and where its path ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from scipy.optimize import minimize
from scipy.stats import norm

from ppg_env import Agent, Game, Polytope, make_plan
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.plan import Profile
from ppg_env.risk.covering_halfspaces import cover
from ppg_env.risk.crash_events import make_crash_model
from ppg_env.risk.likeliest_crash import LikeliestCrash, likeliest_crash
from tests.oracles.closed_forms import boxes, wall
from tests.ppg_env.strategies import Play, plays
from tests.profiles import examples

GAP, STEPS = 9.0, 4


def head_on(shape: Polytope, unit: float = 1.0) -> tuple[Game, Profile]:
    """Two bodies that approach and stop with GAP between their reference points at the last step.

    They retreat to their goals afterwards; errors add up (gain 0).
    """
    body = Polytope(shape.kind, (np.asarray(shape.params[0]) * unit, *shape.params[1:]))
    speed, far = Polytope.box([60.0 * unit, 60.0 * unit]), GAP / 2 + 10.0 * STEPS
    agents, plans = [], []
    for side in (-1.0, 1.0):
        control = np.zeros((STEPS + 1, 2))
        control[:STEPS, 0], control[STEPS, 0] = -10.0 * side, 25.0 * side
        start, goal = [side * far, 0.0], [side * (GAP / 2 + 25.0), 0.0]
        agents.append(
            Agent(
                np.multiply(start, unit), np.multiply(goal, unit), body, speed,
                gain=0.0, noise=unit**2,
            )
        )  # fmt: skip
        plans.append(make_plan(agents[-1], control * unit))
    return Game(tuple(agents), horizon=STEPS + 1), tuple(plans)


@pytest.mark.parametrize("unit", [1.0, 1e6])
@pytest.mark.parametrize("shape", [Polytope.box([4.0, 4.0]), Polytope.disc(2.0, 32)])
def test_two_bodies_head_on_share_the_gap_and_add_a_step_of_noise_each(
    shape: Polytope, unit: float
) -> None:
    game, plans = head_on(shape, unit)
    crash = likeliest_crash(game, plans)
    assert crash is not None
    reach = float(shape.vertices[:, 0].max() - shape.vertices[:, 0].min())
    beta = (GAP - reach) / np.sqrt(2.0 * STEPS)
    assert (crash.encounter, crash.time, crash.share) == (0, STEPS, 1.0)
    assert crash.beta == pytest.approx(beta, rel=1e-6)
    assert crash.log_form == pytest.approx(norm.logsf(beta), rel=1e-6)
    assert abs(crash.normal) == pytest.approx([1.0, 0.0])
    for deviations, side in zip(crash.deviations, (1.0, -1.0), strict=True):
        expected = side * (GAP - reach) / 2 * np.arange(STEPS + 1) / STEPS
        np.testing.assert_allclose(deviations[:, 0] / unit, expected, atol=1e-6)
        np.testing.assert_allclose(deviations[:, 1] / unit, 0.0, atol=1e-6)


def test_a_wall_is_a_half_plane_so_that_the_estimate_is_exact() -> None:
    game, plans = wall(3.0 * np.sqrt(2.0), 0.7)
    crash = likeliest_crash(game, plans)
    assert crash is not None
    assert crash.log_probability is not None
    assert crash.beta == pytest.approx(3.0, rel=1e-6)
    assert len(crash.faces) == 1
    assert crash.log_form == pytest.approx(crash.log_probability, abs=1e-5)


def test_a_corner_lies_on_two_faces_and_the_estimate_is_above_the_probability() -> None:
    game, plans, exact = boxes(8.0, 6.0)
    crash = likeliest_crash(game, plans)
    assert crash is not None
    assert crash.log_probability is not None
    assert len(crash.faces) == 2
    assert np.exp(crash.log_probability) == pytest.approx(exact, rel=1e-4)
    assert crash.beta == pytest.approx(np.hypot(6.0 / np.sqrt(2.4), 4.0 / np.sqrt(1.4)), rel=1e-6)
    assert crash.log_form > crash.log_probability


def norm_of_noise(game: Game, crash: LikeliestCrash) -> float:
    """The norm of the standard normals that make the path."""
    total = 0.0
    for agent, path, steps in zip(game.agents, crash.deviations, crash.noise, strict=True):
        total += path[0] @ np.linalg.pinv(agent.sigma0) @ path[0]
        total += np.einsum("ti,ij,tj->", steps, np.linalg.pinv(agent.noise), steps)
    if crash.obstacle is not None:
        k = game.encounters[crash.encounter].obstacle
        assert k is not None
        steps = np.diff(crash.obstacle, axis=0)
        inverse = np.linalg.pinv(game.obstacles[k].noise)
        total += np.einsum("ti,ij,tj->", steps, inverse, steps)
    return float(np.sqrt(total))


def displacements(game: Game, profile: Profile, crash: LikeliestCrash) -> np.ndarray:
    """Displacements of the encounter along the path."""
    encounter, d, T = game.encounters[crash.encounter], game.dim, crash.time + 1
    places = [profile[i].means[:T, :d] + crash.deviations[i][:, :d] for i in encounter.agents]
    other = game.obstacle_positions(encounter)
    other = other[:T] if np.ndim(other) == 2 else other
    return (
        encounter.displacement(*places) - other - (0 if crash.obstacle is None else crash.obstacle)
    )


@examples(0.3)
@given(plays(scale="exact"))
def test_the_noise_has_norm_beta_and_leads_to_the_collision_set(play: Play) -> None:
    crash = likeliest_crash(play.game, play.profile)
    assume(crash is not None and crash.beta > 0)
    assert crash is not None
    assert norm_of_noise(play.game, crash) == pytest.approx(crash.beta, rel=1e-5)
    path = displacements(play.game, play.profile, crash)
    end = path[-1] if crash.share == 1.0 else path[-2:].T @ [1 - crash.share, crash.share]
    collision = play.game.encounters[crash.encounter].collision
    excess = (collision.normals @ end - collision.offsets).max()
    assert abs(excess) <= 1e-5 * (1.0 + np.abs(end).max())
    if crash.log_probability is not None:
        # A quadratic program finds beta to about 1e-7, which changes the log by beta^2 as much.
        slack = 1e-6 * (1.0 + crash.beta**2)
        assert crash.log_form >= crash.log_probability - slack


def test_importance_sampling_draws_from_the_same_half_space() -> None:
    game, plans, _ = boxes(9.0, 8.0)
    crash, halves = likeliest_crash(game, plans), cover(make_crash_model(game, plans, merge=False))
    assert crash is not None
    c = int(halves.tails.argmax())
    assert crash.beta == -halves.offsets[c] / halves.deviations[c]
    path = -crash.beta * halves.responses[c, : crash.time + 1] * game.unit
    np.testing.assert_array_equal(path, np.stack(crash.deviations, axis=1))


def moving() -> tuple[Game, Profile]:
    """An agent and a noisy obstacle whose paths cross, the nearest between two instants."""
    block = Obstacle(
        Polytope.box([2.0, 2.0]), np.array([[13.0, y] for y in (20.0, 12.0, 5.0, -3.0)]), 0.4
    )
    agent = Agent([0, 0], [40, 0], Polytope.box([2.0, 3.0]), Polytope.box([20, 20]), noise=0.5)
    game = Game((agent,), horizon=4, obstacles=(block,), collisions="swept")
    return game, (make_plan(agent, [[10.0, 0.0]] * 4),)


def test_during_a_step_no_noise_of_smaller_norm_reaches_the_collision_set() -> None:
    game, plans = moving()
    crash = likeliest_crash(game, plans)
    assert crash is not None
    assert crash.log_probability is None
    assert 0.0 < crash.share < 1.0
    assert crash.obstacle is not None
    assert crash.obstacle[-1].any()
    body, means = game.encounters[0].collision, plans[0].means
    gaps = means - game.obstacle_positions(game.encounters[0])

    def touch(values: np.ndarray, face: int | None = None) -> np.ndarray:
        """Room in the collision set at a share of a step, after noise of agent and obstacle."""
        share, noise = values[0], values[1:].reshape(2, -1, 2)
        error = np.zeros((2, 2))
        path = [error[0] - error[1]]
        for t in range(noise.shape[1]):
            loop = game.agents[0].closed_loop
            error = np.array(
                [
                    loop @ error[0] + np.sqrt(0.5) * noise[0, t],
                    error[1] + np.sqrt(0.4) * noise[1, t],
                ]
            )
            path.append(error[0] - error[1])
        ends = gaps[: len(path)] + np.array(path)
        return body.offsets - body.normals @ ((1 - share) * ends[-2] + share * ends[-1])

    least = np.inf
    for T in range(1, 4):
        for share in (0.1, 0.5, 0.9):
            answer = minimize(
                lambda values: values[1:] @ values[1:],
                np.append(share, np.zeros(4 * T)),
                method="SLSQP",
                bounds=[(0, 1), *[(None, None)] * (4 * T)],
                constraints={"type": "ineq", "fun": touch},
            )
            if answer.success:
                least = min(least, float(np.sqrt(answer.fun)))
    assert crash.beta == pytest.approx(least, rel=1e-4)


def test_without_noise_there_is_no_crash_and_overlapping_means_need_none() -> None:
    game, plans = head_on(Polytope.box([4.0, 4.0]))
    still = replace(game, agents=tuple(replace(a, noise=np.zeros((2, 2))) for a in game.agents))
    assert likeliest_crash(still, plans) is None
    wide = replace(game, agents=tuple(replace(a, shape=Polytope.box([12, 4])) for a in game.agents))
    crash = likeliest_crash(wide, plans)
    assert crash is not None
    assert crash.beta == 0.0
    assert not crash.faces
    assert not any(path.any() for path in crash.deviations)
