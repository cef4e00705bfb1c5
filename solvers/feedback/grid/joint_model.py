"""A game of two agents on the grid of their joint state, as dynamic programming needs it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from solvers.feedback.grid.event_table import Events, chances, chances_of
from solvers.feedback.grid.hazards import Harms, harms, overlaps
from solvers.feedback.grid.moves import Moves, make_moves
from solvers.feedback.grid.noise_filter import NoiseFilter, make_noise_filter
from solvers.feedback.grid.stage_kernels import Side
from solvers.feedback.grid.state_grid import AXES, MOST_AXES, Grid, default_step, make_grid

FLOAT = 4
"""Bytes of a value on the grid."""


@dataclass(frozen=True)
class JointModel:
    """Grids, noise and collisions of a game of two agents under ``rules``.

    Attributes
    ----------
    step : distance between neighbouring positions of the grids.
    grids, filters : one per agent.
    risk : probabilities of an overlap, over displacements of agent 0 from agent 1.
    harms : per epoch and agent, probabilities of a crash with obstacles; one epoch if none moves.
    """

    game: Game
    rules: Rules
    step: float
    grids: tuple[Grid, Grid]
    filters: tuple[NoiseFilter, NoiseFilter]
    risk: Events
    harms: Harms

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of grid points of the two agents."""
        return self.grids[0].size, self.grids[1].size

    @property
    def lam(self) -> np.ndarray:
        """(2,) costs of a step in traffic."""
        return np.array([agent.lam for agent in self.game.agents])

    @property
    def crash(self) -> np.ndarray:
        """(2,) costs of a crash."""
        return (1.0 - self.lam) * self.game.crash_cost

    @cached_property
    def on_grid(self) -> np.ndarray:
        """(K0, K1) float32 probability of a crash of agents that rest at grid points."""
        chance = chances(self.risk, self.grids[0].points, self.grids[1].points)
        first, second = self.stays(0)[:, None], self.stays(1)[None]
        both = first * second
        chance *= first + second - both if self.risk.parks else both
        return chance.astype(np.float32)

    @cached_property
    def separable(self) -> bool:
        """Whether crashes depend on the ends of moves alone, all of them grid points."""
        aligned = all(moves.aligned for own in self._moves for moves in own)
        return aligned and not self.risk.swept

    @cached_property
    def clock_free(self) -> bool:
        """Whether nothing in the game depends on the clock, but its end."""
        return len(self._changes) == 1 and len(self.harms) == 1

    @cached_property
    def _changes(self) -> list[int]:
        """Times from which a control set holds."""
        return sorted({first for agent in self.game.agents for first, _ in pieces(agent.control)})

    def epoch(self, clock: int) -> tuple[int, int]:
        """Return what holds at ``clock``: the numbers of control sets and of obstacle tables."""
        sets = int(np.searchsorted(self._changes, clock, side="right")) - 1
        return sets, min(clock, len(self.harms) - 1)

    def harm(self, agent: int, clock: int) -> Events:
        """Return the probabilities of crashes with obstacles in the step from ``clock``."""
        return self.harms[min(clock, len(self.harms) - 1)][agent]

    def stays(self, agent: int) -> np.ndarray:
        """Return (K,) the probability that a body can be hit at the end of the step.

        In swept collisions an agent that arrives can be hit as well.
        """
        stays = self.filters[agent].stays
        return np.ones_like(stays) if self.risk.swept else stays

    def moves(self, agent: int, clock: int) -> Moves:
        """Return the moves of ``agent`` at ``clock``."""
        firsts = [first for first, _ in pieces(self.game.agents[agent].control)]
        return self._moves[agent][int(np.searchsorted(firsts, clock, side="right")) - 1]

    @cached_property
    def _moves(self) -> tuple[list[Moves], ...]:
        return tuple(
            [make_moves(agent, grid, control) for _, control in pieces(agent.control)]
            for agent, grid in zip(self.game.agents, self.grids, strict=True)
        )

    @property
    def most_actions(self) -> int:
        """Number of actions of the agent and control set that have most."""
        return max(len(moves.actions) for own in self._moves for moves in own)

    def side(self, agent: int, clock: int, ahead: np.ndarray) -> Side:
        """Return the moves of ``agent`` at ``clock`` as the kernels take them.

        ``ahead`` (K,) are its costs after a move when it is alone: what a crash ends.
        """
        moves, points = self.moves(agent, clock), self.grids[agent].points
        kept = moves.at(self.stays(agent)).clip(0.0, 1.0)
        cost = np.tile(moves.cost, (len(kept), 1))
        if not self.harm(agent, clock).empty:
            lost = self.crash[agent] - moves.at(ahead) * self.risk.removes
            cost += (self._harm_of_moves(agent, clock) * kept * lost).astype(np.float32)
        columns = self.grids[agent].shape[1]
        return Side(
            moves.index, moves.weight, moves.ends, kept, cost, points, moves.window, columns
        )

    def _harm_of_moves(self, agent: int, clock: int) -> np.ndarray:
        """Return (K, A) the probability of a crash with an obstacle in each move."""
        ends = self.moves(agent, clock).ends
        before = np.broadcast_to(self.grids[agent].points[:, None], ends.shape)
        chance = chances_of(
            self.harm(agent, clock),
            np.ascontiguousarray(before).reshape(-1, AXES),
            ends.reshape(-1, AXES).astype(np.float64),
        )
        return chance.reshape(ends.shape[:2])

    def alone(self, agent: int, clock: int, ahead: np.ndarray) -> np.ndarray:
        """Return costs (K, A) of an agent alone, with the costs ``ahead`` (K,) after its move."""
        return self.moves(agent, clock).at(ahead) + self.side(agent, clock, ahead).cost


