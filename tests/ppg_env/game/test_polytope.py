from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from ppg_env import Agent, InputError, Polytope
from ppg_env.game.hulls import faces_of
from ppg_env.game.obstacle import Obstacle
from tests.ppg_env.strategies import bodies, controls, halfspaces, hulls

CUBE = np.array(list(product([-1.0, 1.0], repeat=3)))
SQUARE = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]


def assert_descriptions_agree(polytope: Polytope) -> None:
    """{x : normals x <= offsets} = conv(vertices), neither with a redundant entry."""
    normals, offsets, vertices = polytope.normals, polytope.offsets, polytope.vertices
    size = max(1.0, float(np.abs(vertices).max()))
    slack = offsets - vertices @ normals.T  # (V, F)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert slack.min() >= -1e-9 * size, "a vertex lies outside a face"
    tight = slack <= 1e-7 * size
    assert (tight.sum(axis=0) >= polytope.dim).all(), "a face touches too few vertices"
    assert (tight.sum(axis=1) >= polytope.dim).all(), "a vertex lies on too few faces"
    rows = np.column_stack([normals, offsets / size])
    twins = np.abs(rows[:, None] - rows[None]).max(axis=2) + np.eye(len(rows))
    assert twins.min() > 1e-10, "a face is listed twice"


@given(st.integers(1, 3).flatmap(lambda dim: bodies(dim) | controls(dim)))
def test_faces_and_vertices_describe_the_same_set(polytope: Polytope) -> None:
    assert_descriptions_agree(polytope)


@given(st.integers(1, 3).flatmap(hulls), st.randoms())
def test_points_on_faces_duplicates_and_order_do_not_matter(
    plain: Polytope, random: np.random.Generator
) -> None:
    corners = plain.vertices.tolist()
    tight = np.abs(plain.vertices @ plain.normals.T - plain.offsets) < 1e-9
    middles = [plain.vertices[on].mean(axis=0).tolist() for on in tight.T]
    shuffled = [*corners, corners[0], *middles]
    random.shuffle(shuffled)
    other = Polytope.from_vertices(shuffled)
    found, expected = (sorted(map(tuple, p.vertices.round(9))) for p in (other, plain))
    assert found == expected
    assert len(other.offsets) == len(plain.offsets)


@given(st.integers(1, 3).flatmap(hulls), st.floats(1e-3, 1.0))
def test_a_point_strictly_inside_is_refused_with_its_depth(plain: Polytope, share: float) -> None:
    middle = plain.vertices.mean(axis=0)
    inside = (1 - share) * plain.vertices[0] + share * middle
    depth = -float(plain.clearance(inside))
    assume(depth > 2e-6 * float(np.ptp(plain.vertices, axis=0).max()))
    with pytest.raises(InputError, match=r"^vertices: .*not in convex position") as caught:
        Polytope.from_vertices([*plain.vertices, inside])
    assert f"{depth:.3g}"[:3] in str(caught.value)
    assert ("polygon" in str(caught.value)) == (plain.dim == 2)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_points_on_an_edge_written_with_six_digits_are_harmless(size: float) -> None:
    angles = np.linspace(0, 2 * np.pi, 4, endpoint=False) + 0.3
    corners = np.column_stack([np.cos(angles), np.sin(angles)])
    thirds = (2 * corners + np.roll(corners, 1, axis=0)) / 3
    points = size * np.concatenate([corners, thirds]).round(6)
    assert 4 <= len(Polytope.from_vertices(points).vertices) <= 8


def test_a_cube_from_vertices_has_six_faces_although_qhull_triangulates() -> None:
    assert len(ConvexHull(CUBE).equations) > 6, "otherwise this test says nothing"
    cube = Polytope.from_vertices(CUBE)
    assert len(cube.offsets) == 6
    assert_descriptions_agree(cube)


