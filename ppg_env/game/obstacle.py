"""Obstacles: bodies that do not decide, at rest or on a path that is known in advance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env.errors import require
from ppg_env.game.polytope import Polytope, require_volume
from ppg_env.support.frozen import Record
from ppg_env.support.validation import covariance, finite_array, is_whole


@dataclass(frozen=True, eq=False)
class Obstacle(Record):
    """A polytope at rest, or one that moves along a path: an agent whose plan is fixed.

    Attributes
    ----------
    shape : the body; with a path, around its reference position.
    path : (K, d) reference positions at times 0, 1, ..., of which the last holds without end;
        None for an obstacle at rest.
    noise : (d, d) covariance added at every step; a number s stands for s I.
    until : time from which the obstacle is gone; None if it stays.

    Raises
    ------
    InputError
        If a field does not fit the shape.
    """

    shape: Polytope
    path: np.ndarray | None = None
    noise: np.ndarray = 0.0  # type: ignore[assignment]  # __post_init__ makes a matrix
    until: int | None = None

    def __post_init__(self) -> None:
        require(
            isinstance(self.shape, Polytope),
            "",
            "is not a polytope",
            "give a Polytope, such as Polytope.box([15.0, 15.0])",
        )
        require_volume(self.shape)
        if self.path is not None:
            object.__setattr__(self, "path", _checked_path(self.path, self.dim))
        object.__setattr__(self, "noise", covariance(self.noise, self.dim, "noise"))
        require(
            self.path is not None or not np.any(self.noise),
            "noise",
            "is given for an obstacle without a path",
            "add a path, or remove the noise",
        )
        whole = is_whole(self.until)
        require(
            self.until is None or (whole and self.until >= 1),
            "until",
            f"is {self.until!r:.40}",
            "write the time at which the obstacle is gone, a whole number from 1",
        )

    @property
    def dim(self) -> int:
        """Number d of position components."""
        return self.shape.dim

    @property
    def rest(self) -> int:
        """First time from which the obstacle stays where it is."""
        return 0 if self.path is None else len(self.path) - 1

    def positions(self, horizon: int) -> np.ndarray:
        """Return (H+1, d) mean reference positions; zeros for an obstacle at rest."""
        if self.path is None:
            return np.zeros((horizon + 1, self.dim))
        return self.path[np.minimum(np.arange(horizon + 1), self.rest)]

    def covariances(self, horizon: int) -> np.ndarray:
        """Return (H+1, d, d) covariances of the position, which stop growing at rest."""
        steps = np.minimum(np.arange(horizon + 1), self.rest)
        return steps[:, None, None] * self.noise

    def vertices_at(self, time: int) -> np.ndarray:
        """Return (V, d) the corners at a time, for drawing."""
        if self.path is None:
            return self.shape.vertices
        return self.shape.vertices + self.path[min(time, self.rest)]


def _checked_path(value: Any, dim: int) -> np.ndarray:
    remedy = f"write one point of {dim} numbers per time, from time 0"
    path = finite_array(value, "path", remedy)
    require(
        path.ndim == 2 and len(path) > 0 and path.shape[1] == dim,
        "path",
        "is not a list of points",
        remedy,
    )
    return path
