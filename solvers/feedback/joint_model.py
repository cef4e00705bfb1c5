"""A game of two agents on the grid of their joint state, as dynamic programming needs it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from solvers.feedback.grid import AXES, Grid, default_step, make_grid
from solvers.feedback.moves import Moves, make_moves
from solvers.feedback.noise_filter import NoiseFilter, make_noise_filter
from solvers.feedback.overlap_table import OverlapTable, make_overlap_table
from solvers.feedback.stage_kernels import Risk, Side

FLOAT = 4
"""Bytes of a value on the grid."""


@dataclass(frozen=True)
class JointModel:
    """Grids, noise and collisions of a game of two agents under ``rules``.

    Attributes
    ----------
    step : distance between neighbouring positions of the grids.
    grids, filters : one per agent.
    table : probabilities of an overlap, over displacements of agent 0 from agent 1.
    """

    game: Game
    rules: Rules
    step: float
    grids: tuple[Grid, Grid]
    filters: tuple[NoiseFilter, NoiseFilter]
    table: OverlapTable

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
    def risk(self) -> Risk:
        """The table of overlaps as the kernels take it."""
        removes = self.rules.on_crash == "remove"
        return Risk(self.table.low, self.table.step, self.table.values, removes)

    @cached_property
    def on_grid(self) -> np.ndarray:
        """(K0, K1) float32 probability of a crash after moves to grid points."""
        first, second = (grid.points for grid in self.grids)
        apart = (first[:, None] - second[None]).reshape(-1, AXES)
        chance = self.table(apart).reshape(self.shape)
        chance *= np.outer(self.filters[0].stays, self.filters[1].stays)
        return chance.astype(np.float32)

    @cached_property
    def clock_free(self) -> bool:
        """Whether nothing in the game depends on the clock, but its end."""
        return all(len(pieces(agent.control)) == 1 for agent in self.game.agents)

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

    def side(self, agent: int, clock: int) -> Side:
        """Return the moves of ``agent`` at ``clock`` as the kernels take them."""
        moves, stays = self.moves(agent, clock), self.filters[agent].stays
        kept = np.einsum("kas,kas->ka", moves.weight, stays[moves.index]).clip(0.0, 1.0)
        return Side(moves.index, moves.weight, moves.ends, kept, moves.cost)

    def alone(self, agent: int, clock: int, ahead: np.ndarray) -> np.ndarray:
        """Return costs (K, A) of an agent alone, with the costs ``ahead`` (K,) after its move."""
        moves = self.moves(agent, clock)
        return np.einsum("kas,kas->ka", moves.weight, ahead[moves.index]) + moves.cost


def make_joint_model(game: Game, rules: Rules | None, step: float | None) -> JointModel:
    """Return the model of ``game``; ``step`` None is :func:`default_step`.

    Raises
    ------
    InputError
        If the game or the rules are not of a kind that the grids can represent.
    """
    rules = (Rules() if rules is None else rules).of(game)
    check_extent(game, rules)
    if step is None:
        step = min(default_step(game, i, rules) for i in range(len(game.agents)))
    require(step > 0, "step", f"is {step}", "give a positive length")
    grids = make_grid(game, 0, step), make_grid(game, 1, step)
    first, second = game.agents
    filters = (
        make_noise_filter(first, grids[0], rules.tolerance),
        make_noise_filter(second, grids[1], rules.tolerance),
    )
    d = game.dim
    covariance = first.noise[:d, :d] + second.noise[:d, :d]
    table = make_overlap_table(game.encounters[0].collision, covariance)
    return JointModel(game, rules, float(step), grids, filters, table)


def check_extent(game: Game, rules: Rules) -> None:
    """Refuse games and rules without a grid model."""
    plan = "use planners, or learned players"
    require(len(game.agents) == 2, "game", f"has {len(game.agents)} agents", "give two")
    for i, agent in enumerate(game.agents):
        require(
            agent.state_dim <= AXES,
            f"agent[{i}]",
            f"has {agent.state_dim} state components, and a grid has {AXES} per agent",
            plan,
        )
    require(not game.obstacles, "game", "has obstacles", plan)
    require(game.collisions == "instants", "game", "has swept collisions", plan)
    require(rules.on_goal == "remove", "on_goal", "is 'stay'", plan)
    require(rules.arrival == "region", "arrival", "is 'schedule'", "use 'region'")
    require(rules.reward == "risk", "reward", "is 'margin'", "use 'risk'")