@pytest.mark.parametrize("angle", [0.1, 0.3, 1.0])
def test_a_turned_and_distant_cuboid_has_six_faces(angle: float) -> None:
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    cuboid = Polytope.from_vertices(CUBE @ turn.T * [7.0, 3.0, 0.5] + [500.0, -300.0, 80.0])
    assert len(cuboid.offsets) == 6
    assert_descriptions_agree(cuboid)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_box_takes_full_side_lengths(dim: int) -> None:
    sides = [4.0, 6.0, 10.0][:dim]
    box = Polytope.box(sides)
    assert box.dim == dim
    assert len(box.vertices) == 2**dim
    assert len(box.offsets) == 2 * dim
    np.testing.assert_allclose(np.abs(box.vertices), np.tile(np.array(sides) / 2, (2**dim, 1)))
    assert box == Polytope.box(sides)
    assert_descriptions_agree(Polytope.from_vertices(box.vertices))


def test_a_box_may_be_a_point_or_a_line() -> None:
    point, line = Polytope.box([0.0, 0.0]), Polytope.box([0.0, 2.0])
    assert point.vertices.tolist() == [[0.0, 0.0]]
    assert sorted(line.vertices.tolist()) == [[0.0, -1.0], [0.0, 1.0]]
    assert point.clearance(np.array([3.0, 0.0])) == 3.0


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_l1_ball_is_where_absolute_values_sum_to_the_radius(dim: int) -> None:
    ball = Polytope.l1(3.0, dim)
    assert ball.dim == dim
    assert len(ball.vertices) == 2 * dim
    assert len(ball.offsets) == 2**dim
    sample = np.random.default_rng(1).uniform(-3, 3, (200, dim))
    np.testing.assert_array_equal(ball.clearance(sample) <= 0, np.abs(sample).sum(axis=1) <= 3.0)
    assert_descriptions_agree(ball)


@pytest.mark.parametrize("sides", [3, 4, 16, 33])
def test_disc_is_a_regular_polygon_inscribed_in_the_circle(sides: int) -> None:
    disc = Polytope.disc(10.0, sides)
    assert len(disc.vertices) == len(disc.offsets) == sides
    np.testing.assert_allclose(np.linalg.norm(disc.vertices, axis=1), 10.0)
    np.testing.assert_allclose(disc.offsets, 10.0 * np.cos(np.pi / sides))
    assert [10.0, 0.0] in disc.vertices.tolist()
    assert_descriptions_agree(disc)


@given(halfspaces())
def test_halfplanes_and_their_corners_describe_the_same_set(polytope: Polytope) -> None:
    rows, limits = polytope.params
    inside = (polytope.vertices @ rows.T <= limits + 1e-7).all()
    assert inside
    again = Polytope.from_vertices(polytope.vertices)
    sample = np.random.default_rng(0).uniform(-20, 20, (200, 2))
    by_rows = ((sample @ rows.T - limits) / np.linalg.norm(rows, axis=1)).max(axis=1)
    decided = np.abs(by_rows) > 1e-6
    np.testing.assert_array_equal((again.clearance(sample) <= 0)[decided], (by_rows <= 0)[decided])


def test_halfplanes_on_a_line_are_an_interval() -> None:
    interval = Polytope.from_halfspaces([[2.0], [-1.0], [1.0]], [6.0, 1.0, 10.0])
    assert interval.vertices.tolist() == [[-1.0], [3.0]]
    assert interval.offsets.tolist() == [3.0, 1.0]


def test_corners_of_a_polygon_go_round_counter_clockwise() -> None:
    corners = Polytope.from_vertices([[0, 0], [4, 4], [4, 0], [0, 4], [5, 2]]).vertices  # mixed up
    x, y = corners.T
    assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2 == pytest.approx(18.0)


@given(st.integers(1, 3).flatmap(hulls), st.integers(0, 2**32 - 1))
def test_support_is_the_largest_product_over_the_set(polytope: Polytope, seed: int) -> None:
    random = np.random.default_rng(seed)
    directions = random.standard_normal((5, polytope.dim))
    mixtures = random.dirichlet(np.ones(len(polytope.vertices)), 50) @ polytope.vertices
    support = polytope.support(directions)
    assert (directions @ mixtures.T <= support[:, None] + 1e-12).all()
    np.testing.assert_allclose(polytope.support(polytope.normals), polytope.offsets, atol=1e-9)


