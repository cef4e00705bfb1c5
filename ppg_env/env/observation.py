"""The layout of observations and of the global state, both float32.

Agent i's observation has n + d + 2 + (N - 1)(1 + n) entries, for N agents with n state and d
position components.  Lengths are divided by ``scale``, half the largest extent of all starts and
goals along one axis (:func:`observation_frame`), and ``centre`` is the middle of their extents:

======================  =====  =====================================================
entry                   size   meaning
======================  =====  =====================================================
state - goal            n      state relative to the goal
position - centre       d      position in the field
in traffic              1      1 until arrival or crash
time                    1      elapsed share of ``max_cycles``
other: present          1      1 if its body can be hit; else this and the rest are 0
other: relative state   n      position relative to agent i; other components as they are
======================  =====  =====================================================

The last two entries repeat for each other agent, in the order of the game.  A game with K moving
obstacles adds K (1 + 2 d) entries at the end, for each of them in the order of the game:

======================  =====  =====================================================
entry                   size   meaning
======================  =====  =====================================================
present                 1      1 until it is gone; then this and the rest are 0
relative position       d      its current position, drift included, less agent i's
next move               d      its movement in the next step without noise
======================  =====  =====================================================

Obstacles at rest are not observed: they are the same in every episode.

The global state has N n + N + 1 + K d entries: every agent's position relative to the centre and
other state components, divided by ``scale``; which agents are in traffic; the elapsed share of
time; the positions of moving obstacles relative to the centre, divided by ``scale``.
"""

from __future__ import annotations

import numpy as np

from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.game.game import Game


def moving_obstacles(game: Game) -> list[int]:
    """Return the indices of the obstacles on paths, which are bodies of the simulator."""
    return [k for k, obstacle in enumerate(game.obstacles) if obstacle.path is not None]


def observation_size(game: Game) -> int:
    """Return the number of entries of one agent's observation."""
    n, d = max(agent.state_dim for agent in game.agents), game.dim
    others, moving = len(game.agents) - 1, len(moving_obstacles(game))
    return n + d + 2 + others * (1 + n) + moving * (1 + 2 * d)


def observation_frame(game: Game) -> tuple[np.ndarray, float]:
    """Return the centre (d,) of starts and goals, and half their largest extent.

    The latter is at least the game's unit of length, a fifteenth of the smallest body.
    """
    d = game.dim
    places = np.array([[*agent.start[:d], *agent.goal[:d]] for agent in game.agents]).reshape(-1, d)
    spread = np.ptp(places, axis=0)
    return (places.max(axis=0) + places.min(axis=0)) / 2, max(float(spread.max()) / 2, game.unit)


def write_observations(
    varied: bool,
    first: int,
    last: int,
    state_axes: tuple[int, ...],
    axes: tuple[int, ...],
    marks: np.ndarray,
    marked: bool,
    state: np.ndarray,
    status: np.ndarray,
    clock: np.ndarray,
    goal: np.ndarray,
    goal_size: np.ndarray,
    centre: np.ndarray,
    scale: float,
    max_cycles: int,
    stay: bool,
    out: np.ndarray,
) -> None:
    """Write observations of copies to ``out`` (C, N, entries).

    Copies are those from ``first`` up to ``last`` whose mark is ``marked``.

    The kernel compiles this function; arguments are as in :mod:`ppg_env.env.kernel`.  Goals (N, n)
    are those of all copies, or (C N, n) each one's own if ``varied``.
    """
    N, n, d = status.shape[1], len(state_axes), len(axes)
    inverse, share = 1.0 / scale, 1.0 / max_cycles
    for c in range(first, last):
        if marks[c] != marked:
            continue
        row = c * N * varied
        for i in range(N):
            w = 0
            for k in range(n):
                target = goal[row + i, k]
                out[c, i, w] = (state[c, i, k] - (target if k < goal_size[i] else 0.0)) * inverse
                w += 1
            for k in range(d):
                out[c, i, w] = (state[c, i, k] - centre[k]) * inverse
                w += 1
            out[c, i, w] = 1.0 if status[c, i] == TRAFFIC else 0.0
            out[c, i, w + 1] = clock[c] * share
            w += 2
            for j in range(N):
                if j == i:
                    continue
                # Chosen without a branch: who is there cannot be predicted.
                present = (status[c, j] == TRAFFIC) | (stay & (status[c, j] == ARRIVED))
                out[c, i, w] = 1.0 if present else 0.0
                w += 1
                for k in range(n):
                    value = (state[c, j, k] - (state[c, i, k] if k < d else 0.0)) * inverse
                    out[c, i, w] = value if present else 0.0
                    w += 1


def write_obstacles(
    first: int,
    last: int,
    axes: tuple[int, ...],
    marks: np.ndarray,
    marked: bool,
    state: np.ndarray,
    clock: np.ndarray,
    path: np.ndarray,
    obstacle_times: np.ndarray,
    scale: float,
    out: np.ndarray,
) -> None:
    """Write what agents observe of moving obstacles, after the entries about other agents.

    The kernel compiles this function, a separate one because games without moving obstacles
    would be slower; arguments are as in :func:`write_observations`.
    """
    N, n, d, inverse = out.shape[1], state.shape[2], len(axes), 1.0 / scale
    for c in range(first, last):
        if marks[c] != marked:
            continue
        for i in range(N):
            w = n + d + 2 + (N - 1) * (1 + n)
            for b in range(path.shape[0]):
                rest, until = obstacle_times[b]
                now, following = min(clock[c], rest), min(clock[c] + 1, rest)
                there = 1.0 if clock[c] < until else 0.0
                out[c, i, w] = there
                for k in range(d):
                    away = state[c, N + b, k] - state[c, i, k]
                    ahead = path[b, following, k] - path[b, now, k]
                    out[c, i, w + 1 + k] = there * away * inverse
                    out[c, i, w + 1 + d + k] = there * ahead * inverse
                w += 1 + 2 * d


def global_state(
    bodies: np.ndarray, status: np.ndarray, share: np.ndarray, centre: np.ndarray, scale: float
) -> np.ndarray:
    """Return the global state (...,) of copies.

    ``bodies`` (..., N + K, n) are the states of agents and moving obstacles, ``status`` (..., N)
    those of agents, ``share`` (..., 1) is the elapsed share of time.
    """
    relative, copies, N, d = bodies.copy(), status.shape[:-1], status.shape[-1], centre.size
    relative[..., :d] -= centre
    states = relative[..., :N, :].reshape(*copies, -1) / scale
    obstacles = relative[..., N:, :d].reshape(*copies, -1) / scale
    parts = [states, status == TRAFFIC, share, obstacles]
    return np.concatenate(parts, axis=-1).astype(np.float32)
