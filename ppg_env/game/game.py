"""The game as data: agents, static obstacles, and how time and safety are counted.

Agent i moves by  x_{t+1} = A x_t + B u_t + w_t,  w_t ~ N(0, noise),  and corrects its errors by
u = ubar - gain (x - xbar).  The first d components of x are its reference position, d being the
dimension of its shape; it overlaps agent j iff (x_i - x_j)[:d] lies in K_ij = C_j + (-C_i).

Nothing here plans, simulates or draws: whatever does so is built from a :class:`Game`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, placed, require
from ppg_env.game.input_sets import Controls, checked_controls, pieces, set_at
from ppg_env.game.polytope import Polytope, collision_set
from ppg_env.support.frozen import Record
from ppg_env.support.validation import (
    covariance,
    finite_array,
    finite_number,
    matrix,
    scalar_or_matrix,
)

OBJECTIVES = ("margin", "risk")
SCALES = ("exact", "paper")


class SpectralRadiusWarning(UserWarning):
    """The gain does not shrink an agent's position errors."""


@dataclass(frozen=True, eq=False)
class Agent(Record):
    """One mover.  n: state, m: control, d <= n: position components.

    Attributes
    ----------
    start : (n,) state at time 0.
    goal : (n,) or (d,) where the mean must arrive: the whole state, or its position only.
    lam : weight of time against safety, 0 <= lam < 1; lower means that safety matters more.
    gain : (m, n) feedback u = ubar - gain (x - xbar); a number k stands for k I.
    shape : body around the reference position, a polytope in d dimensions.
    control : polytope of admissible inputs, in m dimensions; or, where it changes over time, pairs
        of a step and the polytope that holds from it on: ((0, slow), (5, fast)).  The last one
        holds for ever.  See :meth:`control_at`.
    noise : (n, n) covariance added at every step; a number s stands for s I.
    A, B : (n, n) and (n, m) dynamics; identities unless given.
    sigma0 : (n, n) covariance at time 0; zero unless given.
    name : for tables and pictures; ``agent_<i>`` unless given.
    """

    start: np.ndarray
    goal: np.ndarray
    shape: Polytope
    control: Controls
    lam: float = 0.5
    # Numbers and None stand for the matrices that __post_init__ puts in their place.
    gain: np.ndarray = 0.0  # type: ignore[assignment]
    noise: np.ndarray = 1.9  # type: ignore[assignment]
    A: np.ndarray = None  # type: ignore[assignment]
    B: np.ndarray = None  # type: ignore[assignment]
    sigma0: np.ndarray = 0.0  # type: ignore[assignment]
    name: str | None = None

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - frozen
        start = finite_array(
            self.start, "start", "write one number per state, such as [10.0, 50.0]"
        )
        require(
            start.ndim == 1 and start.size > 0,
            "start",
            "is not a list of numbers",
            "write one number per state, such as [10.0, 50.0]",
        )
        put("start", start)
        n = start.size
        require(
            isinstance(self.shape, Polytope),
            "shape",
            "is not a polytope",
            "give a Polytope, such as Polytope.box([15.0, 15.0])",
        )
        put("control", checked_controls(self.control))
        put("A", matrix(np.eye(n) if self.A is None else self.A, (n, n), "A"))
        m = self.control_dim
        if self.B is None:
            require(
                m == n,
                "control",
                f"has dimension {m} where the state has {n}",
                f"give inputs of dimension {n}, or a matrix B of {n} rows",
            )
        put("B", matrix(np.eye(n) if self.B is None else self.B, (n, m), "B"))
        put("gain", scalar_or_matrix(self.gain, (m, n), "gain"))
        put("noise", covariance(self.noise, n, "noise"))
        put("sigma0", covariance(self.sigma0, n, "sigma0"))
        d = self.shape.dim
        require(
            d <= n,
            "shape",
            f"has dimension {d} where the state has {n}",
            "give a shape in the space of the first state components",
        )
        goal = finite_array(self.goal, "goal", f"write {n} numbers, as in start")
        require(
            goal.shape in ((n,), (d,)),
            "goal",
            f"has {goal.size} numbers where start has {n}",
            f"write {n} numbers, as in start",
        )
        put("goal", goal)
        lam = finite_number(self.lam, "lam", "write a number with 0 <= lam < 1")
        require(0 <= lam < 1, "lam", f"is {lam:g}", "write a number with 0 <= lam < 1")
        put("lam", lam)
        require(
            self.name is None or (isinstance(self.name, str) and bool(self.name.strip())),
            "name",
            "is not a text",
            "write a short name in quotes",
        )
        self._warn_of_growing_errors()

    def _warn_of_growing_errors(self) -> None:
        radius = self.spectral_radius
        if radius < 1 - tol.RADIUS:
            return
        if radius <= 1 + tol.RADIUS:
            what = "position errors are never corrected and keep adding up"
        else:
            what = (
                "position errors grow at every step; feedback is u = ubar - gain (x - xbar), "
                "so a correcting gain is positive (gain = 0.5 is what the paper means)"
            )
        # No stack level fits both a script and a game file, so the text names the values.
        warnings.warn(
            f"the spectral radius of A - B*gain is {radius:.6g}: {what}.",
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
        """The set U_t of admissible inputs at a step t."""
        return set_at(self.control, step)

    @property
    def closed_loop(self) -> np.ndarray:
        """(n, n) error dynamics A - B gain."""
        return self.A - self.B @ self.gain

    @property
    def spectral_radius(self) -> float:
        """Largest absolute eigenvalue of the error dynamics; below 1 errors shrink."""
        return float(np.abs(np.linalg.eigvals(self.closed_loop)).max())


@dataclass(frozen=True, eq=False)
class Game(Record):
    """A path planning game; build one with :func:`ppg_env.make_game` or by hand.

    Attributes
    ----------
    agents : the movers, one or more, all in the same d dimensions.
    obstacles : static polytopes in d dimensions.
    horizon : last step H; times are 0..H.
    objective : ``margin`` (the paper's) or ``risk`` (expected crash cost).
    margin_cap : cap M' on margins; 3 for ``margin`` and 5 for ``risk`` unless given.
    crash_cost : kappa, what a crash costs in ``risk`` and in the environment's reward.
    scale : ``exact``, or ``paper`` to reproduce the paper's missing sqrt(2).
    name : the scenario's or file's name, for tables.
    """

    agents: tuple[Agent, ...]
    obstacles: tuple[Polytope, ...] = ()
    horizon: int = 15
    objective: str = "margin"
    margin_cap: float = None  # type: ignore[assignment]  # the objective's default is put here
    crash_cost: float = 100.0
    scale: str = "exact"
    name: str | None = None

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731 - frozen
        put("agents", _tuple_of(Agent, self.agents, "agent"))
        put("obstacles", _tuple_of(Polytope, self.obstacles, "obstacle"))
        require(bool(self.agents), "agent", "is missing", "describe at least one agent")
        whole = isinstance(self.horizon, (int, np.integer)) and not isinstance(self.horizon, bool)
        require(
            whole and 1 <= self.horizon <= 10_000,
            "horizon",
            f"is {self.horizon!r}",
            "write a whole number of steps from 1 to 10000",
        )
        put("horizon", int(self.horizon))
        for key, allowed in (("objective", OBJECTIVES), ("scale", SCALES)):
            value = getattr(self, key)
            require(
                isinstance(value, str) and value in allowed,
                key,
                f"is {value!r}",
                "write " + " or ".join(repr(word) for word in allowed),
            )
        cap = {"margin": 3.0, "risk": 5.0}[self.objective]
        cap = cap if self.margin_cap is None else self.margin_cap
        cap = finite_number(cap, "margin_cap", "write a positive number such as 3.0")
        # Above 26 the crash risk (1 - erf s)/2 is zero in double precision.
        require(0 < cap <= 26, "margin_cap", f"is {cap:g}", "write a positive number up to 26")
        put("margin_cap", cap)
        cost = finite_number(self.crash_cost, "crash_cost", "write a number such as 100.0")
        require(cost >= 0, "crash_cost", f"is {cost:g}", "write a number that is not negative")
        put("crash_cost", cost)
        require(
            self.name is None or isinstance(self.name, str),
            "name",
            "is not a text",
            "write it in quotes",
        )
        self._check_space()

    def _check_space(self) -> None:
        for i, agent in enumerate(self.agents):
            require(
                agent.dim == self.dim,
                f"agent[{i}].shape",
                f"has dimension {agent.dim} where agent[0] has {self.dim}",
                "give every agent and obstacle the same dimension",
            )
        for k, obstacle in enumerate(self.obstacles):
            require(
                obstacle.dim == self.dim,
                f"obstacle[{k}]",
                f"has dimension {obstacle.dim} where agent[0].shape has {self.dim}",
                "give every agent and obstacle the same dimension",
            )
        repeated = {name for name in self.agent_names if self.agent_names.count(name) > 1}
        require(
            not repeated,
            "agent",
            f"has the name {min(repeated, default='')!r} twice",
            "give each agent a name of its own",
        )
        for pair in self.encounters:
            gap = pair.collision.clearance(
                pair.displacement(*(self.agents[k].start[: self.dim] for k in pair.agents))
            )
            if gap < -tol.LENGTH:
                first, other = self.place_names(pair)
                raise InputError(
                    f"{first}.start",
                    f"overlaps {other} at time 0 by {-gap:.4g}",
                    "move one of them away",
                )

    @property
    def dim(self) -> int:
        """Number d of position components."""
        return self.agents[0].dim

    @property
    def agent_names(self) -> tuple[str, ...]:
        """Names for tables and pictures."""
        return tuple(agent.name or f"agent_{i}" for i, agent in enumerate(self.agents))

    @cached_property
    def encounters(self) -> tuple[Encounter, ...]:
        """Everything that can collide: each unordered pair of agents, then each agent with each
        obstacle.  All margins and losses are listed in this order.
        """
        return tuple(self._encounters())

    def _encounters(self) -> Iterator[Encounter]:
        agents = self.agents
        for i in range(len(agents)):
            for j in range(i + 1, len(agents)):
                with placed(f"agent[{j}].shape"):
                    collision = collision_set(agents[i].shape, agents[j].shape)
                yield Encounter((i, j), None, collision)
        for i, agent in enumerate(agents):
            for k, obstacle in enumerate(self.obstacles):
                with placed(f"obstacle[{k}]"):
                    collision = collision_set(agent.shape, obstacle)
                yield Encounter((i,), k, collision)

    def place_names(self, encounter: Encounter) -> tuple[str, str]:
        """Who meets whom, in the words of error messages."""
        other = (
            f"agent[{encounter.agents[1]}].start"
            if encounter.obstacle is None
            else f"obstacle[{encounter.obstacle}]"
        )
        return f"agent[{encounter.agents[0]}]", other


@dataclass(frozen=True)
class Encounter:
    """Two bodies that must not overlap.

    Attributes
    ----------
    agents : (i, j) with i < j, or (i,) with an obstacle.
    obstacle : index of the obstacle, None for a pair of agents.
    collision : K, the displacements at which they overlap.
    """

    agents: tuple[int, ...]
    obstacle: int | None
    collision: Polytope

    def displacement(self, *positions: np.ndarray) -> np.ndarray:
        """r_i - r_j of a pair's positions (..., d); r_i itself where j is an obstacle."""
        return positions[0] - positions[1] if len(positions) == 2 else positions[0]


def _tuple_of(kind: type, items: Any, place: str) -> tuple[Any, ...]:
    listed = tuple(items) if isinstance(items, (list, tuple)) else (items,)
    for k, item in enumerate(listed):
        if not isinstance(item, kind):  # only then: the words for it are long in the making
            raise InputError(
                f"{place}[{k}]",
                f"is {item!r:.40}, not one of {kind.__name__}",
                f"give a list of {kind.__name__}",
            )
    return listed


def override(record: Any, **changes: Any) -> Any:
    """``dataclasses.replace`` for a :class:`Game` or :class:`Agent`, checked anew."""
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return type(record)(**(values | changes))
