r"""Bounded convex polytopes: the shapes, control sets, obstacles and collision sets of a game.

A polytope keeps the arguments of its constructor (``kind`` and ``params``), so that a game file
survives a round trip; both descriptions are derived from them on first use:

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

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.flat_sets import Frame, frame_of_points
from ppg_env.game.hulls import corners_of_halfspaces, corners_of_points, faces_of, in_order
from ppg_env.support.frozen import Record, frozen_array
from ppg_env.support.validation import finite_array, is_whole, require_size, shape_text

MOST_SIDES, MOST_AXES = 360, 10
"""Most sides of a regular polygon, and most dimensions of a polytope: a body with more faces is too
large to plan with."""


@dataclass(frozen=True, eq=False)
class Polytope(Record):
    """A bounded convex polytope in d dimensions; build it with one of the constructors.

    The constructors refuse, with :class:`~ppg_env.InputError`, a set that is empty or unbounded,
    that is narrower than ``tol.SMALLEST`` or reaches beyond ``tol.LARGEST``.  A set may be flat:
    a box may have sides of zero, and points may lie on a line or coincide.

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
        """Return {x : |x_k| <= sides_k / 2}; ``sides`` (d,) are full lengths, zero allowed."""
        remedy = "write one non-negative length per axis, such as [15.0, 15.0]"
        array = finite_array(sides, "", remedy)
        require(
            array.ndim == 1 and array.size > 0 and bool((array >= 0).all()),
            "",
            f"has sides {array.tolist()!s:.40}",
            remedy,
        )
        _check_dim(array.size)
        if array.any():
            _check_width(float(array[array > 0].min()), float(array.max()))
        return cls("box", (array,))

    @classmethod
    def l1(cls, radius: float, dim: int = 2) -> Polytope:
        """Return {x : |x_1| + ... + |x_d| <= radius}, in ``dim`` dimensions."""
        _check_whole(dim, 1, MOST_AXES, "dimensions")
        return cls("l1", (_checked_radius(radius), frozen_array(dim)))

    @classmethod
    def disc(cls, radius: float, sides: int = 16) -> Polytope:
        """Return the regular polygon with ``sides`` corners on a circle, one at x = radius."""
        _check_whole(sides, 3, MOST_SIDES, "sides")
        return cls("disc", (_checked_radius(radius), frozen_array(sides)))

    @classmethod
    def from_vertices(cls, vertices: Any) -> Polytope:
        """Return conv(vertices) of ``vertices`` (V, d) in convex position, in any order.

        Repeated points and points on edges or faces are allowed, a point strictly inside is not.
        """
        remedy = "write a list of points such as [[0, 0], [1, 0], [0, 1]]"
        array = finite_array(vertices, "vertices", remedy)
        require(
            array.ndim == 2 and array.size > 0,
            "",
            f"has vertices of shape {shape_text(array)}",
            "write a list of points, each with the same number of coordinates",
        )
        _check_dim(array.shape[1])
        polytope = cls("vertices", (array,))._checked()
        polytope._check_convex_position()
        return polytope

    @classmethod
    def from_halfspaces(cls, normals: Any, offsets: Any) -> Polytope:
        """Return {x : normals x <= offsets} of ``normals`` (F, d) and ``offsets`` (F,)."""
        rows = finite_array(normals, "normals", "write one row of numbers per half-plane")
        limits = finite_array(offsets, "offsets", "write one number per half-plane")
        require(
            rows.ndim == 2 and limits.shape == rows.shape[:1] and rows.size > 0,
            "",
            f"has normals of shape {shape_text(rows)} and offsets of shape {shape_text(limits)}",
            "write one normal and one offset per half-plane",
        )
        _check_dim(rows.shape[1])
        shortest = float(np.linalg.norm(rows, axis=1).min())
        require(
            shortest >= 1 / tol.LARGEST,
            "normals",
            f"has a normal of length {shortest:.4g}, too short to give a direction",
            "scale that normal and its offset up, or remove the half-plane",
        )
        return cls("halfspaces", (rows, limits))._checked()

    def _checked(self) -> Polytope:
        """Return self, after both descriptions are derived and found to be wide enough."""
        widths = self.offsets + self.support(-self.normals)
        if self._frame is not None:  # the last faces are across a flat set
            widths = widths[: len(widths) - 2 * self._frame[1].shape[1]]
        reach = float(np.abs(self.vertices).max())
        _check_width(float(widths.min(initial=np.inf)), reach)
        return self

    def _check_convex_position(self) -> None:
        points = self.params[0]
        depths = (self.offsets - points @ self.normals.T).min(axis=1)
        deepest = int(depths.argmax())
        inside = float(depths[deepest])
        if inside > tol.INSIDE * float(np.ptp(points, axis=0).max()):
            polygon = ", or write polygon = [...] for an obstacle that is not convex"
            raise InputError(
                "vertices",
                f"are not in convex position: {points[deepest].tolist()!s:.60} lies {inside:.4g} "
                "inside the hull of the others",
                "remove it" + (polygon if self.dim == 2 else ""),
            )

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
    def _frame(self) -> Frame | None:
        """Frame of a flat set given by points or half-spaces; None for a solid set."""
        return frame_of_points(self.params[0] if self.kind == "vertices" else self.vertices)

    @property
    def is_flat(self) -> bool:
        """Whether the set has no volume."""
        if self.kind == "box":
            return not self.params[0].all()
        return self.kind in ("vertices", "halfspaces") and self._frame is not None

    @property
    def directions(self) -> np.ndarray:
        """(d, k) orthonormal directions along the set: all d of them unless it is flat."""
        if self.kind == "box":
            return np.eye(self.dim)[:, self.params[0] > 0]
        return self._frame[0] if self.is_flat and self._frame else np.eye(self.dim)

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
            corners = corners_of_points(self.params[0], self._frame)
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
            normals, offsets = faces_of(self.vertices, self._frame)
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
    """Return K = other + (-own), the values of r_own - r_other at which the two bodies overlap.

    Raises
    ------
    InputError
        If the sum is flat (two bodies without volume cannot collide), or too thin for its size.
    """
    sums = (other.vertices[:, None, :] - own.vertices[None, :, :]).reshape(-1, other.dim)
    collision = Polytope("vertices", (sums,))
    require_volume(collision)
    _ = collision.faces  # corners that qhull cannot separate are reported here
    return collision


