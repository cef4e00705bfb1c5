"""Compilation of the simulator ahead of its first use."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ppg_env.env.simulator import Simulator
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope


def usual_games() -> list[Game]:
    """Return one game of each size that the simulator is usually compiled for.

    These are the scenarios in the plane and in space, and bodies on a line.
    """
    games = []
    for d in (2, 3, 1):
        mover = Agent(
            start=np.zeros(d),
            goal=np.full(d, 50.0),
            shape=Polytope.box([4.0] * d),
            control=Polytope.box([20.0] * d),
            noise=np.array(1.0),
            gain=np.array(0.5),
        )
        games.append(Game(agents=(mover, replace(mover, start=np.full(d, 30.0)))))
    return games


def warm_up(games: Iterable[Game] | None = None) -> Iterator[tuple[Game, tuple[int, int, int]]]:
    """Compile the simulator for ``games``, by default for :func:`usual_games`.

    Machine code is compiled for sizes, not for games: position components d, state components n
    and inputs m.  The first game of each size is yielded with it once its code is compiled.
    """
    sizes = set()
    for game in usual_games() if games is None else games:
        simulator = Simulator(game)
        size = game.dim, simulator.bodies.shape[2], simulator.action_size
        if size not in sizes:
            sizes.add(size)
            simulator.reset()
            simulator.step(np.zeros((1, *simulator.low.shape)))
            yield game, size


def code_folder() -> str:
    """Return the folder in which machine code of the simulator is kept."""
    from ppg_env.env import kernel

    return str(kernel.step.stats.cache_path)
