"""The game as data: agents, static obstacles, and how time and safety are counted.

Agent i moves by  x_{t+1} = A x_t + B u_t + w_t,  w_t ~ N(0, noise),  and corrects its errors by
u = ubar - gain (x - xbar).  The first d components of x are its reference position, d being the
dimension of its shape; it overlaps agent j iff (x_i - x_j)[:d] lies in K_ij = C_j + (-C_i).

Nothing here plans, simulates or draws: whatever does so is built from a :class:`Game`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, placed, require
from ppg_env.game.agent import Agent
from ppg_env.game.polytope import Polytope, collision_set
from ppg_env.support.frozen import Record
from ppg_env.support.validation import (
    finite_number,
)

OBJECTIVES = ("margin", "risk")
SCALES = ("exact", "paper")


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
