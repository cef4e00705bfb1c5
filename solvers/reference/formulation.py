r"""The paper's mixed-integer programs as one: some agents move, the other plans are given.

Variables, for each mover i and time t = 0..H: controls u_it, means r_it, arrival d_it in {0,1}
(D_it = sum_{k<=t} d_ik); for each encounter e and face p: margin s_et in [0, M'], loss l_et >= 0,
face choice z_etp in {0,1}.

    minimise    sum_i tau_i sum_t t d_it  +  sum_e omega_e sum_t l_et
    subject to  r_i0 = start,   r_i,t+1 = A r_it + B u_it,   u_it in U_it
                |r_it - goal| <= M (1 - d_it),   sum_t d_it = 1
                a_p' (r_it - r_jt) - b_p >= unit_etp s_et - M (1 - z_etp)
                sum_p z_etp >= 1 - D_it - D_jt            (an arrived agent is out of traffic)
                l_et >= c(q) + c'(q) (s_et - q) - c(M') (D_it + D_jt)      for tangent points q

with unit = sqrt(2) sigma_p(t), c the loss of :mod:`ppg_env.game.objective` (one tangent is exact
for ``margin``), and every M the smallest that the reachable sets allow.

    MP1   one mover, static obstacles         (best_response in a game of one agent)
    MP2   one mover, the others' plans given  (best_response)
    MP3   all agents move                     (social_optimum; potential_equilibrium)

A pair has one set of face choices, shared by both agents: K_ji = -K_ij.  The given plans enter
through parameters, so a program is compiled once and solved many times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.agent import Agent
from ppg_env.game.dynamics import goal_selector
from ppg_env.game.encounter import Encounter
from ppg_env.game.game import Game
from ppg_env.game.input_sets import spans
from ppg_env.game.margins import encounter_units
from ppg_env.game.objective import Objective, loss
from ppg_env.game.plan import Profile
from ppg_env.game.reachability import earliest_arrival, plan_upper
from ppg_env.game.reserve import planned_controls
from solvers.reference.tangents import TangentTable


@dataclass(frozen=True)
class Decisions:
    """The discrete part of a solution: arrivals (movers, H+1), faces (separations)(H+1, F)."""

    arrivals: tuple[np.ndarray, ...]
    faces: tuple[np.ndarray, ...]


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


class Separation:
    """Variables and constraints of one encounter with at least one mover.

    ``offsets``, ``active`` and ``big`` are parameters where the other side's plan is given.
    """

    def __init__(self, game: Game, encounter: Encounter, movers: dict[int, Mover]) -> None:
        self.game, self.encounter = game, encounter
        self.moving = [i for i in encounter.agents if i in movers]
        self.given = [i for i in encounter.agents if i not in movers]
        self.signs = {i: 1.0 if i == encounter.agents[0] else -1.0 for i in encounter.agents}
        self.units = encounter_units(game, encounter)
        shape = self.units.shape
        steps = shape[0]
        self.margin = cp.Variable(steps, bounds=[0, game.margin_cap])
        self.loss = cp.Variable(steps, nonneg=True)
        self.face = cp.Variable(shape, boolean=True)
        self.face_low = cp.Parameter(shape, value=np.zeros(shape))
        self.face_high = cp.Parameter(shape, value=np.ones(shape))
        self.offsets = cp.Parameter(shape)
        self.big = cp.Parameter(shape, nonneg=True)
        self.active = cp.Parameter(steps, nonneg=True)
        self.tangents = TangentTable(game, steps)
        self.constraints = self._constraints(movers)
        self.possible_faces = np.ones(shape)

    def _constraints(self, movers: dict[int, Mover]) -> list[cp.Constraint]:
        """Return the constraints on margins, faces and losses."""
        game, (steps, count) = self.game, self.units.shape
        clear = (
            sum(self.signs[i] * (movers[i].means @ self._rows(i).T) for i in self.moving)
            - self.offsets
        )
        out = sum(movers[i].arrived for i in self.moving) + (1 - self.active)  # of traffic
        worst = float(loss(game, np.array(game.margin_cap)))
        column = cp.reshape(self.margin, (steps, 1), order="C")
        spread = column @ np.ones((1, count))
        pieces = np.ones((1, self.tangents.count))
        return [
            clear >= cp.multiply(self.units, spread) - cp.multiply(self.big, 1 - self.face),
            cp.sum(self.face, axis=1) >= 1 - out,
            self.face >= self.face_low,
            self.face <= self.face_high,
            cp.reshape(self.loss + worst * out, (steps, 1), order="C") @ pieces
            >= cp.multiply(self.tangents.slopes, column @ pieces) + self.tangents.intercepts,
        ]

    def _rows(self, agent: int) -> np.ndarray:
        """(F, n) face normals in the state space of ``agent``."""
        normals, n = self.encounter.collision.normals, self.game.agents[agent].state_dim
        return np.hstack([normals, np.zeros((len(normals), n - normals.shape[1]))])

    def update(self, profile: Profile | None) -> None:
        """Set the parameters: the given side's plan, and the faces within reach against it."""
        steps = self.game.horizon + 1
        offsets = np.tile(self.encounter.collision.offsets, (steps, 1))
        active = np.ones(steps)
        for i in self.given:
            assert profile is not None
            offsets = offsets - self.signs[i] * (profile[i].means @ self._rows(i).T)
            last = profile[i].arrival
            active *= np.arange(steps) < (steps if last is None else last)
        highest, lowest = -offsets, -offsets
        for i in self.moving:
            agent, rows = self.game.agents[i], self.signs[i] * self._rows(i)
            highest = highest + plan_upper(agent, rows, self.game.horizon)
            lowest = lowest - plan_upper(agent, -rows, self.game.horizon)
        cap = self.game.margin_cap
        self.offsets.value = offsets
        self.active.value = active
        self.big.value = np.maximum(self.units * cap - lowest, 0.0)
        # A face that can just be touched is possible; rounding must not exclude it.
        self.possible_faces = (highest >= -tol.LENGTH).astype(float)
        self.release()

    def release(self) -> None:
        """Free the choice of faces."""
        self.face_low.value = np.zeros(self.units.shape)
        self.face_high.value = self.possible_faces

    def fix(self, choice: np.ndarray) -> None:
        """Fix the faces (H+1, F) to ``choice``."""
        self.face_low.value = choice
        self.face_high.value = choice


