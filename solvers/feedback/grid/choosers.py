"""Three ways to choose actions at a stage: jointly, in equilibrium, and against a given player."""

from __future__ import annotations

import numpy as np

from ppg_env.env.players import Player
from ppg_env.game.input_sets import set_at
from solvers.feedback.grid.equilibrium_kernels import SLACK, stage_equilibria
from solvers.feedback.grid.event_table import no_events
from solvers.feedback.grid.frozen_players import Observer, grid_actions
from solvers.feedback.grid.joint_model import JointModel
from solvers.feedback.grid.moves import after, project
from solvers.feedback.grid.response_kernels import respond
from solvers.feedback.grid.stage_kernels import Side, erode, reach_of, settle
from solvers.feedback.grid.state_grid import Grid

STARTS = ("selfish", "social", "swapped")
"""Rules for the actions from which best responses begin."""

ROUNDS = 12
"""Best responses in turn at a state of a stage."""

FRESH = 0.5
"""Part of the stages, from the last one backwards, in which best responses begin from the rule.
Earlier stages begin with the actions of the stage after them."""

GROWTH = 2.0
"""Factor on the tolerance of a state whose actions change in a stage of the latter kind.  Without
it, actions where best responses cycle would change from stage to stage without end."""

DESCENTS = 8
"""Improvements in turn of a pair of actions that minimises the sum of costs."""

Costs = tuple[list[np.ndarray], np.ndarray]
"""Costs (K0, K1) of each agent that is solved for, and actions (F, K0, K1)."""


class JointOptimum:
    """Actions that minimise the sum of both costs.

    The least cost over pairs of moves to grid points is a minimum over the second agent's moves,
    and then over the first's.  Where moves end between grid points, or overlaps depend on the
    states before the moves, agents then improve their actions in turn.
    """

    agents: tuple[int, ...] = (0, 1)
    stationary = True
    together = True
    kept = 1

    def __init__(self, model: JointModel) -> None:
        self._model = model

    def choose(self, clock: int, fields: list[np.ndarray], ahead: dict[int, np.ndarray]) -> Costs:
        """Return costs and actions of both agents."""
        model = self._model
        sides = [model.side(i, clock, ahead[i]) for i in range(2)]
        total = fields[0] + fields[1]
        choice = joint_choice(model, sides, total)
        if not model.separable:
            crash, regret = np.full(2, model.crash.sum()), np.empty(model.shape, np.float32)
            tolerance = np.full(model.shape, np.float32(SLACK))
            stage_equilibria(
                np.ascontiguousarray(total.T), total, sides[0], sides[1], model.risk, crash,
                reach_of(sides[0]), reach_of(sides[1]), False, DESCENTS, tolerance, choice, regret,
            )  # fmt: skip
        return _settled(model, sides, fields, choice)

    def parked_ends(self, clock: int, places: dict[int, Grid]) -> dict[int, np.ndarray]:
        """Return no moves: both agents are solved for."""
        return {}

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the sum of the fields."""
        return (fields[0] + fields[1])[None]


class StageEquilibrium:
    """Actions of which neither agent has a better one, at every state of the stage.

    Where best responses cycle, the pair of least regret among those met is chosen.
    """

    agents: tuple[int, ...] = (0, 1)
    stationary = True
    together = False
    kept = 2

    def __init__(self, model: JointModel, start: str) -> None:
        self._model, self._start = model, start
        self._games, self._lacking = 0, 0
        self._before: np.ndarray | None = None
        self._epoch: tuple[int, int] | None = None
        self._tolerance = np.full(model.shape, SLACK, np.float32)

    @property
    def without(self) -> float:
        """Share of stage games so far in which an agent gains by another action."""
        return self._lacking / max(self._games, 1)

    def choose(self, clock: int, fields: list[np.ndarray], ahead: dict[int, np.ndarray]) -> Costs:
        """Return costs and actions of both agents."""
        model = self._model
        sides = [model.side(i, clock, ahead[i]) for i in range(2)]
        before, fresh = self._before, clock >= (1.0 - FRESH) * model.rules.steps(model.game)
        if before is None or fresh or model.epoch(clock) != self._epoch:
            before = None
        choice = self._begin(clock, sides, fields, ahead) if before is None else before.copy()
        self._play(sides, fields, choice)
        if before is not None:
            self._tolerance[(choice != before).any(axis=0)] *= GROWTH
        self._before, self._epoch = choice, model.epoch(clock)
        return _settled(model, sides, fields, choice)

    def _play(self, sides: list[Side], fields: list[np.ndarray], choice: np.ndarray) -> None:
        """Improve ``choice`` (2, K0, K1) by best responses."""
        model, risk = self._model, self._model.risk
        if model.separable:
            risk = no_events()
            fields = [with_overlaps(model, fields[i], model.crash[i]) for i in range(2)]
        regret = np.empty(model.shape, np.float32)
        stage_equilibria(
            np.ascontiguousarray(fields[0].T), fields[1], sides[0], sides[1], risk, model.crash,
            reach_of(sides[0]), reach_of(sides[1]), self._start == "swapped", ROUNDS,
            self._tolerance, choice, regret,
        )  # fmt: skip
        self._games += regret.size
        self._lacking += int((regret > SLACK).sum())

    def _begin(
        self,
        clock: int,
        sides: list[Side],
        fields: list[np.ndarray],
        ahead: dict[int, np.ndarray],
    ) -> np.ndarray:
        """Return the actions (2, K0, K1) from which best responses begin."""
        if self._start == "social":
            return joint_choice(self._model, sides, fields[0] + fields[1])
        choice = np.empty((2, *self._model.shape), np.int32)
        for i in range(2):
            alone = self._model.alone(i, clock, ahead[i]).argmin(axis=1)
            choice[i] = alone[:, None] if i == 0 else alone[None]
        return choice

    def parked_ends(self, clock: int, places: dict[int, Grid]) -> dict[int, np.ndarray]:
        """Return no moves: both agents are solved for."""
        return {}

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return both fields."""
        return np.stack(fields)


