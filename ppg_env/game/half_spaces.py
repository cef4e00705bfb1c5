"""Sets of states given by half-spaces, bounded or not: where an agent's mean has to stay."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.polytope import Polytope
from ppg_env.support.frozen import Record, frozen_array
from ppg_env.support.validation import finite_array, finite_number, numbers, shape_text


@dataclass(frozen=True, eq=False)
class HalfSpaces(Record):
    """The set { x : normals x <= offsets }, of positions or of whole states.

    It need not be bounded: speed limits bound velocities alone.

    Attributes
    ----------
    normals, offsets : (R, k) unit normals and (R,) offsets.
    sigmas : number z of standard deviations by which a mean stays clear of the faces.

    Raises
    ------
    InputError
        If sizes differ, a normal is zero, or ``sigmas`` is negative.
    """

    normals: np.ndarray
    offsets: np.ndarray
    sigmas: float = 0.0

    def __post_init__(self) -> None:
        rows = finite_array(self.normals, "normals", "write one row of numbers per half-space")
        limits = finite_array(self.offsets, "offsets", "write one number per half-space")
        require(
            rows.ndim == 2 and limits.shape == rows.shape[:1] and rows.size > 0,
            "",
            f"has normals of shape {shape_text(rows)} and offsets of shape {shape_text(limits)}",
            "write one normal and one offset per half-space",
        )
        lengths = np.linalg.norm(rows, axis=1)
        require(
            float(lengths.min()) >= 1 / tol.LARGEST,
            "normals",
            f"has a normal of length {float(lengths.min()):.4g}",
            "give every half-space a direction",
        )
        sigmas = finite_number(self.sigmas, "sigmas", "write a number such as 2.0")
        require(sigmas >= 0, "sigmas", f"is {sigmas:g}", "write a number that is not negative")
        # A normal of unit length stays as it is, so that a copy equals its original.
        lengths = np.where(np.abs(lengths - 1) <= tol.FACE, 1.0, lengths)
        object.__setattr__(self, "normals", frozen_array(rows / lengths[:, None]))
        object.__setattr__(self, "offsets", frozen_array(limits / lengths))
        object.__setattr__(self, "sigmas", sigmas)

    @classmethod
    def of(cls, polytope: Polytope, sigmas: float = 0.0) -> HalfSpaces:
        """Return the faces of a polytope as half-spaces."""
        return cls(polytope.normals, polytope.offsets, sigmas)

    @classmethod
    def between(cls, low: Any, high: Any, sigmas: float = 0.0) -> HalfSpaces:
        """Return { x : low <= x <= high }; an infinite limit of ``low`` or ``high`` (k,) is none.

        Raises
        ------
        InputError
            If the limits are not two lists of the same length, or no limit is finite.
        """
        remedy = "write two lists of as many numbers, low below high, inf for no limit"
        try:
            limits = [numbers(value) for value in (low, high)]
        except ValueError:
            raise InputError("", "has low or high that are not made of numbers", remedy) from None
        require(
            limits[0].ndim == 1 and limits[0].shape == limits[1].shape,
            "",
            "has low and high that are not lists of the same length",
            remedy,
        )
        require(bool((limits[0] < limits[1]).all()), "", "has a low that is not below high", remedy)
        identity = np.eye(limits[0].size)
        normals = np.concatenate([identity, -identity])
        offsets = np.concatenate([limits[1], -limits[0]])
        finite = np.isfinite(offsets)
        require(bool(finite.any()), "", "has no finite limit", remedy)
        return cls(normals[finite], offsets[finite], sigmas)

    @property
    def dim(self) -> int:
        """Number of components k."""
        return self.normals.shape[1]
