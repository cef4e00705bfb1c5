r"""Bounded convex polytopes, the shapes, control sets, obstacles and collision sets of a game.

A polytope is kept as it was written (``kind`` and ``params``), so that a game file survives a
round trip; both descriptions are derived from that when first asked for:

    { x : normals x <= offsets }  =  conv(vertices),   unit normals, no redundant face.

The collision set of two bodies is a Minkowski sum with a mirror image,
``K = C_j + (-C_i)``: bodies i and j overlap iff r_i - r_j lies in K.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from ppg_env.errors import InputError, require
from ppg_env.game.hulls import (
    corners_of_halfspaces,
    corners_of_points,
    faces_of,
    has_interior,
    in_order,
)
from ppg_env.support.frozen import Record, frozen_array
from ppg_env.support.validation import numbers

MOST_SIDES, MOST_AXES = 360, 10
"""PlannerOptions on regular polygons and L1 balls: beyond them faces are too many to plan with."""


@dataclass(frozen=True, eq=False)
class Polytope(Record):
    """A bounded convex polytope in d dimensions; build it with one of the constructors.

    Attributes
    ----------
    kind
        Which constructor made it: ``box``, ``l1``, ``disc``, ``vertices`` or ``halfspaces``.
    params
        That constructor's arguments as arrays.
    """

    kind: str
    params: tuple[np.ndarray, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "params", tuple(map(frozen_array, self.params)))

    @classmethod
    def box(cls, sides: Any) -> Polytope:
        """{x : |x_k| <= sides_k / 2}; ``sides`` (d,) are full lengths, zero allowed (a point)."""
        array = _finite(sides, "sides", "a list of side lengths such as [15.0, 15.0]")
        require(
            array.ndim == 1 and array.size > 0 and bool((array >= 0).all()),
            "",
            f"has sides {array.tolist()}",
            "write one non-negative length per axis, such as [15.0, 15.0]",
        )
        return cls("box", (frozen_array(array),))

    @classmethod
    def l1(cls, radius: float, dim: int = 2) -> Polytope:
        """{x : |x_1| + ... + |x_d| <= radius}, in ``dim`` dimensions."""
        _whole(dim, 1, MOST_AXES, "dimensions")
        return cls("l1", (_radius(radius), frozen_array(dim)))

    @classmethod
    def disc(cls, radius: float, sides: int = 16) -> Polytope:
        """The regular polygon with ``sides`` corners on a circle, one at x = radius."""
        _whole(sides, 3, MOST_SIDES, "sides")
        return cls("disc", (_radius(radius), frozen_array(sides)))

    @classmethod
    def from_vertices(cls, vertices: Any) -> Polytope:
        """conv(vertices) of ``vertices`` (V, d); points inside the hull are allowed."""
        array = _finite(vertices, "vertices", "a list of points such as [[0, 0], [1, 0], [0, 1]]")
        require(
            array.ndim == 2 and array.size > 0,
            "",
            f"has vertices of shape {_shape(array)}",
            "write a list of points, each with the same number of coordinates",
        )
        made = cls("vertices", (frozen_array(array),))
        require(
            has_interior(array),
            "",
            "has vertices that lie in a plane or on a line, so its volume is zero",
            f"give at least {array.shape[1] + 1} points in general position",
        )
        _ = made.faces  # what the hull code cannot take is a mistake to report now
        return made

    @classmethod
    def from_halfspaces(cls, normals: Any, offsets: Any) -> Polytope:
        """{x : normals x <= offsets} of ``normals`` (F, d), ``offsets`` (F,)."""
        rows = _finite(normals, "normals", "one row of numbers per half-plane")
        limits = _finite(offsets, "offsets", "one number per half-plane")
        require(
            rows.ndim == 2 and limits.shape == rows.shape[:1] and rows.size > 0,
            "",
            f"has normals of shape {_shape(rows)} and offsets of shape {_shape(limits)}",
            "write one normal and one offset per half-plane",
        )
        require(
            bool((np.linalg.norm(rows, axis=1) > 0).all()),
            "",
            "has a normal of length zero",
            "remove that half-plane",
        )
        made = cls("halfspaces", (frozen_array(rows), frozen_array(limits)))
        _ = made.vertices  # an empty or unbounded set is a mistake to report now
        return made

    @property
    def dim(self) -> int:
        """Number of coordinates d."""
        if self.kind == "box":
            return self.params[0].size
        if self.kind == "l1":
            return int(self.params[1])
        if self.kind == "disc":
            return 2
        return self.params[0].shape[1]

    @cached_property
    def vertices(self) -> np.ndarray:
        """(V, d) corner points; counter-clockwise in the plane."""
        if self.kind == "box":
            half = self.params[0] / 2
            corners = np.array(list(product(*([-h, h] if h > 0 else [0.0] for h in half))))
        elif self.kind == "l1":
            corners = np.concatenate([sign * self.params[0] * np.eye(self.dim) for sign in (1, -1)])
        elif self.kind == "disc":
            angles = 2 * np.pi * np.arange(int(self.params[1])) / int(self.params[1])
            corners = self.params[0] * np.column_stack([np.cos(angles), np.sin(angles)])
        elif self.kind == "vertices":
            corners = corners_of_points(self.params[0])
        else:
            corners = corners_of_halfspaces(*self.params)
        return frozen_array(in_order(corners))

    @cached_property
    def faces(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (F, d) and offsets (F,), one row per face."""
        if self.kind == "box":
            identity, half = np.eye(self.dim), self.params[0] / 2
            normals, offsets = np.concatenate([identity, -identity]), np.concatenate([half, half])
        elif self.kind == "l1":
            normals = np.array(list(product((1.0, -1.0), repeat=self.dim))) / np.sqrt(self.dim)
            offsets = np.full(len(normals), float(self.params[0]) / np.sqrt(self.dim))
        else:
            normals, offsets = faces_of(self.vertices)
        return frozen_array(normals), frozen_array(offsets)

    @property
    def normals(self) -> np.ndarray:
        """(F, d) unit outward normals."""
        return self.faces[0]

    @property
    def offsets(self) -> np.ndarray:
        """(F,) with normals x <= offsets inside."""
        return self.faces[1]

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest value (d,) of every coordinate."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def clearance(self, points: np.ndarray) -> np.ndarray:
        """Return max_p (a_p x - b_p) for ``points`` (..., d); negative inside."""
        return (points @ self.normals.T - self.offsets).max(axis=-1)

    def support(self, directions: np.ndarray) -> np.ndarray:
        """Return the maximum over the set of direction . x, for ``directions`` (..., d)."""
        return (directions @ self.vertices.T).max(axis=-1)


