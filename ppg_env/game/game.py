"""The game as data: agents, obstacles, and how time and safety are counted.

Agent i moves by  x_{t+1} = A x_t + B u_t + w_t,  w_t ~ N(0, noise),  and corrects its errors by
u = ubar - gain (x - xbar).  The first d components of x are its reference position, d being the
dimension of its shape; it overlaps agent j iff (x_i - x_j)[:d] lies in K_ij = C_j + (-C_i).

Bodies must keep apart at the time steps only (``collisions="instants"``, the paper's rule), or on
the straight lines between them too (``"swept"``).  An arrived body leaves (``on_goal="remove"``,
the paper's rule), or stays parked and in the way (``"stay"``).

Planners, simulators and figures are built from a :class:`Game`; this module contains none.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, require
from ppg_env.game.agent import Agent
from ppg_env.game.checks import check_agents, check_encounters
from ppg_env.game.encounter import Encounter, all_encounters
from ppg_env.game.input_sets import LONGEST_HORIZON
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from ppg_env.support.frozen import Record
from ppg_env.support.names import require_name
from ppg_env.support.validation import finite_number, is_whole

OBJECTIVES = ("margin", "risk")
SCALES = ("exact", "paper")
COLLISIONS = ("instants", "swept")
ON_GOAL = ("remove", "stay")
CHOICES = {
    "objective": OBJECTIVES,
    "scale": SCALES,
    "collisions": COLLISIONS,
    "on_goal": ON_GOAL,
}

WIDEST_CAP = 26.0
"""Above it the crash risk (1 - erf s)/2 is zero in double precision."""


@dataclass(frozen=True, eq=False)
class Game(Record):
    """A path planning game; build one with :func:`ppg_env.make_game` or by hand.

    Attributes
    ----------
    agents : one or more agents, all in the same d dimensions.
    obstacles : obstacles in d dimensions; a polytope stands for an obstacle at rest.
    horizon : last step H; times are 0..H.
    objective : ``margin`` (the paper's) or ``risk`` (expected crash cost).
    margin_cap : cap M' on margins; by default 3 for ``margin`` and 5 for ``risk``.
    crash_cost : kappa, the cost of a crash in ``risk`` and in the environment's reward.
    scale : ``exact``, or ``paper`` to reproduce the paper's missing sqrt(2).
    collisions : ``instants`` (bodies keep apart at the time steps) or ``swept`` (and between them).
    on_goal : ``remove`` (an arrived body leaves) or ``stay`` (it is parked, and in the way).
    name : name of the scenario or file, for tables.

    Raises
    ------
    InputError
        If a field is not valid, or the parts do not fit (:mod:`ppg_env.game.checks`).
    """

    agents: tuple[Agent, ...]
    obstacles: tuple[Obstacle, ...] = ()
    horizon: int = 15
    objective: str = "margin"
    margin_cap: float = None  # type: ignore[assignment]  # default of the objective
    crash_cost: float = 100.0
    scale: str = "exact"
    collisions: str = "instants"
    on_goal: str = "remove"
    name: str | None = None

    def __post_init__(self) -> None:
        self._put("agents", _tuple_of(Agent, self.agents, "agent"))
        self._put("obstacles", _obstacles(self.obstacles))
        require(bool(self.agents), "agent", "is missing", "describe at least one agent")
        self._put("horizon", _checked_horizon(self.horizon))
        for key, allowed in CHOICES.items():
            value = getattr(self, key)
            require(
                isinstance(value, str) and value in allowed,
                key,
                f"is {value!r}",
                "write " + " or ".join(repr(word) for word in allowed),
            )
        self._put("margin_cap", _checked_cap(self.margin_cap, self.objective))
        cost = finite_number(self.crash_cost, "crash_cost", "write a number such as 100.0")
        require(
            0 <= cost <= tol.HEAVIEST,
            "crash_cost",
            f"is {cost:g}",
            f"write a number from 0 to {tol.HEAVIEST:g}",
        )
        self._put("crash_cost", cost)
        if self.name is not None:
            require_name(self.name, "name")
        self._check_dimensions()
        self._check_names()
        check_agents(self.agents, self.horizon)
        check_encounters(self.agents, self.obstacles, self.encounters, self.on_goal)

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)  # the dataclass is frozen

    def _check_dimensions(self) -> None:
        bodies = [(f"agent[{i}].shape", agent.dim) for i, agent in enumerate(self.agents)]
        bodies += [(f"obstacle[{k}]", obstacle.dim) for k, obstacle in enumerate(self.obstacles)]
        for place, dim in bodies:
            require(
                dim == self.dim,
                place,
                f"has dimension {dim} where agent[0].shape has {self.dim}",
                "give every agent and obstacle the same dimension",
            )

    def _check_names(self) -> None:
        repeated = [name for name, count in Counter(self.agent_names).items() if count > 1]
        require(
            not repeated,
            "agent",
            f"has the name {min(repeated, default='')!r} twice",
            "give each agent a different name",
        )

    @cached_property
    def unit(self) -> float:
        """Unit of length in which tolerances hold, that of the smallest body."""
        return min(agent.unit for agent in self.agents)

    @property
    def dim(self) -> int:
        """Number d of position components."""
        return self.agents[0].dim

    @property
    def agent_names(self) -> tuple[str, ...]:
        """Names in tables and figures."""
        return tuple(agent.name or f"agent_{i}" for i, agent in enumerate(self.agents))

    @cached_property
    def encounters(self) -> tuple[Encounter, ...]:
        """Each unordered pair of agents, then each agent with each obstacle.

        Margins and losses are listed in this order.
        """
        return tuple(all_encounters(self.agents, self.obstacles))

    def obstacle_positions(self, encounter: Encounter) -> np.ndarray:
        """Return (H+1, d) reference positions of an encounter's obstacle; zeros for agents."""
        if encounter.obstacle is None:
            return np.zeros((self.horizon + 1, self.dim))
        return self.obstacles[encounter.obstacle].positions(self.horizon)


def _checked_horizon(value: Any) -> int:
    whole = is_whole(value)
    require(
        whole and 1 <= value <= LONGEST_HORIZON,
        "horizon",
        f"is {value!r:.40}",
        f"write a whole number of steps from 1 to {LONGEST_HORIZON}",
    )
    return int(value)


def _checked_cap(value: Any, objective: str) -> float:
    cap = {"margin": 3.0, "risk": 5.0}[objective] if value is None else value
    cap = finite_number(cap, "margin_cap", "write a positive number such as 3.0")
    require(
        tol.NARROWEST <= cap <= WIDEST_CAP,
        "margin_cap",
        f"is {cap:g}",
        f"write a positive number from {tol.NARROWEST:g} to {WIDEST_CAP:g}",
    )
    return cap


def _tuple_of(kind: type, items: Any, place: str) -> tuple[Any, ...]:
    listed = tuple(items) if isinstance(items, (list, tuple)) else (items,)
    for k, item in enumerate(listed):
        if not isinstance(item, kind):  # the message is costly to build
            raise InputError(
                f"{place}[{k}]",
                f"is {item!r:.40}, not of type {kind.__name__}",
                f"give a list of {kind.__name__}",
            )
    return listed


def _obstacles(items: Any) -> tuple[Obstacle, ...]:
    listed = items if isinstance(items, (list, tuple)) else (items,)
    wrapped = [Obstacle(item) if isinstance(item, Polytope) else item for item in listed]
    return _tuple_of(Obstacle, wrapped, "obstacle")
