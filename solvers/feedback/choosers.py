"""Three ways to choose actions at a stage: jointly, in equilibrium, and against a given player."""

from __future__ import annotations

import numpy as np

from ppg_env.env.players import Player
from ppg_env.game.input_sets import set_at
from solvers.feedback.equilibrium_kernels import NONE, stage_equilibria
from solvers.feedback.frozen_players import Observer, grid_actions
from solvers.feedback.joint_model import JointModel
from solvers.feedback.moves import after, project
from solvers.feedback.stage_kernels import erode, respond, settle

ROUNDS = 12
"""Best responses at a state before all pairs of actions are enumerated."""


class JointOptimum:
    """Actions that minimise the sum of both costs.

    The least cost over pairs of moves is a minimum over the second agent's moves, and then over
    the first's.
    """

    agents = (0, 1)
    stationary = True
    kept = 1

    def __init__(self, model: JointModel) -> None:
        self._model = model

    def choose(self, clock: int, fields: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray]:
        """Return costs and actions of both agents."""
        model = self._model
        sides = [model.side(i, clock) for i in range(2)]
        total = self._total(fields)
        middle, second = np.empty_like(total.T, order="C"), np.empty(total.T.shape, np.int32)
        erode(np.ascontiguousarray(total.T), sides[1].index, sides[1].weight, sides[1].cost,
              middle, second)  # fmt: skip
        least, first = np.empty_like(total), np.empty(total.shape, np.int32)
        erode(np.ascontiguousarray(middle.T), sides[0].index, sides[0].weight, sides[0].cost,
              least, first)  # fmt: skip
        ends = np.take_along_axis(_nearest(sides[0]), first, axis=1)
        choice = np.stack([first, second.T[ends, np.arange(total.shape[1])[None]]])
        return settled(model, sides, fields, choice)

    def _total(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the sum of the agents' costs (K0, K1) after moves, crashes included."""
        risk, crash = self._model.on_grid, self._model.crash.sum()
        total = fields[0] + fields[1]
        lost = crash - total if self._model.risk.removes else np.float32(crash)
        return total + risk * lost

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the sum of the fields."""
        return (fields[0] + fields[1])[None]


class StageEquilibrium:
    """Actions of which neither agent has a better one, at every state of the stage."""

    agents = (0, 1)
    stationary = True
    kept = 2

    def __init__(self, model: JointModel, start: str) -> None:
        self._model, self._start = model, start
        self.without = np.zeros(0)

    def choose(self, clock: int, fields: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray]:
        """Return costs and actions of both agents; ``without`` counts states without equilibrium."""
        model = self._model
        sides = [model.side(i, clock) for i in range(2)]
        choice = self._begin(clock, fields)
        how = np.empty(model.shape, np.uint8)
        own = np.ascontiguousarray(fields[0].T)
        stage_equilibria(own, fields[1], sides[0], sides[1], model.risk, model.crash,
                         _reach(sides[0]), _reach(sides[1]), ROUNDS, choice, how)  # fmt: skip
        self.without = how == NONE
        return settled(model, sides, fields, choice)

    def _begin(self, clock: int, fields: list[np.ndarray]) -> np.ndarray:
        return JointOptimum(self._model).choose(clock, fields)[1].astype(np.int32)

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return both fields."""
        return np.stack(fields)


class Response:
    """Best actions of one agent against a given player."""

    stationary = False
    kept = 1

    def __init__(self, model: JointModel, agent: int, player: Player) -> None:
        self._model, self._agent, self._player = model, agent, player
        self.agents = (agent,)
        self._observer = Observer(model.game, model.rules, 1 - agent)

    def choose(self, clock: int, fields: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray]:
        """Return costs and actions of the agent."""
        model, agent, other = self._model, self._agent, 1 - self._agent
        side, grid = model.side(agent, clock), model.grids[other]
        field = fields[0] if agent == 1 else np.ascontiguousarray(fields[0].T)
        out, best = np.empty_like(field), np.empty(field.shape, np.int32)
        respond(field, side, model.risk, agent == 0, model.crash[agent], model.lam[agent],
                _reach(side), grid.low, grid.step, grid.shape, self._other_ends(clock),
                model.filters[other].stays, out, best)  # fmt: skip
        if agent == 0:
            out, best = np.ascontiguousarray(out.T), best.T
        return [out], small(best[None], side.cost.size)

    def _other_ends(self, clock: int) -> np.ndarray:
        """Return the states (K_other, K_own, 2) of the other agent after its moves."""
        model, other = self._model, 1 - self._agent
        mover = model.game.agents[other]
        states = [
            grid.points[:, : agent.state_dim]
            for grid, agent in zip(model.grids, model.game.agents, strict=True)
        ]
        actions = grid_actions(
            self._observer, self._player, states[0], states[1], clock, mover.control_dim
        )
        if other == 1:
            actions = actions.transpose(1, 0, 2)
        if model.rules.saturation == "clip":
            flat = np.ascontiguousarray(actions.reshape(-1, mover.control_dim))
            actions = project(flat, set_at(mover.control, clock)).reshape(actions.shape)
        return after(mover, states[other][:, None], actions).astype(np.float32)

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the agent's field."""
        return fields[0][None]


def settled(model, sides, fields, choice):
    """Return the costs of both agents for the actions ``choice`` (2, K0, K1), and the actions."""
    out = np.empty((2, *model.shape), np.float32)
    choice = np.ascontiguousarray(choice, dtype=np.int32)
    settle(np.stack(fields), sides[0], sides[1], model.risk, model.crash, model.lam, choice, out)
    return [out[0], out[1]], small(choice, max(side.cost.size for side in sides))


def small(choice: np.ndarray, actions: int) -> np.ndarray:
    """Return the numbers of actions in the smallest type that fits."""
    return choice.astype(np.uint8 if actions <= 256 else np.uint16)


def _reach(side) -> np.ndarray:
    """Return (K, 4) lowest and highest states after a move from each grid point."""
    return np.concatenate([side.ends.min(axis=1), side.ends.max(axis=1)], axis=1)


def _nearest(side) -> np.ndarray:
    """Return (K, A) the grid point of the largest weight after each move."""
    largest = side.weight.argmax(axis=2)[..., None]
    return np.take_along_axis(side.index, largest, axis=2)[..., 0]
