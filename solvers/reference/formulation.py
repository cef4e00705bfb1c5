r"""The paper's mixed-integer programs as one: some agents move, the other plans are given.

Variables, for each mover i and time t = 0..H: controls u_it, means r_it, arrival d_it in {0,1}
(D_it = sum_{k<=t} d_ik); for each encounter e, event t and face p: margin s_et in [0, M'], loss
l_et >= 0, face choice z_etp in {0,1}.

    minimise    sum_i tau_i sum_t t d_it  +  sum_e omega_e sum_t l_et  +  sum_i eta_i sum_t |v_it|_1
    subject to  r_i0 = start,   r_i,t+1 = A r_it + B u_it,   u_it in U_it
                |r_it - goal| <= M (1 - d_it),   sum_t d_it = 1
                a' r_it <= limit_t + M D_i,t-1             (workspace, up to the arrival)
                v_it >= |u_it| - M D_it                    (effort, up to the arrival)
                a_p' (y_it' - y_jt') - b_p >= unit_et'p s_et - M (1 - z_etp)
                sum_p z_etp >= 1 - O_et                    (a face for each event in traffic)
                l_et >= c(q) + c'(q) (s_et - q) - c(M') O_et       for tangent points q

with unit = sqrt(2) sigma_p(t'), c the loss of :mod:`ppg_env.game.objective` (one tangent is exact
for ``margin``), and every M the smallest that the reachable sets allow.

Events are the instants t' = t, or with ``collisions="swept"`` the steps, t' = t and t' = t + 1: the
choice of a face holds at both ends.  Where an arrived body leaves, y_it = r_it and O_et = D_it +
D_jt.  Where it stays, the event is out of traffic once both have arrived, and the body is parked:

    O_et <= D_it,   O_et <= D_jt,    |y_it - r_it| <= M D_it,    |y_it - goal| <= M (1 - D_it).

A parked body keeps the errors of its arrival.  If T_i = k makes other units than those of a body
that moves on, the rows at t' > k stand twice: with the units of k where d_ik = 1 (M (1 - d_ik) is
subtracted), and with the usual ones where d_ik = 0.

    MP1   one mover, static obstacles         (best_response in a game of one agent)
    MP2   one mover, the others' plans given  (best_response)
    MP3   all agents move                     (social_optimum; potential_equilibrium)

A pair has one set of face choices, shared by both agents: K_ji = -K_ij.  The given plans and the
positions of obstacles enter through parameters, so a program is compiled once and solved many
times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from ppg_env.game.objective import Objective
from ppg_env.game.plan import Profile
from solvers.reference.mover import Mover
from solvers.reference.separation import Separation


@dataclass(frozen=True)
class Decisions:
    """The discrete part of a solution: arrivals (movers, H+1), faces (separations)(K, F)."""

    arrivals: tuple[np.ndarray, ...]
    faces: tuple[np.ndarray, ...]


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
        stays = game.on_goal == "stay"
        self.movers = {i: Mover(game.agents[i], game.horizon, stays=stays) for i in movers}
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
        for i, mover in self.movers.items():
            if objective.effort[i] > 0:
                sizes, limits = mover.effort()
                goal += float(objective.effort[i]) * cp.sum(sizes)
                constraints += limits
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
