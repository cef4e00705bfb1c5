"""An agent among bodies that it does not observe, on a grid of its state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ppg_env.env.arrival_regions import checked_tolerances
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import pieces
from solvers.feedback.grid.frozen_bodies import FrozenBody, epochs
from solvers.feedback.grid.hazards import harm_of
from solvers.feedback.grid.moves import action_set, action_spacing
from solvers.feedback.grid.noise_filter import NoiseFilter, make_noise_filter
from solvers.feedback.grid.single_kernels import Mover
from solvers.feedback.grid.state_grid import (
    CELLS_PER_STEP,
    MOST_AXES,
    Grid,
    default_step,
    make_grid,
)


@dataclass(frozen=True, eq=False)
class SingleModel:
    """Grid, noise and bodies around one ``agent`` of a game under ``rules``."""

    game: Game
    rules: Rules
    agent: int
    bodies: tuple[FrozenBody, ...]
    step: float
    grid: Grid
    noise: NoiseFilter

    @property
    def own(self) -> Agent:
        """The agent."""
        return self.game.agents[self.agent]

    @property
    def size(self) -> int:
        """Number K of grid states."""
        return self.grid.size

    @cached_property
    def _harms(self) -> list[Any]:
        return [
            harm_of(self.game, self.rules, self.agent, clock, self.grid, self.bodies)
            for clock in range(epochs(self.bodies, self.rules.steps(self.game)))
        ]

    def harm(self, clock: int) -> Any:
        """Return the probabilities of crashes in the step from ``clock``."""
        return self._harms[min(clock, len(self._harms) - 1)]

    @property
    def clock_free(self) -> bool:
        """Whether nothing in the game depends on the clock, but its end."""
        return len(pieces(self.own.control)) == 1 and len(self._harms) == 1

    def mover(self, clock: int) -> Mover:
        """Return the agent at ``clock`` as the kernels take it."""
        return self._movers[
            int(np.searchsorted([first for first, _ in self._pieces], clock, side="right")) - 1
        ]

    @property
    def _pieces(self) -> list[Any]:
        return list(pieces(self.own.control))

    @cached_property
    def _movers(self) -> list[Mover]:
        agent, grid = self.own, self.grid
        n, m = agent.state_dim, agent.control_dim
        A, B = np.eye(MOST_AXES), np.zeros((MOST_AXES, m))
        A[:n, :n], B[:n] = agent.A, agent.B
        shape = np.array(grid.shape)
        stride = np.append(np.cumprod(shape[:0:-1])[::-1], 1)
        stays = np.ones_like(self.noise.stays)
        if self.game.collisions == "instants":
            stays = self.noise.stays
        movers = []
        for _, control in self._pieces:
            actions = action_set(agent, grid, control)
            movers.append(
                Mover(grid.low, grid.step, shape, stride, A, B, control.normals, control.offsets,
                      actions, action_spacing(actions, control), float(agent.effort),
                      stays.astype(np.float64),
                      float((1.0 - agent.lam) * self.game.crash_cost),
                      agent.lam / (CELLS_PER_STEP * grid.step))
            )  # fmt: skip
        return movers


def make_single_model(
    game: Game, rules: Rules, agent: int, bodies: Sequence[FrozenBody], step: float | None
) -> SingleModel:
    """Return the model of ``agent``; ``step`` None is that of :func:`default_step`."""
    step = default_step(game, agent, rules) if step is None else step
    require(step > 0, "step", f"is {step}", "give a positive length")
    grid = make_grid(game, agent, step, MOST_AXES)
    noise = make_noise_filter(game.agents[agent], grid, checked_tolerances(game, rules)[agent])
    return SingleModel(game, rules, agent, tuple(bodies), float(step), grid, noise)
