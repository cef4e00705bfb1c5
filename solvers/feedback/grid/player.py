"""Players that look one step ahead on the fields of a feedback solution."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ppg_env.env.players import Player, View
from ppg_env.game.input_sets import set_at
from solvers.feedback.grid.action_price import Body
from solvers.feedback.grid.backward import Stages
from solvers.feedback.grid.decisions import decide_alone, decide_jointly, respond_everywhere
from solvers.feedback.grid.finer import FinerCosts
from solvers.feedback.grid.frozen_players import Observer
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.moves import action_set, action_spacing, after, project
from solvers.feedback.grid.places import make_places
from solvers.feedback.grid.state_grid import AXES, CELLS_PER_STEP, padded


@dataclass(frozen=True)
class Policy:
    """What the players of a solution share.

    Attributes
    ----------
    kind : ``optimum``, ``equilibrium`` or ``response``.
    partner : the other agent's player, for a response.
    latest : clock, states and actions of the latest joint decision, which serves both players.
    bodies, finer : what :meth:`body` has made, per agent and epoch, and per agent.
    """

    model: JointModel
    kind: str
    stages: Stages
    partner: Player | None = None
    latest: list[Any] = field(default_factory=list, compare=False, repr=False)
    bodies: dict[Any, Body] = field(default_factory=dict, compare=False, repr=False)
    finer: dict[int, FinerCosts] = field(default_factory=dict, compare=False, repr=False)

    def players(self) -> list[Player]:
        """Return one player per agent; the given player where another agent responds to it."""
        own: list[Player] = [FeedbackPlayer(self, i) for i in range(2)]
        if self.partner is not None:
            own[1 - self.agents[0]] = self.partner
        return own

    @property
    def agents(self) -> tuple[int, ...]:
        """Agents that are solved for."""
        return tuple(self.stages.alone)

    def row(self, clock: int) -> int:
        """Return the stage at ``clock``."""
        left = max(self.model.rules.steps(self.model.game) - clock, 1)
        return min(left, len(self.stages.choice)) - 1

    def field_of(self, row: int, agent: int) -> np.ndarray:
        """Return the field (K0, K1) of ``agent`` at a stage; both may have the same."""
        fields = self.stages.fields[row]
        return fields[agent if len(fields) == 2 else 0]

    def crash(self) -> np.ndarray:
        """Return the cost of a crash to each agent's objective."""
        crash = self.model.crash
        return np.full(2, crash.sum()) if self.kind == "optimum" else crash

    def body(self, agent: int, clock: int) -> Body:
        """Return an agent at ``clock`` as the kernels take it."""
        key = agent, self.model.epoch(clock)
        if key not in self.bodies:
            share = 0.5 if self.kind == "optimum" else 1.0
            self.bodies[key] = make_body(self.model, agent, clock, share)
        if agent not in self.agents:
            return self.bodies[key]
        if agent not in self.finer:
            self.finer[agent] = FinerCosts(
                self.model, agent, self.stages.alone[agent], self.stages.stationary
            )
        return self.finer[agent].put(self.bodies[key], clock)


def make_body(model: JointModel, agent: int, clock: int, share: float) -> Body:
    """Return ``agent`` of ``model`` at ``clock`` as the kernels take it."""
    mover, grid = model.game.agents[agent], model.grids[agent]
    control = set_at(mover.control, clock)
    actions = action_set(mover, grid, control)
    n, m = mover.state_dim, mover.control_dim
    A, B = np.eye(AXES), np.zeros((AXES, m))
    A[:n, :n], B[:n] = mover.A, mover.B
    ends = actions @ B.T
    return Body(
        grid.low, grid.step, np.array(grid.shape), A, B, control.normals, control.offsets, actions,
        np.stack([ends.min(axis=0), ends.max(axis=0)]), action_spacing(actions, control),
        mover.effort, model.stays(agent).reshape(grid.shape).astype(np.float64),
        float(model.crash[agent]), share, mover.lam / (CELLS_PER_STEP * grid.step),
        np.zeros(AXES), np.ones(AXES), np.zeros(AXES, dtype=np.int64), np.zeros((0, 0)),
    )  # fmt: skip