def make_joint_model(game: Game, rules: Rules | None, step: float | None) -> JointModel:
    """Return the model of ``game``; ``step`` None is :func:`default_step`.

    Raises
    ------
    InputError
        If the game or the rules are not of a kind that the grids can represent.
    """
    rules = (Rules() if rules is None else rules).of(game)
    check_extent(game, rules)
    require(len(game.agents) == 2, "game", "has one agent", "use feedback_optimum")
    if step is None:
        step = min(default_step(game, i, rules) for i in range(len(game.agents)))
    require(step > 0, "step", f"is {step}", "give a positive length")
    grids = make_grid(game, 0, step), make_grid(game, 1, step)
    first, second = game.agents
    tolerances = checked_tolerances(game, rules)
    filters = (
        make_noise_filter(first, grids[0], tolerances[0]),
        make_noise_filter(second, grids[1], tolerances[1]),
    )
    risk, harm = overlaps(game, rules, grids), harms(game, rules, grids)
    return JointModel(game, rules, float(step), grids, filters, risk, harm)


def check_extent(game: Game, rules: Rules, *, alone: bool = False) -> None:
    """Refuse games and rules without a grid model.

    ``alone``: one agent is solved for, while all others follow plans.
    """
    plan = "use planners, or learned players"
    count = len(game.agents)
    most = MOST_AXES if alone or count == 1 else AXES
    require(alone or count <= 2, "game", f"has {count} agents", "give one or two")
    require(game.dim <= AXES, "game", "is in space", plan)
    for i, agent in enumerate(game.agents):
        require(
            agent.state_dim <= most,
            f"agent[{i}]",
            f"has {agent.state_dim} state components, and a grid has {most} per agent",
            plan,
        )
    moving = [f"obstacle[{k}]" for k, body in enumerate(game.obstacles) if body.path is not None]
    if alone:
        moving += [f"agent[{i}]" for i in range(count)] if count > 1 else []
    parks = moving and rules.on_goal == "stay"
    require(not parks, moving[0] if moving else "", "moves, and arrived bodies stay", plan)
    require(rules.arrival == "region", "arrival", "is 'schedule'", "use 'region'")
    require(rules.reward == "risk", "reward", "is 'margin'", "use 'risk'")
