r"""Sets of plans of one agent: those that arrive at a given time, and pass given half-spaces.

    P  =  { controls u in U with mean at the goal at T,  a_k . r_{t_k} <= b_k  for all k }

A set bounds where the agent can be at each time along the faces of its collision set, by linear
programs whose bounds are proved (:mod:`solvers.extremes.safe_lp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.input_sets import set_at
from ppg_env.game.plan import Plan, make_plan
from ppg_env.game.plan_constraints import plan_constraints
from ppg_env.game.reserve import planned_controls
from solvers.extremes.safe_lp import SafeProgram

SLACK = tol.LENGTH
"""Lengths by which half-spaces and supports are widened, since plans meet their constraints within
tolerances."""

MISS = 1e3
"""Largest violation of half-spaces that is distinguished."""


class HalfSpace(NamedTuple):
    """The plans whose position at ``time`` has ``normal`` . r <= ``most``."""

    time: int
    normal: tuple[float, ...]
    most: float


class PlanSet:
    """The plans of ``agent`` with the given arrival that satisfy ``half_spaces``.

    Attributes
    ----------
    empty : whether it is proved that there are none.
    reach : (T, F) upper bounds on directions . r_t at t = 0..T-1.
    vertices : plans at which these bounds are attained, by the back end.
    """

    def __init__(
        self,
        agent: Agent,
        horizon: int,
        arrival: int,
        directions: np.ndarray,
        half_spaces: Sequence[HalfSpace] = (),
    ) -> None:
        self.agent, self.horizon, self.arrival = agent, horizon, arrival
        self.directions, self.half_spaces = directions, tuple(half_spaces)
        self._drift, self._effect = _positions(agent, arrival)
        lp = self._program()
        unit = np.zeros(len(lp.low))
        unit[-1] = 1.0
        self.empty = lp.minimise(unit).bound > tol.LENGTH
        self.reach = np.full((arrival, len(directions)), -np.inf)
        self.vertices: list[Plan] = []
        if not self.empty:
            lp.fix(-1 % len(lp.low), 0.0)
            self._find_reach(lp)

    def with_half_spaces(self, added: Sequence[HalfSpace]) -> PlanSet:
        """Return the subset of plans that satisfy ``added``, too."""
        rows = (*self.half_spaces, *added)
        return PlanSet(self.agent, self.horizon, self.arrival, self.directions, rows)

    @property
    def centre(self) -> Plan | None:
        """The mean of ``vertices``; None if there are none."""
        if not self.vertices:
            return None
        return make_plan(self.agent, np.mean([plan.controls for plan in self.vertices], axis=0))

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """The half-spaces as rows (K, T m) of the controls, and their limits (K,)."""
        normals = [np.array(h.normal) for h in self.half_spaces]
        times = [h.time for h in self.half_spaces]
        pairs = list(zip(normals, times, strict=True))
        crossed = np.array([normal @ self._effect[t] for normal, t in pairs])
        shifts = np.array([normal @ self._drift[t] for normal, t in pairs])
        most = np.array([h.most for h in self.half_spaces])
        return crossed.reshape(len(pairs), self._effect.shape[2]), most - shifts + SLACK

    def _program(self) -> SafeProgram:
        """Return the program over the controls and, last, a common violation of half-spaces."""
        agent, T = self.agent, self.arrival
        bounds = [set_at(planned_controls(agent, self.horizon), t).bounds for t in range(T)]
        low = np.append(np.concatenate([low for low, _ in bounds]), 0.0)
        high = np.append(np.concatenate([high for _, high in bounds]), MISS)
        fixed = plan_constraints(agent, T, self.horizon)
        faces = (fixed.faces != 0).sum(axis=1) > 1  # the others are bounds of columns
        rows = [fixed.faces[faces], fixed.inside, fixed.effect]
        most = [fixed.offsets[faces], fixed.room, fixed.change]
        least = [np.full(len(fixed.offsets[faces]) + len(fixed.room), -np.inf), fixed.change]
        plain = np.hstack([np.concatenate(rows), np.zeros((sum(map(len, rows)), 1))])
        crossed, limits = self.rows
        crossed = np.hstack([crossed, np.full((len(crossed), 1), -1.0)])
        return SafeProgram(
            low,
            high,
            np.vstack([plain, crossed]),
            np.concatenate([*least, np.full(len(limits), -np.inf)]),
            np.concatenate([*most, limits]),
        )

    def _find_reach(self, lp: SafeProgram) -> None:
        for t in range(self.arrival):
            for k, direction in enumerate(self.directions):
                bound, point = lp.minimise(np.append(-direction @ self._effect[t], 0.0))
                self.reach[t, k] = direction @ self._drift[t] - bound + SLACK
                if point is not None and t:
                    controls = np.zeros((self.horizon, self.agent.control_dim))
                    controls[: self.arrival] = point[:-1].reshape(self.arrival, -1)
                    self.vertices.append(make_plan(self.agent, controls))


def _positions(agent: Agent, arrival: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (T+1, d) and (T+1, d, T m):  position at t = drift_t + effect_t u."""
    n, m = agent.state_dim, agent.control_dim
    drift, effect = np.zeros((arrival + 1, n)), np.zeros((arrival + 1, n, arrival * m))
    drift[0] = agent.start
    for t in range(arrival):
        drift[t + 1], effect[t + 1] = agent.A @ drift[t], agent.A @ effect[t]
        effect[t + 1][:, t * m : (t + 1) * m] = agent.B
    return drift[:, : agent.dim], effect[:, : agent.dim]
