"""Trajectories as tables with one row per agent and time, as pandas and spreadsheets read them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ppg_env.game.game import Game
from ppg_env.game.plan import Profile

Line = list[Any]


def plan_columns(game: Game) -> list[str]:
    """Return the columns of :func:`plan_rows`."""
    return ["agent", "time", "arrived", *_components(game, "x"), *_components(game, "u")]


def plan_rows(game: Game, profile: Profile) -> Iterator[Line]:
    """Yield agent, time, whether it has arrived, mean state, and nominal control of each step.

    Cells of components that an agent does not have, and of controls at the horizon, are None.
    """
    width, inputs = len(_components(game, "x")), len(_components(game, "u"))
    for name, plan in zip(game.agent_names, profile, strict=True):
        for t in range(game.horizon + 1):
            control = plan.controls[t].tolist() if t < game.horizon else []
            arrived = plan.arrival is not None and t >= plan.arrival
            cells = _padded(plan.means[t].tolist(), width) + _padded(control, inputs)
            yield [name, t, int(arrived), *cells]


def episode_columns(game: Game) -> list[str]:
    """Return the columns of :func:`episode_rows`."""
    return ["episode", "agent", "time", *_components(game, "x")]


def episode_rows(game: Game, states: np.ndarray) -> Iterator[Line]:
    """Yield episode, agent, time and state, while the agent is in the game.

    ``states`` are (episodes, T + 1, N, n), nan after an agent has left.
    """
    for e, episode in enumerate(states):
        for i, (name, agent) in enumerate(zip(game.agent_names, game.agents, strict=True)):
            for t, state in enumerate(episode[:, i, : agent.state_dim].tolist()):
                if state[0] == state[0]:
                    yield [e, name, t, *_padded(state, states.shape[-1])]


def _components(game: Game, letter: str) -> list[str]:
    sizes = [agent.state_dim if letter == "x" else agent.control_dim for agent in game.agents]
    return [f"{letter}{k}" for k in range(max(sizes))]


def _padded(values: Line, width: int) -> Line:
    return values + [None] * (width - len(values))
