"""Polygons split into convex pieces, checked by shapely: area, cover, and few pieces."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import unary_union
from shapely.geometry import Polygon

from ppg_env import InputError
from ppg_env.game.convex_pieces import convex_pieces
from tests.marks import first

L_SHAPE = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]
TEETH = [[9, 5], [7, 5], [7, 1], [5, 1], [5, 5], [3, 5], [3, 1], [1, 1], [1, 5], [0, 5]]
COMB = [[0, 0], [9, 0], *TEETH]


def star(random: np.random.Generator, count: int) -> np.ndarray:
    angles, radii = np.sort(random.uniform(0, 2 * np.pi, count)), random.uniform(1, 10, count)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def untangled(points: np.ndarray) -> np.ndarray:
    """The points in an order in which no two sides cross; they may touch."""
    points, crossing = points.copy(), True
    while crossing:
        crossing = False
        for i in range(len(points) - 1):
            for j in range(i + 2, len(points) - (i == 0)):
                ends = points[[i, i + 1, j, (j + 1) % len(points)]]
                if cross(*ends):
                    points[i + 1 : j + 1] = points[i + 1 : j + 1][::-1].copy()
                    crossing = True
    return points


def cross(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    return turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0


def turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def random_outline(seed: int) -> np.ndarray:
    """Stars, tangles of free points, and of grid points with many in a row."""
    random = np.random.default_rng(seed)
    if seed % 3 == 0:
        return star(random, int(random.integers(3, 40)))
    count = int(random.integers(4, 20))
    if seed % 3 == 1:
        return untangled(random.uniform(-10, 10, (count, 2)))
    grid = np.unique(random.integers(-4, 5, (count, 2)).astype(float), axis=0)
    return untangled(random.permutation(grid))


def assert_split(corners: np.ndarray) -> int:
    whole, pieces = Polygon(corners), convex_pieces(corners)
    polygons = [Polygon(piece.vertices) for piece in pieces]
    for piece, polygon in zip(pieces, polygons, strict=True):
        assert polygon.is_valid
        assert polygon.area == pytest.approx(polygon.convex_hull.area)
        assert not piece.is_flat
    assert sum(polygon.area for polygon in polygons) == pytest.approx(whole.area, rel=1e-9)
    assert unary_union(polygons).symmetric_difference(whole).area <= 1e-9 * whole.area
    ring = np.asarray(corners, dtype=float)[:: 1 if whole.exterior.is_ccw else -1]
    reflex = sum(turn(ring[k - 2], ring[k - 1], ring[k]) < 0 for k in range(len(ring)))
    assert len(pieces) <= 2 * reflex + 1, "a diagonal that no corner needs is left"
    return len(pieces)


@pytest.mark.parametrize("block", first(2, range(12)))
def test_pieces_are_convex_and_cover_the_polygon_once(block: int) -> None:
    split = 0
    for seed in range(30 * block, 30 * block + 30):
        corners = random_outline(seed)
        if Polygon(corners).is_valid:
            split += assert_split(corners) > 1
        else:
            with pytest.raises(InputError, match=r"^polygon: .*; "):
                convex_pieces(corners)
    assert split > 5, "otherwise this test says nothing"


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize(("corners", "count"), [(L_SHAPE, 2), (COMB, 4)])
def test_small_polygons_have_the_fewest_pieces_either_way_round(
    corners: list, count: int, order: int
) -> None:
    assert assert_split(np.array(corners, dtype=float)[::order]) <= count + 1


def test_a_convex_polygon_is_one_piece_and_points_on_its_sides_do_not_matter() -> None:
    corners = [[0, 0], [2, 0], [4, 0], [4, 4], [4, 4], [0, 4], [0, 2], [0, 0]]
    (piece,) = convex_pieces(corners)
    assert sorted(piece.vertices.tolist()) == [[0, 0], [0, 4], [4, 0], [4, 4]]


def test_a_long_spiral_is_split() -> None:
    angles = np.linspace(0, 6 * np.pi, 60)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    spiral = np.concatenate(
        [(1 + angles)[:, None] * around, ((2 + angles)[:, None] * around)[::-1]]
    )
    assert assert_split(spiral) > 30


@pytest.mark.parametrize(
    ("corners", "problem"),
    [
        ([[0, 0], [4, 4], [4, 0], [0, 4]], "cross or touch"),
        ([[0, 0], [4, 0], [4, 4], [2, 0], [0, 4]], "cross or touch"),
        ([[0, 0], [4, 0], [6, 0], [4, 0], [4, 4]], "folds back"),
        ([[0, 0], [4, 0], [2, 0]], "folds back|no area"),
        ([[0, 0], [1, 1]], "not a list of corners"),
        ([[0, 0, 0], [1, 1, 1], [2, 0, 0]], "not a list of corners"),
        ([[0, 0], [1, 1], [1]], "not made of numbers"),
        ("round", "not made of numbers"),
        (star(np.random.default_rng(0), 201), "has 201 corners"),
    ],
)
def test_what_is_no_polygon_is_refused_in_one_sentence(corners: object, problem: str) -> None:
    with pytest.raises(InputError, match=rf"^polygon: .*({problem})"):
        convex_pieces(corners)
