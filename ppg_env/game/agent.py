"""One agent: its dynamics, feedback, noise, body, goal and admissible inputs."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import placed, require
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import Controls, checked_controls, pieces, set_at
from ppg_env.game.polytope import Polytope, require_volume
from ppg_env.game.units import unit_of_control, unit_of_size, units_of_state
from ppg_env.support.frozen import Record
from ppg_env.support.names import require_name
from ppg_env.support.validation import (
    covariance,
    finite_array,
    finite_number,
    matrix,
    scalar_or_matrix,
)


class SpectralRadiusWarning(UserWarning):
    """The closed loop does not shrink an agent's position errors."""


@dataclass(frozen=True, eq=False)
class Agent(Record):
    """One agent, with n state, m control and d <= n position components.

    Attributes
    ----------
    start : (n,) state at time 0.
    goal : (n,) or (d,) where the mean must arrive: the whole state, or its position only.
    lam : weight of time against safety, 0 <= lam < 1; lower means that safety matters more.
    gain : (m, n) feedback u = ubar - gain (x - xbar); a number k stands for k I.
    shape : body around the reference position, a polytope in d dimensions.
    control : polytope of admissible inputs, in m dimensions; or, where it changes over time, pairs
        of a step and the polytope that holds from that step: ((0, slow), (5, fast)).  The last
        one holds without end.  See :meth:`control_at`.
    noise : (n, n) covariance added at every step; a number s stands for s I.
    A, B : (n, n) and (n, m) dynamics; identities by default.
    sigma0 : (n, n) covariance at time 0; zero by default.
    within : sets, of positions or of whole states, in which the mean stays up to its arrival, each
        clear of its faces by so many standard deviations (:class:`HalfSpaces`).
    reserve : number z of standard deviations of feedback for which nominal controls leave room
        (:mod:`ppg_env.game.reserve`).
    effort : cost w of the sum of ``|u_t|_1``, added to the agent's own cost.
    name : name in tables and figures; ``agent_<i>`` by default.

    Raises
    ------
    InputError
        If a field does not fit the others, or holds a number too large, or a covariance too
        small, for double arithmetic (:mod:`ppg_env.tolerances`).
    """

    start: np.ndarray
    goal: np.ndarray
    shape: Polytope
    control: Controls
    lam: float = 0.5
    # __post_init__ replaces numbers and None by matrices.
    gain: np.ndarray = 0.0  # type: ignore[assignment]  # __post_init__ makes a matrix
    noise: np.ndarray = 1.9  # type: ignore[assignment]  # __post_init__ makes a matrix
    A: np.ndarray = None  # type: ignore[assignment]  # __post_init__ makes a matrix
    B: np.ndarray = None  # type: ignore[assignment]  # __post_init__ makes a matrix
    sigma0: np.ndarray = 0.0  # type: ignore[assignment]  # __post_init__ makes a matrix
    within: tuple[HalfSpaces, ...] = ()
    reserve: float = 0.0
    effort: float = 0.0
    name: str | None = None

    def __post_init__(self) -> None:
        self._put("start", _checked_start(self.start))
        require(
            isinstance(self.shape, Polytope),
            "shape",
            "is not a polytope",
            "give a Polytope, such as Polytope.box([15.0, 15.0])",
        )
        with placed("shape"):
            require_volume(self.shape)
        self._put("control", checked_controls(self.control))
        self._put_matrices(self.state_dim, self.control_dim)
        self._put("goal", _checked_goal(self.goal, self.state_dim, self.dim))
        self._put("lam", _checked_lam(self.lam))
        self._put("within", _checked_within(self.within, self.dim, self.state_dim))
        for key in ("reserve", "effort"):
            value = finite_number(getattr(self, key), key, "write a number such as 2.0")
            require(value >= 0, key, f"is {value:g}", "write a number that is not negative")
            self._put(key, value)
        if self.name is not None:
            require_name(self.name, "name")
        self._warn_of_growing_errors()

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)  # the dataclass is frozen

    def _put_matrices(self, n: int, m: int) -> None:
        self._put("A", matrix(np.eye(n) if self.A is None else self.A, (n, n), "A"))
        require(
            self.B is not None or m == n,
            "control",
            f"has dimension {m} where the state has {n}",
            f"give inputs of dimension {n}, or a matrix B of {n} rows",
        )
        self._put("B", matrix(np.eye(n) if self.B is None else self.B, (n, m), "B"))
        self._put("gain", scalar_or_matrix(self.gain, (m, n), "gain"))
        self._put("noise", covariance(self.noise, n, "noise"))
        self._put("sigma0", covariance(self.sigma0, n, "sigma0"))

    def _warn_of_growing_errors(self) -> None:
        radius = self.spectral_radius
        if radius < 1 - tol.RADIUS:
            return
        if radius <= 1 + tol.RADIUS:
            consequence = "position errors are never corrected and keep adding up"
        else:
            consequence = (
                "position errors grow at every step; feedback is u = ubar - gain (x - xbar), "
                "so a correcting gain is positive (gain = 0.5 is what the paper means)"
            )
        # No stack level fits both a script and a game file, so the text states the values.
        warnings.warn(
            f"the spectral radius of A - B*gain is {radius:.6g}: {consequence}.",
            SpectralRadiusWarning,
            stacklevel=2,
        )

    @property
    def state_dim(self) -> int:
        """Number n of state components."""
        return self.start.size

    @property
    def control_dim(self) -> int:
        """Number m of control components."""
        return pieces(self.control)[0][1].dim

    @property
    def dim(self) -> int:
        """Number d of position components."""
        return self.shape.dim

    def control_at(self, step: int) -> Polytope:
        """Return the set U_t of admissible inputs at step t."""
        return set_at(self.control, step)

    @cached_property
    def unit(self) -> float:
        """Unit of length in which tolerances hold, 1 for bodies of usual size."""
        low, high = self.shape.bounds
        size = float((high - low).max())
        if size == 0:
            size = float(np.abs(self.goal[: self.dim] - self.start[: self.dim]).max())
        return unit_of_size(size)

    @cached_property
    def state_units(self) -> np.ndarray:
        """(n,) units of the state components."""
        return units_of_state(self.A, self.dim, self.unit)

    @cached_property
    def control_unit(self) -> float:
        """Unit of the controls."""
        return unit_of_control(self.B, self.state_units)

    @property
    def closed_loop(self) -> np.ndarray:
        """(n, n) error dynamics A - B gain."""
        return self.A - self.B @ self.gain

    @property
    def spectral_radius(self) -> float:
        """Largest absolute eigenvalue of the error dynamics; below 1 errors shrink."""
        return float(np.abs(np.linalg.eigvals(self.closed_loop)).max())


