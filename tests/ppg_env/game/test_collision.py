"""The collision set against two independent judges: shapely's polygons, and linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from shapely.affinity import translate
from shapely.geometry import MultiPoint

from ppg_env import InputError, Polytope
from ppg_env.game.polytope import collision_set
from tests.ppg_env.strategies import bodies, hulls

TRIANGLE = Polytope.from_vertices([[0, 0], [4, 0], [0, 3]])
UNCERTAIN = 1e-7


def shift_that_parts(one: Polytope, other: Polytope, displacement: np.ndarray) -> float:
    """Least l1 length of a move of ``one`` that lets the bodies meet; 0 if they do already.

    one at ``displacement``, other at the origin: V1' mu + displacement - move = V2' nu.
    """
    left, right, dim = one.vertices, other.vertices, one.dim
    answer = linprog(
        np.r_[np.zeros(len(left) + len(right)), np.ones(2 * dim)],
        A_eq=np.block(
            [
                [left.T, -right.T, np.eye(dim), -np.eye(dim)],
                [np.ones(len(left)), np.zeros(len(right) + 2 * dim)],
                [np.zeros(len(left)), np.ones(len(right)), np.zeros(2 * dim)],
            ]
        ),
        b_eq=np.r_[-displacement, 1.0, 1.0],
    )
    assert answer.status == 0
    return float(answer.fun)


@given(hulls(), hulls(), st.lists(st.integers(-20, 20), min_size=2, max_size=2))
def test_polygons_overlap_iff_shapely_says_so(
    one: Polytope, other: Polytope, displacement: list[int]
) -> None:
    gap = float(collision_set(one, other).clearance(np.array(displacement, dtype=float)))
    moved = translate(MultiPoint(one.vertices).convex_hull, *displacement)
    resting = MultiPoint(other.vertices).convex_hull
    if gap < -UNCERTAIN:
        assert moved.intersection(resting).area > 0
    elif gap > UNCERTAIN:
        assert not moved.intersects(resting)
    else:  # touching: no common area, no distance
        assert moved.intersection(resting).area == pytest.approx(0, abs=1e-6)
        assert moved.distance(resting) == pytest.approx(0, abs=1e-6)


@given(hulls(), hulls(), st.integers(0, 2**32 - 1))
def test_polygons_that_touch_are_on_the_edge_of_the_collision_set(
    one: Polytope, other: Polytope, seed: int
) -> None:
    random = np.random.default_rng(seed)
    edge = one.vertices[random.integers(len(one.vertices))]
    corner = other.vertices[random.integers(len(other.vertices))]
    gap = collision_set(one, other).clearance(corner - edge)
    assert gap <= UNCERTAIN  # a common point, perhaps more
    normal = other.normals[random.integers(len(other.normals))]
    nearest = one.vertices[np.argmin(one.vertices @ normal)]
    outermost = other.vertices[np.argmax(other.vertices @ normal)]
    gap = collision_set(one, other).clearance(outermost - nearest)
    assert gap == pytest.approx(0, abs=1e-7)


@given(st.sampled_from([2, 3]).flatmap(lambda dim: st.tuples(bodies(dim), bodies(dim))), st.data())
def test_bodies_overlap_iff_a_linear_program_finds_a_common_point(
    pair: tuple[Polytope, Polytope], data: st.DataObject
) -> None:
    one, other = pair
    numbers = st.floats(-25, 25)
    where = np.array(data.draw(st.lists(numbers, min_size=one.dim, max_size=one.dim)))
    gap = float(collision_set(one, other).clearance(where))
    apart = shift_that_parts(one, other, where)
    if gap < -UNCERTAIN:
        assert apart <= UNCERTAIN
    elif gap > UNCERTAIN:
        assert apart >= gap * (1 - 1e-6)  # an l1 distance is no less than that to a face
    else:
        assert apart <= 1e-5


@given(st.integers(1, 3).flatmap(lambda dim: st.tuples(bodies(dim), bodies(dim))))
def test_seen_from_the_other_body_the_set_is_mirrored(pair: tuple[Polytope, Polytope]) -> None:
    one, other = pair
    forth, back = collision_set(one, other), collision_set(other, one)
    np.testing.assert_allclose(forth.support(forth.normals), forth.offsets, atol=1e-9)
    np.testing.assert_allclose(back.support(-forth.normals), forth.offsets, atol=1e-7)
    assert len(forth.offsets) == len(back.offsets)


def test_boxes_give_the_box_of_summed_sides() -> None:
    for dim in (1, 2, 3):
        both = collision_set(Polytope.box([2.0] * dim), Polytope.box([4.0, 6.0, 8.0][:dim]))
        assert len(both.offsets) == 2 * dim
        np.testing.assert_allclose(np.sort(np.abs(both.vertices[0])), [3.0, 4.0, 5.0][:dim])


def test_a_triangle_against_itself_is_a_hexagon_not_a_triangle() -> None:
    assert len(collision_set(TRIANGLE, TRIANGLE).offsets) == 6


def test_intervals_on_a_line() -> None:
    both = collision_set(Polytope.box([2.0]), Polytope.from_vertices([[0.0], [5.0]]))
    assert both.vertices.tolist() == [[-1.0], [6.0]]
    assert both.clearance(np.array([8.0])) == 2.0


def test_two_points_can_never_be_said_to_collide() -> None:
    with pytest.raises(InputError, match="volume"):
        collision_set(Polytope.box([0.0, 0.0]), Polytope.box([0.0, 0.0]))


def test_a_point_against_a_body_is_the_body() -> None:
    both = collision_set(Polytope.box([0.0, 0.0]), TRIANGLE)
    assert sorted(both.vertices.tolist()) == sorted(TRIANGLE.vertices.tolist())
