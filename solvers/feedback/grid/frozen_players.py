"""Actions of a given player at every joint grid state, taken from the player itself."""

from __future__ import annotations

import numpy as np

from ppg_env.env.arrays import make_tables
from ppg_env.env.observation import observation_size, write_observations, write_obstacles
from ppg_env.env.players import Player, View
from ppg_env.env.rules import Rules
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.game.game import Game
from ppg_env.support.compilation import njit
from ppg_env.support.linear_algebra import one_thread

CHUNK = 1 << 12
"""States for which a player is asked at once: layers of a network then fit the cache."""

_write_observations = njit(cache=True)(write_observations)
_write_obstacles = njit(cache=True)(write_obstacles)


class Observer:
    """Makes the views of an agent from states."""

    def __init__(self, game: Game, rules: Rules, agent: int) -> None:
        self._game, self._agent = game, agent
        self._tables = make_tables(game, rules)
        self._lam = np.array([mover.lam for mover in game.agents])

    def view(self, state: np.ndarray, clock: np.ndarray, parked: int | None = None) -> View:
        """Return the view of states (C, N, n) at the times ``clock`` (C,).

        All agents are in traffic except the one that is ``parked``.
        """
        g, (copies, agents, _) = self._tables, state.shape
        status = np.full((copies, agents), TRAFFIC, dtype=np.int8)
        if parked is not None:
            status[:, parked] = ARRIVED
        out = np.zeros((copies, agents, observation_size(self._game)), dtype=np.float32)
        marks = np.ones(copies, dtype=np.bool_)
        _write_observations(
            False, 0, copies, g.state_axes, g.axes, marks, True, state, status, clock, g.goal,
            g.agent_codes[0], g.centre, g.scale, g.max_cycles, g.stay, out,
        )  # fmt: skip
        bodies = self._with_obstacles(state, clock)
        if g.path.size:
            _write_obstacles(
                0, copies, g.axes, marks, True, bodies, clock, g.path, g.obstacle_times, g.scale,
                out,
            )  # fmt: skip
        return View(
            observation=out[:, self._agent],
            state=state,
            in_traffic=status == TRAFFIC,
            parked=status == ARRIVED,
            obstacles=bodies[:, agents:, : self._game.dim],
            clock=clock,
            lam=np.broadcast_to(self._lam, (copies, agents)),
        )

    def _with_obstacles(self, state: np.ndarray, clock: np.ndarray) -> np.ndarray:
        """Return the states (C, N + K, n) of all bodies; moving obstacles follow their paths."""
        path = self._tables.path
        at = path[:, np.minimum(clock, path.shape[1] - 1)].transpose(1, 0, 2)
        return np.concatenate([state, at], axis=1)


def grid_actions(
    observer: Observer,
    player: Player,
    first: np.ndarray,
    second: np.ndarray,
    clock: int,
    inputs: int,
    parked: int | None = None,
) -> np.ndarray:
    """Return the actions (K0, K1, m) of ``player`` at all pairs of states.

    ``first`` (K0, n) and ``second`` (K1, n) are the grid states of the two agents, one of which
    may be ``parked``.
    """
    rows, columns = len(first), len(second)
    on_grid = getattr(player, "nearest_actions", None)  # look-ahead is slow for whole grids
    result = np.empty((rows * columns, inputs))
    for start in range(0, rows * columns, CHUNK):
        pairs = np.arange(start, min(start + CHUNK, rows * columns))
        state = np.stack([first[pairs // columns], second[pairs % columns]], axis=1)
        if on_grid is not None and parked is None:
            result[pairs] = on_grid(state, clock)
            continue
        times = np.full(len(pairs), clock, dtype=np.int64)
        view = observer.view(state, times, parked)
        with one_thread():
            result[pairs] = player.act(view)
    return result.reshape(rows, columns, inputs)