def collision_set(own: Polytope, other: Polytope) -> Polytope:
    """K = other + (-own): the values of r_own - r_other at which the two bodies overlap.

    Raises
    ------
    InputError
        If the sum is flat (two bodies without volume can never be said to collide).
    """
    sums = (other.vertices[:, None, :] - own.vertices[None, :, :]).reshape(-1, other.dim)
    return Polytope.from_vertices(sums)


def _finite(values: Any, name: str, remedy: str) -> np.ndarray:
    try:
        array = numbers(values)
    except ValueError:
        raise InputError("", f"has {name} not made of numbers", f"write {remedy}") from None
    require(
        bool(np.isfinite(array).all()),
        "",
        f"has {name} with an entry that is not a finite number",
        f"write {remedy}",
    )
    return array


def _whole(value: Any, least: int, most: int, what: str) -> None:
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    require(
        whole and least <= value <= most,
        "",
        f"has {value!r:.40} {what}",
        f"give a whole number from {least} to {most}",
    )


def _radius(radius: Any) -> np.ndarray:
    array = _finite(radius, "a radius", "one positive number")
    require(
        array.ndim == 0 and float(array) > 0,
        "",
        f"has radius {radius!r:.40}",
        "write one positive number",
    )
    return frozen_array(array)


def _shape(array: np.ndarray) -> str:
    return "x".join(str(size) for size in array.shape) or "a single number"
