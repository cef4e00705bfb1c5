"""Half-spaces that cover crashes: responses of the noise, and what they cover."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppg_env.risk.batches import BLOCK, generator
from ppg_env.risk.covering_halfspaces import cover
from ppg_env.risk.crash_events import CrashModel, make_crash_model
from tests.oracles.plain_monte_carlo import case
from tests.ppg_env.strategies import Play, plays


def path_covariance(model: CrashModel, s: int) -> np.ndarray:
    """(T+1, n, T+1, n) of one process, from the matrix that maps start and noise to the path."""
    process, T = model.processes, model.steps
    loop, n = process.loops[s], process.loops.shape[1]
    path = np.zeros((T + 1, n, T + 1, n))  # component k of e_t from component q of input u
    for u in range(T + 1):
        path[u, :, u] = np.eye(n)
        for t in range(u, T):
            path[t + 1, :, u] = loop @ path[t, :, u]
    inputs = [process.sigma0[s], *[process.noise[s]] * T]
    return np.einsum("tkuq,uqr,vlur->tkvl", path, np.array(inputs), path)


@pytest.mark.parametrize("name", ["side 1e-3", "crowd 1e-3"])
@pytest.mark.parametrize("swept", [False, True])
def test_responses_are_the_covariances_of_whole_paths(name: str, swept: bool) -> None:
    game, profile = case(name)
    model = make_crash_model(game, profile, swept=swept)
    halves, d = cover(model), game.dim
    paths = [path_covariance(model, s) for s in range(len(model.processes.loops))]
    for c, (t, normal) in enumerate(zip(halves.times, halves.normals, strict=True)):
        variance = 0.0
        for side, s in enumerate(halves.parties[c]):
            if s < 0:
                assert not halves.responses[c, :, side].any()
                continue
            covariance = (1, -1)[side] * paths[s][:, :, t, :d] @ normal
            np.testing.assert_allclose(
                halves.responses[c, :, side], covariance / halves.deviations[c], atol=1e-12
            )
            variance += (1, -1)[side] * normal @ covariance[t, :d]
        assert halves.deviations[c] == pytest.approx(np.sqrt(variance))


@given(plays(scale="exact"), st.booleans(), st.integers(0, 100))
def test_every_crash_lies_in_a_half_space_of_its_encounter(
    play: Play, swept: bool, seed: int
) -> None:
    model = make_crash_model(play.game, play.profile, swept=swept)
    room = model.processes.scratch(model.steps)()
    errors, halves = model.processes.draw(generator(seed), room, True), cover(model)
    covered = np.zeros((len(model.until), BLOCK), dtype=bool)
    for c, (e, t) in enumerate(zip(halves.encounter, halves.times, strict=True)):
        first, second = halves.parties[c]
        where = errors[t, first, :2] - (errors[t, second, :2] if second >= 0 else 0.0)
        covered[e] |= halves.normals[c] @ where <= halves.offsets[c]
    met = model.watch(errors, BLOCK).met
    assert not (met & ~covered).any()