class Response:
    """Best actions of one agent against a given player.

    A player that does not observe others is asked at each of its own grid states only, and a player
    that has an attribute ``steady_until`` once for all times up to it.
    """

    together = False
    kept = 1

    def __init__(self, model: JointModel, agent: int, player: Player) -> None:
        self._model, self._agent, self.player = model, agent, player
        self.agents: tuple[int, ...] = (agent,)
        self._observer = Observer(model.game, model.rules, 1 - agent)
        self._steady_until = getattr(player, "steady_until", -1)
        self._clock, self._steady_ends = 0, np.zeros((0, 0, 0), np.float32)

    @property
    def stationary(self) -> bool:
        """Whether the player acts as in the latest stage at all earlier times."""
        return self._clock <= self._steady_until

    def choose(self, clock: int, fields: list[np.ndarray], ahead: dict[int, np.ndarray]) -> Costs:
        """Return costs and actions of the agent."""
        model, agent, other = self._model, self._agent, 1 - self._agent
        self._clock = clock
        side, grid = model.side(agent, clock, ahead[agent]), model.grids[other]
        field = fields[0] if agent == 1 else np.ascontiguousarray(fields[0].T)
        out, best = np.empty_like(field), np.empty(field.shape, np.int32)
        respond(
            field, side, model.risk, agent == 0, model.crash[agent], model.lam[agent],
            reach_of(side), grid.low, grid.step, grid.shape, grid.points, self._other_ends(clock),
            model.stays(agent), model.stays(other), out, best,
        )  # fmt: skip
        if agent == 0:
            out, best = np.ascontiguousarray(out.T), best.T
        return [out], best[None]

    def parked_ends(self, clock: int, places: dict[int, Grid]) -> dict[int, np.ndarray]:
        """Return the other's ends (P, K, 2) while the agent is parked."""
        other = 1 - self._agent
        ends = self._ends(clock, places[other], self._agent)
        return {other: np.broadcast_to(ends, (places[other].size, *ends.shape[1:]))}

    def _other_ends(self, clock: int) -> np.ndarray:
        """Return the states (K_other, K_own or 1, 2) of the other agent after its moves."""
        if self._steady_ends.size:
            return self._steady_ends
        ends = self._ends(clock, self._model.grids[self._agent], None)
        ends = np.ascontiguousarray(ends.transpose(1, 0, 2))
        if self.stationary and self._model.clock_free:
            self._steady_ends = ends
        return ends

    def _ends(self, clock: int, own: Grid, parked: int | None) -> np.ndarray:
        """Return the other's ends (K_own or 1, K_other, 2), with the agent at points of ``own``."""
        model, other = self._model, 1 - self._agent
        mover, n = model.game.agents[other], max(a.state_dim for a in model.game.agents)
        if self.player.information != "full state":
            own = Grid(own.low, own.step, (1, 1))
        states = [own.points[:, :n], own.points[:, :n]]
        states[other] = model.grids[other].points[:, :n]
        actions = grid_actions(
            self._observer, self.player, states[0], states[1], clock, mover.control_dim, parked
        )
        if other == 0:
            actions = actions.transpose(1, 0, 2)
        if model.rules.saturation == "clip":
            flat = np.ascontiguousarray(actions.reshape(-1, mover.control_dim))
            actions = project(flat, set_at(mover.control, clock)).reshape(actions.shape)
        return after(mover, states[other][None], actions).astype(np.float32)

    def keep(self, fields: list[np.ndarray]) -> np.ndarray:
        """Return the agent's field."""
        return fields[0][None]


def joint_choice(model: JointModel, sides: list[Side], total: np.ndarray) -> np.ndarray:
    """Return actions (2, K0, K1) that minimise the sum of costs ``total`` (K0, K1) after moves.

    Overlaps count as at grid points at the end of the step.
    """
    total = with_overlaps(model, total, model.crash.sum())
    middle, second = np.empty_like(total.T, order="C"), np.empty(total.T.shape, np.int32)
    erode(
        np.ascontiguousarray(total.T), sides[1].index, sides[1].weight, sides[1].cost, middle,
        second,
    )  # fmt: skip
    least, first = np.empty_like(total), np.empty(total.shape, np.int32)
    erode(
        np.ascontiguousarray(middle.T), sides[0].index, sides[0].weight, sides[0].cost, least, first
    )
    ends = np.take_along_axis(_nearest(sides[0]), first, axis=1)
    return np.stack([first, second.T[ends, np.arange(total.shape[1])[None]]])


def with_overlaps(model: JointModel, field: np.ndarray, crash: float) -> np.ndarray:
    """Return ``field`` (K0, K1) with the cost of overlaps of agents that rest at grid points."""
    lost = np.float32(crash) - field if model.risk.removes else np.float32(crash)
    return field + model.on_grid * lost


def _settled(
    model: JointModel, sides: list[Side], fields: list[np.ndarray], choice: np.ndarray
) -> Costs:
    """Return the costs of both agents for the actions ``choice`` (2, K0, K1), and the actions."""
    out = np.empty((2, *model.shape), np.float32)
    settle(np.stack(fields), sides[0], sides[1], model.risk, model.crash, model.lam, choice, out)
    return [out[0], out[1]], choice


def _nearest(side: Side) -> np.ndarray:
    """Return (K, A) the grid point of the largest weight after each move."""
    largest = side.weight.argmax(axis=2)[..., None]
    return np.take_along_axis(side.index, largest, axis=2)[..., 0]