class FeedbackPlayer:
    """Plays one agent of a feedback solution from the states of both and the clock."""

    information = "full state"

    def __init__(self, policy: Policy, agent: int) -> None:
        self.policy, self.agent = policy, agent
        self._observer = Observer(policy.model.game, policy.model.rules, 1 - agent)

    @property
    def steady_until(self) -> int:
        """The time up to which the actions do not depend on the clock; -1 if there is none."""
        policy = self.policy
        if not policy.stages.stationary or policy.partner is not None:
            return -1
        return policy.model.rules.steps(policy.model.game) - len(policy.stages.choice)

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m)."""
        mover = self.policy.model.game.agents[self.agent]
        action = np.zeros((len(view.clock), mover.control_dim))
        for clock in np.unique(view.clock).tolist():
            now = view.in_traffic[:, self.agent] & (view.clock == clock)
            both = now & view.in_traffic[:, 1 - self.agent]
            past = now & view.parked[:, 1 - self.agent] & self.policy.model.risk.parks
            alone = np.flatnonzero(now & ~both & ~past)
            if past.any():
                rows = np.flatnonzero(past)
                action[rows] = self._past(view.state[rows], clock)
            if both.any():
                rows = np.flatnonzero(both)
                action[rows] = self._together(view.state[rows], clock)
            if alone.size:
                action[alone] = self._alone(view.state[alone, self.agent], clock)
        return action

    def nearest_actions(self, states: np.ndarray, clock: int) -> np.ndarray:
        """Return the grid's actions (C, m) at the grid states nearest to ``states`` (C, 2, n).

        Unlike :meth:`act` it does not look ahead; all agents are in traffic.
        """
        policy, own = self.policy, self.agent
        at = [policy.model.grids[i].nearest(self._padded(states[:, i], i)) for i in range(2)]
        choice = policy.stages.choice[policy.row(clock)]
        kept = choice[own if len(choice) == 2 else 0, at[0], at[1]]
        return self.policy.body(own, clock).actions[kept]

    def _together(self, states: np.ndarray, clock: int) -> np.ndarray:
        """Return actions at the joint ``states`` (C, 2, n)."""
        policy, own = self.policy, self.agent
        latest = policy.latest
        if latest and latest[0] == clock and np.array_equal(latest[1], states):
            return np.array(latest[2][own])
        row, model = policy.row(clock), policy.model
        bodies = [self.policy.body(i, clock) for i in range(2)]
        harms = [model.harm(i, clock) for i in range(2)]
        size = np.max([self._window(body) for body in bodies], axis=0)
        at = [self._padded(states[:, i], i) for i in range(2)]
        actions = [np.zeros((len(states), body.B.shape[1])) for body in bodies]
        if policy.partner is None:
            decide_jointly(bodies[0], bodies[1], harms[0], harms[1], policy.field_of(row, 0),
                           policy.field_of(row, 1), policy.crash(), model.risk,
                           policy.stages.choice[row], np.stack(at, axis=1), size,
                           *actions)  # fmt: skip
            latest[:] = clock, states, actions
            return np.array(actions[own])
        ends = self._partner_ends(states, clock)
        respond_everywhere(bodies[own], harms[own], policy.stages.fields[row, 0], own == 0,
                           model.risk, policy.crash()[own], bodies[1 - own], at[own], at[1 -
                           own], ends, size, actions[own])  # fmt: skip
        return actions[own]

    def _past(self, states: np.ndarray, clock: int) -> np.ndarray:
        """Return actions at the ``states`` (C, 2, n) in which the other agent is parked."""
        policy, own = self.policy, self.agent
        row, model = policy.row(clock), policy.model
        places = make_places(model, 1 - own).grid
        far = self.policy.body(1 - own, clock)._replace(
            low=places.low, shape=np.array(places.shape), stays=np.zeros(places.shape)
        )
        body = self.policy.body(own, clock)._replace(share=1.0)
        at = [self._padded(states[:, i], i) for i in range(2)]
        actions = np.zeros((len(states), body.B.shape[1]))
        respond_everywhere(body, model.harm(own, clock), policy.stages.passing[own][row], own == 0,
                           model.risk, policy.crash()[own], far, at[own], at[1 - own], at[1 - own],
                           self._window(body), actions)  # fmt: skip
        return actions

    def _partner_ends(self, states: np.ndarray, clock: int) -> np.ndarray:
        """Return the other's states (C, 2) after the action that its player takes."""
        policy, other = self.policy, 1 - self.agent
        mover = policy.model.game.agents[other]
        times = np.full(len(states), clock, dtype=np.int64)
        # Only solutions with a partner, which are responses, come here.
        actions = policy.partner.act(self._observer.view(states, times))  # type: ignore[union-attr]
        if policy.model.rules.saturation == "clip":
            actions = project(actions, set_at(mover.control, clock))
        return after(mover, states[:, other], actions)

    def _alone(self, states: np.ndarray, clock: int) -> np.ndarray:
        """Return actions at ``states`` (C, n) without the other agent."""
        policy, grid = self.policy, self.policy.model.grids[self.agent]
        body = self.policy.body(self.agent, clock)._replace(share=1.0)
        actions = np.zeros((len(states), body.B.shape[1]))
        alone = policy.stages.alone[self.agent][policy.row(clock)].reshape(grid.shape)
        decide_alone(body, policy.model.harm(self.agent, clock), alone.astype(np.float64),
                     policy.model.risk, self._padded(states, self.agent), actions)  # fmt: skip
        return actions

    def _padded(self, states: np.ndarray, agent: int) -> np.ndarray:
        return padded(states[..., : self.policy.model.game.agents[agent].state_dim])

    def _window(self, body: Any) -> np.ndarray:
        return np.ceil((body.span[1] - body.span[0]) / body.step).astype(int) + 5