def test_clearance_is_negative_inside_zero_on_the_edge_and_a_distance_before_a_face() -> None:
    square = Polytope.from_vertices(SQUARE)
    assert square.clearance(np.array([0.0, 0.5])) == -0.5
    assert square.clearance(np.array([1.0, 0.2])) == pytest.approx(0.0, abs=1e-12)
    assert square.clearance(np.array([[3.0, 0.0], [0.0, 0.0]])).tolist() == pytest.approx([2, -1])


def test_faces_of_a_flat_face_with_extra_points_are_merged() -> None:
    middle = np.concatenate([SQUARE, [[0.0, 1.0], [0.5, 1.0], [1.0, 0.0]]])
    normals, offsets = faces_of(middle, None)
    assert len(normals) == len(offsets) == 4


REFUSED = {
    "box without sides": lambda: Polytope.box([]),
    "box of a number": lambda: Polytope.box(3.0),
    "box with a negative side": lambda: Polytope.box([1.0, -1.0]),
    "box of text": lambda: Polytope.box(["a", "b"]),
    "box of NaN": lambda: Polytope.box([1.0, float("nan")]),
    "box without end": lambda: Polytope.box([1.0, float("inf")]),
    "l1 of radius 0": lambda: Polytope.l1(0.0),
    "l1 of a list": lambda: Polytope.l1([1.0]),
    "l1 in no dimension": lambda: Polytope.l1(1.0, 0),
    "l1 in half a dimension": lambda: Polytope.l1(1.0, 2.5),
    "disc of negative radius": lambda: Polytope.disc(-1.0),
    "disc of 2 sides": lambda: Polytope.disc(1.0, 2),
    "disc of 3.5 sides": lambda: Polytope.disc(1.0, 3.5),
    "disc of yes sides": lambda: Polytope.disc(1.0, True),
    "disc of endless sides": lambda: Polytope.disc(1.0, 10**30),
    "no vertices": lambda: Polytope.from_vertices([]),
    "ragged vertices": lambda: Polytope.from_vertices([[0, 0], [1], [0, 1]]),
    "a list of numbers": lambda: Polytope.from_vertices([1.0, 2.0, 3.0]),
    "points nearly on a line": lambda: Polytope.from_vertices([[0, 0], [1, 1e-10], [2, 0]]),
    "a tiny segment": lambda: Polytope.from_vertices([[0, 0], [1e-20, 1e-20]]),
    "a point inside": lambda: Polytope.from_vertices([*SQUARE, [0.5, 0.0]]),
    "the corners of an L": lambda: Polytope.from_vertices(
        [[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]
    ),
    "too far away": lambda: Polytope.from_vertices([[1e18, 0], [1e18 + 1e4, 0], [1e18, 1e4]]),
    "too small": lambda: Polytope.from_vertices([[0, 0], [1e-20, 0], [0, 1e-20]]),
    "an empty set": lambda: Polytope.from_halfspaces([[1, 0], [-1, 0], [0, 1], [0, -1]], [-1] * 4),
    "an unbounded set": lambda: Polytope.from_halfspaces([[1, 0], [-1, 0], [0, 1]], [1, 1, 1]),
    "one half-plane": lambda: Polytope.from_halfspaces([[1.0, 0.0]], [1.0]),
    "a strip without end": lambda: Polytope.from_halfspaces([[1, 0], [-1, 0]], [1, 1]),
    "a nearly flat set": lambda: Polytope.from_halfspaces(
        [[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -1 + 1e-9, 1, 1]
    ),
    "a nearly empty set": lambda: Polytope.from_halfspaces(
        [[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -1 - 1e-9, 1, 1]
    ),
    "a ray": lambda: Polytope.from_halfspaces([[1.0]], [1.0]),
    "an empty interval": lambda: Polytope.from_halfspaces([[1.0], [-1.0]], [-1.0, -1.0]),
    "a normal of length zero": lambda: Polytope.from_halfspaces([[0, 0], [1, 0]], [1, 1]),
    "too few offsets": lambda: Polytope.from_halfspaces([[1, 0], [-1, 0]], [1]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_polytope_is_refused_in_one_sentence(name: str) -> None:
    with pytest.raises(InputError) as caught:
        REFUSED[name]()
    assert "\n" not in str(caught.value)
    assert ";" in str(caught.value), "a remedy follows the problem"


FLAT = {
    "two points": (lambda: Polytope.from_vertices([[0, 0], [1, 1]]), [[0, 0], [1, 1]]),
    "points on a line": (
        lambda: Polytope.from_vertices([[0, 0], [0.866, 0.5], [1.732, 1.0], [0, 0]]),
        [[0, 0], [1.732, 1.0]],
    ),
    "points in a plane": (
        lambda: Polytope.from_vertices([[*p, 1.0] for p in SQUARE]),
        [[*p, 1.0] for p in SQUARE],
    ),
    "one point twice": (lambda: Polytope.from_vertices([[2.0], [2.0]]), [[2.0]]),
    "one point": (lambda: Polytope.from_vertices([[2.0, 3.0]]), [[2.0, 3.0]]),
    "a strip of no width": (
        lambda: Polytope.from_halfspaces([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, -1, 1, 1]),
        [[1, -1], [1, 1]],
    ),
    "a slanted segment": (
        lambda: Polytope.from_halfspaces([[1, 2], [-3, -6], [0, 1], [0, -1]], [1, -3, 2, 2]),
        [[-3, 2], [5, -2]],
    ),
    "half-planes with one common point": (
        lambda: Polytope.from_halfspaces([[1, 1], [-1, 0], [0, -1]], [5, -2, -3]),
        [[2, 3]],
    ),
    "a square in space": (
        lambda: Polytope.from_halfspaces(
            [[1, 0, 1], [-1, 0, -1], [0, 1, 0], [0, -1, 0], [1, 0, -1], [-1, 0, 1]],
            [1, -1, 2, 2, 1, 1],
        ),
        [[0, -2, 1], [0, 2, 1], [1, -2, 0], [1, 2, 0]],
    ),
}


@pytest.mark.parametrize("name", FLAT)
def test_flat_sets_are_described_by_their_corners_and_by_faces_without_slack(name: str) -> None:
    make, corners = FLAT[name]
    flat = make()
    assert flat.is_flat
    assert sorted((flat.vertices.round(9) + 0.0).tolist()) == sorted(map(list, corners))
    np.testing.assert_allclose(np.linalg.norm(flat.normals, axis=1), 1.0, atol=1e-12)
    random = np.random.default_rng(3)
    mixtures = random.dirichlet(np.ones(len(flat.vertices)), 50) @ flat.vertices
    assert flat.clearance(mixtures).max() <= 1e-12
    assert flat.clearance(flat.vertices + 1e-3 * random.normal(size=flat.dim)).max() > 1e-5
    assert Polytope.from_vertices(flat.vertices).is_flat
    assert Polytope.from_halfspaces(flat.normals, flat.offsets).is_flat


def test_bodies_and_obstacles_of_points_have_volume() -> None:
    flat, body = Polytope.from_vertices([[0, 0], [1, 1]]), Polytope.box([1.0, 1.0])
    with pytest.raises(InputError, match=r"^shape: .*volume is zero"):
        Agent([0, 0], [9, 9], flat, body)
    with pytest.raises(InputError, match=r"volume is zero"):
        Obstacle(flat)
    assert Agent([0, 0], [9, 9], body, flat).control == flat


@pytest.mark.parametrize("thickness", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("length", [1.0, 1e3])
def test_thin_sets_are_made_or_refused_but_never_break(thickness: float, length: float) -> None:
    limits = [length, length, thickness, thickness]
    corners = [[0, 0], [length, 0], [length, thickness], [0, thickness]]
    for make in (
        lambda: Polytope.from_halfspaces([[1, 0], [-1, 0], [0, 1], [0, -1]], limits),
        lambda: Polytope.from_vertices(corners),
    ):
        try:
            polytope = make()
        except InputError:
            continue
        assert len(polytope.vertices) == len(polytope.offsets) == 4