class Program:
    """A compiled program that minimises ``objective`` over ``movers``; see the module's docstring.

    Parameters
    ----------
    objective
        The objective and its game; encounters without a mover are left out.
    movers
        Indices of the agents to plan.
    """

    def __init__(self, objective: Objective, movers: Sequence[int]) -> None:
        self.objective, self.game = objective, objective.game
        game = self.game
        self.movers = {i: Mover(game.agents[i], game.horizon) for i in movers}
        self.separations = [
            Separation(game, encounter, self.movers)
            for encounter in game.encounters
            if any(i in self.movers for i in encounter.agents)
        ]
        self.encounter_weights = [
            float(objective.encounter[e])
            for e, encounter in enumerate(game.encounters)
            if any(i in self.movers for i in encounter.agents)
        ]
        goal = sum(objective.time[i] * mover.time for i, mover in self.movers.items())
        for weight, part in zip(self.encounter_weights, self.separations, strict=True):
            goal += weight * cp.sum(part.loss)
        constraints = [c for mover in self.movers.values() for c in mover.constraints]
        constraints += [c for part in self.separations for c in part.constraints]
        self.problem = cp.Problem(cp.Minimize(goal), constraints)

    def update(self, profile: Profile | None) -> None:
        """Set the plans of the agents that do not move."""
        for part in self.separations:
            part.tangents.reset()
            part.update(profile)
        self.release()

    def release(self) -> None:
        """Free all discrete decisions."""
        for mover in self.movers.values():
            mover.arrival_low.value = np.zeros(self.game.horizon + 1)
            mover.arrival_high.value = mover.possible_arrivals
        for part in self.separations:
            part.release()

    def decisions(self) -> Decisions:
        """Return the discrete decisions of the last solution, rounded."""
        return Decisions(
            tuple(np.round(mover.arrival.value) for mover in self.movers.values()),
            tuple(np.round(part.face.value) for part in self.separations),
        )

    def fix(self, decisions: Decisions) -> None:
        """Fix all discrete decisions; a linear program without big-M slack remains."""
        for mover, arrival in zip(self.movers.values(), decisions.arrivals, strict=True):
            mover.arrival_low.value = mover.arrival_high.value = arrival
        for part, faces in zip(self.separations, decisions.faces, strict=True):
            part.fix(faces)
