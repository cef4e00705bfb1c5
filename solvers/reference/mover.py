"""Variables and constraints of one agent that moves (:mod:`solvers.reference.formulation`)."""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import bounds, spans
from ppg_env.game.reachability import earliest_arrival, plan_upper
from ppg_env.game.reserve import planned_controls
from ppg_env.game.workspace import workspace_limits, workspace_rows


class Mover:
    """Controls, means and arrival of one agent, and the body's positions.

    Attributes
    ----------
    controls, means : (H, m) and (H+1, n) variables u and r.
    arrival, arrived : (H+1,) binary variables d, and their sums D.
    body : (H+1, d) positions y of the body, of which those in traffic count.
    """

    def __init__(self, agent: Agent, horizon: int, *, stays: bool) -> None:
        steps = horizon + 1
        self.agent, self.horizon, self.stays = agent, horizon, stays
        self.earliest = earliest_arrival(agent, horizon)
        self.controls = cp.Variable((horizon, agent.control_dim))
        self.means = cp.Variable((steps, agent.state_dim))
        self.arrival = cp.Variable(steps, boolean=True)
        self.arrival_low = cp.Parameter(steps, value=np.zeros(steps))
        self.arrival_high = cp.Parameter(steps, value=self.possible_arrivals)
        self.arrived = cp.cumsum(self.arrival)
        self.constraints = [*self._motion(), *self._goal(), *self._workspace()]
        self.body = self.means[:, : agent.dim]
        if stays:
            self.body = cp.Variable((steps, agent.dim))
            self.constraints += self._parking()

    def _motion(self) -> list[cp.Constraint]:
        """Return the dynamics, and the control sets less the reserve."""
        agent, controls = self.agent, planned_controls(self.agent, self.horizon)
        return [
            self.means[0] == agent.start,
            self.means[1:] == self.means[:-1] @ agent.A.T + self.controls @ agent.B.T,
            *(
                self.controls[steps] @ held.normals.T <= held.offsets[None]
                for steps, held in spans(controls, self.horizon)
            ),
        ]

    def _goal(self) -> list[cp.Constraint]:
        """Return |r_t - goal| <= M (1 - d_t), with one arrival."""
        select = goal_selector(self.agent)
        miss, absent = (
            self.means @ select.T - self.agent.goal,
            spread(1 - self.arrival, len(select)),
        )
        low, high = self._room(select)
        return [
            miss <= cp.multiply(high, absent),
            -miss <= cp.multiply(low, absent),
            cp.sum(self.arrival) == 1,
            self.arrival >= self.arrival_low,
            self.arrival <= self.arrival_high,
        ]

    def _workspace(self) -> list[cp.Constraint]:
        """Return a' r_t <= limit_t + M D_t-1: the means stay inside up to the arrival."""
        rows, limits = workspace_rows(self.agent), workspace_limits(self.agent, self.horizon)
        if not len(rows):
            return []
        beyond = np.maximum(plan_upper(self.agent, rows, self.horizon) - limits, 0.0)
        before = cp.hstack([np.zeros(1), self.arrived[:-1]])
        return [self.means @ rows.T - limits <= cp.multiply(beyond, spread(before, len(rows)))]

    def _parking(self) -> list[cp.Constraint]:
        """Return |y_t - r_t| <= M D_t and |y_t - goal| <= M (1 - D_t)."""
        select = goal_selector(self.agent)[: self.agent.dim]
        low, high = self._room(select)
        parked, moving = spread(self.arrived, len(select)), spread(1 - self.arrived, len(select))
        there = self.body - self.agent.goal[: self.agent.dim]
        return [
            there <= cp.multiply(high, moving),
            -there <= cp.multiply(low, moving),
            self.means @ select.T - self.body <= cp.multiply(high, parked),
            self.body - self.means @ select.T <= cp.multiply(low, parked),
        ]

    def _room(self, select: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (H+1, g) how far below and above the goal the selected components can be."""
        goal = self.agent.goal[: len(select)]
        low = plan_upper(self.agent, -select, self.horizon) + goal
        high = plan_upper(self.agent, select, self.horizon) - goal
        return np.maximum(low, 0.0), np.maximum(high, 0.0)

    def effort(self) -> tuple[cp.Variable, list[cp.Constraint]]:
        """Return variables (H, m) that are |u_t| before the arrival, and their constraints."""
        size = cp.Variable(self.controls.shape, nonneg=True)
        low, high = bounds(planned_controls(self.agent, self.horizon))
        largest = np.ones((self.horizon, 1)) * np.maximum(np.abs(low), np.abs(high))
        free = cp.multiply(largest, spread(self.arrived[:-1], len(low)))
        return size, [size >= self.controls - free, size >= -self.controls - free]

    def reach(self, rows: np.ndarray) -> np.ndarray:
        """Return (H+1, F) the largest a . y_t for ``rows`` (F, d), moving or parked."""
        d, n = self.agent.dim, self.agent.state_dim
        padded = np.hstack([rows, np.zeros((len(rows), n - d))])
        result = plan_upper(self.agent, padded, self.horizon)
        if self.stays:
            parked = self.possible_arrivals > 0
            result[parked] = np.maximum(result[parked], rows @ self.agent.goal[:d])
        return result

    @property
    def possible_arrivals(self) -> np.ndarray:
        """(H+1,) 1 from the earliest arrival on, 0 before; an agent at its goal has arrived."""
        times = np.arange(self.horizon + 1)
        if self.earliest == 0:
            return (times == 0).astype(float)
        first = self.horizon + 1 if self.earliest is None else self.earliest
        return (times >= first).astype(float)

    @property
    def time(self) -> cp.Expression:
        """Arrival time T_i."""
        return np.arange(self.horizon + 1) @ self.arrival


def spread(values: cp.Expression, count: int) -> cp.Expression:
    """Return ``values`` (K,) in ``count`` equal columns."""
    return cp.reshape(values, (values.size, 1), order="C") @ np.ones((1, count))