def require_volume(polytope: Polytope) -> None:
    """Refuse a flat set of points or half-spaces; a box may have sides of zero."""
    require(
        polytope.kind == "box" or not polytope.is_flat,
        "",
        "has corners that lie in a plane or on a line, so its volume is zero",
        f"give at least {polytope.dim + 1} points in general position",
    )


def _check_width(width: float, reach: float, what: str = "width") -> None:
    """Refuse a polytope too thin for the tolerances; ``reach`` is its largest coordinate."""
    require_size(reach, "")
    least = max(tol.SMALLEST, tol.FLAT * reach)
    require(
        width >= least,
        "",
        f"has the {what} {width:.4g}, too small for double arithmetic",
        f"choose a unit of length in which it is at least {least:.4g}",
    )


def _check_dim(dim: int) -> None:
    require(dim <= MOST_AXES, "", f"has {dim} dimensions", f"use at most {MOST_AXES}")


def _check_whole(value: Any, least: int, most: int, what: str) -> None:
    whole = is_whole(value)
    require(
        whole and least <= value <= most,
        "",
        f"has {value!r:.40} {what}",
        f"give a whole number from {least} to {most}",
    )


def _checked_radius(radius: Any) -> np.ndarray:
    remedy = "write one positive number"
    array = finite_array(radius, "", remedy)
    require(array.ndim == 0 and float(array) > 0, "", f"has radius {radius!r:.40}", remedy)
    _check_width(float(array), float(array), "radius")
    return array