def _checked_start(value: Any) -> np.ndarray:
    remedy = "write one number per state, such as [10.0, 50.0]"
    start = finite_array(value, "start", remedy)
    require(start.ndim == 1 and start.size > 0, "start", "is not a list of numbers", remedy)
    return start


def _checked_goal(value: Any, n: int, d: int) -> np.ndarray:
    require(
        d <= n,
        "shape",
        f"has dimension {d} where the state has {n}",
        "give a shape in the space of the first state components",
    )
    remedy = f"write {n} numbers, as in start"
    goal = finite_array(value, "goal", remedy)
    require(
        goal.shape in ((n,), (d,)), "goal", f"has {goal.size} numbers where start has {n}", remedy
    )
    return goal


def _checked_lam(value: Any) -> float:
    lam = finite_number(value, "lam", "write a number with 0 <= lam < 1")
    require(0 <= lam < 1, "lam", f"is {lam:g}", "write a number with 0 <= lam < 1")
    require(
        lam <= (1 - lam) * tol.HEAVIEST,
        "lam",
        f"is {lam!r}, too close to 1 for double arithmetic",
        f"keep lam / (1 - lam) within {tol.HEAVIEST:g}",
    )
    return lam


def _checked_within(value: Any, d: int, n: int) -> tuple[HalfSpaces, ...]:
    regions = tuple(value) if isinstance(value, (list, tuple)) else (value,)
    for k, region in enumerate(regions):
        place = f"within[{k}]" if len(regions) > 1 else "within"
        require(
            isinstance(region, HalfSpaces),
            place,
            "is not a set of half-spaces",
            "give HalfSpaces.between(low, high), or a list of such sets",
        )
        require(
            region.dim in (d, n),
            place,
            f"has dimension {region.dim}",
            f"bound the {d} position components, or all {n} components of the state",
        )
    return regions
