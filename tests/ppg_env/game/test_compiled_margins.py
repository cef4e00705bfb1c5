"""The scalars of the compiled kernels against their NumPy counterparts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ppg_env import make_game
from ppg_env import tolerances as tol
from ppg_env.game.compiled_margins import best_face, face_margin, inside
from ppg_env.game.margins import (
    collision_faces,
    encounter_pairs,
    encounter_units,
    face_margins,
    margins,
)


@pytest.mark.parametrize("unit", [0.0, 2 * tol.DEVIATION, 0.7])
@pytest.mark.parametrize(
    "clearance", [-1.0, -2 * tol.LENGTH, -tol.LENGTH, -0.5 * tol.LENGTH, 0.0, 3.0]
)
def test_the_margin_of_a_face_has_one_rule(clearance: float, unit: float) -> None:
    expected = float(face_margins(np.array(clearance), np.array(unit)))
    assert face_margin(clearance, unit) == expected
    noisy = unit > 0
    assert np.isfinite(expected) == noisy
    assert noisy or (expected > 0) == (clearance >= -tol.LENGTH)


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_kernels_and_evaluator_agree_on_margins_and_overlaps(noise: float) -> None:
    game = make_game("intersection3", noise=noise)
    game = replace(
        game, agents=(replace(game.agents[0], noise=np.diag([noise, 0.0])), *game.agents[1:])
    )
    faces, pairs, t = collision_faces(game), encounter_pairs(game), 3
    units = np.hstack([encounter_units(game, encounter) for encounter in game.encounters])
    states = np.random.default_rng(0).uniform(-8, 8, (200, len(game.agents), game.dim))
    overlaps = 0
    for e, encounter in enumerate(game.encounters):
        rows, (i, j) = faces.first[e : e + 2], pairs[e]
        for c in range(len(states)):
            where = encounter.displacement(*(states[c, k] for k in encounter.agents))
            clearances = encounter.collision.normals @ where - encounter.collision.offsets
            place = (0, 0), states, c, i, j, faces.normals
            margin = best_face(*place, faces.offsets, *rows, units, t)
            expected = margins(clearances, encounter_units(game, encounter)[t], np.inf)
            np.testing.assert_allclose(margin, expected, rtol=1e-12)
            overlapping = inside(*place, faces.depths, *rows)
            assert overlapping == (clearances.max() <= -tol.LENGTH)
            overlaps += overlapping
    assert 0 < overlaps < len(states) * len(game.encounters)
