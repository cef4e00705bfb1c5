"""Variables and constraints of one agent that moves (:mod:`solvers.reference.formulation`)."""

from __future__ import annotations

import cvxpy as cp
import numpy as np

from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.input_sets import spans
from ppg_env.game.reachability import earliest_arrival, plan_upper
from ppg_env.game.reserve import planned_controls


class Mover:
    """Variables and constraints of one agent that moves: dynamics and arrival."""

    def __init__(self, agent: Agent, horizon: int) -> None:
        steps, select = horizon + 1, goal_selector(agent)
        self.agent, self.horizon = agent, horizon
        self.earliest = earliest_arrival(agent, horizon)
        self.controls = cp.Variable((horizon, agent.control_dim))
        self.means = cp.Variable((steps, agent.state_dim))
        self.arrival = cp.Variable(steps, boolean=True)
        self.arrival_low = cp.Parameter(steps, value=np.zeros(steps))
        self.arrival_high = cp.Parameter(steps, value=self.possible_arrivals)
        self.arrived = cp.cumsum(self.arrival)
        high = np.maximum(plan_upper(agent, select, horizon) - agent.goal, 0.0)
        low = np.maximum(plan_upper(agent, -select, horizon) + agent.goal, 0.0)
        miss, absent = (
            self.means @ select.T - agent.goal,
            cp.reshape(1 - self.arrival, (steps, 1), order="C"),
        )
        self.constraints = [
            self.means[0] == agent.start,
            self.means[1:] == self.means[:-1] @ agent.A.T + self.controls @ agent.B.T,
            *(
                self.controls[steps] @ held.normals.T <= held.offsets[None]
                for steps, held in spans(planned_controls(agent, horizon), horizon)
            ),
            miss <= cp.multiply(high, absent @ np.ones((1, len(select)))),
            -miss <= cp.multiply(low, absent @ np.ones((1, len(select)))),
            cp.sum(self.arrival) == 1,
            self.arrival >= self.arrival_low,
            self.arrival <= self.arrival_high,
        ]

    @property
    def possible_arrivals(self) -> np.ndarray:
        """(H+1,) 1 from the earliest arrival on, 0 before."""
        first = self.horizon + 1 if self.earliest is None else self.earliest
        return (np.arange(self.horizon + 1) >= first).astype(float)

    @property
    def time(self) -> cp.Expression:
        """Arrival time T_i."""
        return np.arange(self.horizon + 1) @ self.arrival
