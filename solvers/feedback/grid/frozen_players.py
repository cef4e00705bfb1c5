"""Actions of a given player at every joint grid state, taken from the player itself."""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import make_tables
from ppg_env.env.observation import observation_size, write_observations
from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.env.status import TRAFFIC
from ppg_env.game.game import Game
from ppg_env.support.compilation import njit

CHUNK = 1 << 15
"""States for which a player is asked at once."""

_write_observations = njit(cache=True)(write_observations)


class Observer:
    """Makes the views of an agent from states, with all agents in traffic."""

    def __init__(self, game: Game, rules: Rules, agent: int) -> None:
        self._game, self._agent = game, agent
        self._tables = make_tables(game, rules)
        self._lam = np.array([mover.lam for mover in game.agents])

    def view(self, state: np.ndarray, clock: np.ndarray) -> View:
        """Return the view of states (C, N, n) at the times ``clock`` (C,)."""
        g, (copies, agents, _) = self._tables, state.shape
        status = np.full((copies, agents), TRAFFIC, dtype=np.int8)
        out = np.zeros((copies, agents, observation_size(self._game)), dtype=np.float32)
        marks = np.ones(copies, dtype=np.bool_)
        _write_observations(
            (), g.state_axes, g.axes, marks, True, state, status, clock, g.goal, g.agent_codes[0],
            g.centre, g.scale, g.max_cycles, g.stay, out,
        )  # fmt: skip
        return View(
            observation=out[:, self._agent],
            state=state,
            in_traffic=status == TRAFFIC,
            parked=np.zeros_like(status, dtype=np.bool_),
            obstacles=np.zeros((copies, 0, self._game.dim)),
            clock=clock,
            lam=np.broadcast_to(self._lam, (copies, agents)),
        )


def grid_actions(
    observer: Observer,
    player: Player,
    first: np.ndarray,
    second: np.ndarray,
    clock: int,
    inputs: int,
) -> np.ndarray:
    """Return the actions (K0, K1, m) of ``player`` at all pairs of states.

    ``first`` (K0, n) and ``second`` (K1, n) are the grid states of the two agents.
    """
    rows, columns = len(first), len(second)
    on_grid = getattr(player, "nearest_actions", None)  # look-ahead is slow for whole grids
    result = np.empty((rows * columns, inputs))
    for start in range(0, rows * columns, CHUNK):
        pairs = np.arange(start, min(start + CHUNK, rows * columns))
        state = np.stack([first[pairs // columns], second[pairs % columns]], axis=1)
        if on_grid is not None:
            result[pairs] = on_grid(state, clock)
            continue
        times = np.full(len(pairs), clock, dtype=np.int64)
        result[pairs] = player.act(observer.view(state, times))
    return result.reshape(rows, columns, inputs)
