"""Observations other than the usual ones, chosen by ``observation=``.

=========================  ======================================================================
option                     entries of one agent's observation
=========================  ======================================================================
``relative`` (default)     those of :mod:`ppg_env.env.observation`, without limits
``box``                    the same, within limits
``neighbours(k=4)``        its own n + d + 2 entries; the 1 + n entries of each of the k nearest
                           agents present, the nearest first, zeros where there are fewer; then
                           moving obstacles.  The size does not depend on the number of agents
``lidar(rays=16)``         its own n + d + 2 entries; then distances along rays to the next contact
                           with another body or an obstacle, divided by ``reach``, at most 1
``state``                  the global state, and for each agent whether it is the one that observes
=========================  ======================================================================

All but the first have finite limits: lengths in units of ``scale`` are cut off at ``LIMIT`` on
either side, flags and shares are from 0 to 1.  A ray starts at the agent's reference point and ends
where the two bodies would touch, had the agent moved along the ray and nothing else; 0 means
contact now.  Rays are evenly spread: 2 on a line, ``rays`` in the plane from the first axis on, and
on a Fibonacci lattice in space (Gonzalez, Mathematical Geosciences 42, 2010).

Actions of agents are never masked: every action in the action space is valid at all times.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from gymnasium.spaces import Box

from ppg_env.env.observation import global_state, moving_obstacles
from ppg_env.env.simulator import Simulator
from ppg_env.env.status import ARRIVED, TRAFFIC
from ppg_env.errors import require

LIMIT = 10.0
"""Largest size of an entry: ten times half the extent of all starts and goals."""

MOST_RAYS = 360


class Observer(Protocol):
    """Turns what a simulator holds into observations.

    Attributes
    ----------
    space : limits of one agent's observation.
    """

    space: Box

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return (C, N, W) what agents observe now; ``observation`` are the usual ones."""
        ...


def make_observer(simulator: Simulator, option: str) -> Observer:
    """Return the observer that ``option`` asks for; the module's table lists the options.

    Raises
    ------
    InputError
        If there is no such option, or its argument does not fit.
    """
    match = re.fullmatch(r"(\w+)(\((?:(\w+) *= *)?(\d{1,9})\))?", str(option).strip())
    name, call, key, number = match.groups() if match else ("", None, None, None)
    kinds: dict[str, tuple[str, int, Callable[[Simulator, int], Observer]]] = {
        "neighbours": ("k", 4, Neighbours),
        "lidar": ("rays", 16, Lidar),
    }
    plain: dict[str, Callable[[Simulator], Observer]] = {
        "relative": Relative,
        "box": Limited,
        "state": FullState,
    }
    fits = name in kinds and key in (None, kinds[name][0])
    require(
        fits or (name in plain and not call),
        "observation",
        f"is {option!r:.60}",
        "write relative, box, neighbours(k=4), lidar(rays=16) or state",
    )
    if name in plain:
        return plain[name](simulator)
    _, default, kind = kinds[name]
    return kind(simulator, default if number is None else int(number))


class Relative:
    """The usual observations, without limits."""

    def __init__(self, simulator: Simulator) -> None:
        self.space: Box = Box(-np.inf, np.inf, (simulator.observation_size,), np.float32)

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return the usual observations themselves."""
        return observation


class Limited:
    """The usual observations within limits."""

    def __init__(self, simulator: Simulator) -> None:
        parts = _Parts(simulator)
        others = parts.other * (parts.agents - 1)
        self.space = _space([*parts.own, *others, *parts.obstacles, *parts.drawn])

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return the usual observations, cut off at the limits."""
        return _limited(observation)


class Neighbours:
    """The agent itself, the ``count`` nearest agents that are present, and moving obstacles."""

    def __init__(self, simulator: Simulator, count: int) -> None:
        require(count >= 1, "observation", f"has k = {count}", "write 1 or more")
        self._parts, self._count = _Parts(simulator), count
        parts = self._parts
        self.space = _space(
            [*parts.own, *parts.other * count, *parts.obstacles, *parts.drawn_of_itself]
        )

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return the entries of the nearest, in the order of distance and then of the game."""
        own, others, rest = self._parts.of(observation)
        places = others[..., 1 : 1 + self._parts.dim].astype(np.float64)
        distance = np.where(others[..., 0] > 0, (places**2).sum(axis=-1), np.inf)
        if distance.shape[-1] > 4 * self._count:
            nearest = np.argpartition(distance, self._count - 1)[..., : self._count]
            nearest.sort(axis=-1)
            distance = np.take_along_axis(distance, nearest, axis=-1)
            others = np.take_along_axis(others, nearest[..., None], axis=-2)
        order = np.argsort(distance, axis=-1, kind="stable")[..., : self._count]
        chosen = np.take_along_axis(others, order[..., None], axis=-2)
        missing = np.zeros((*chosen.shape[:2], self._count - chosen.shape[2], chosen.shape[3]))
        nearest_first = np.concatenate([chosen, missing], axis=2)
        flat = nearest_first.reshape(*own.shape[:2], -1)
        return _limited(np.concatenate([own, flat, self._parts.without_others(rest)], axis=-1))


class Lidar:
    """The agent itself, and distances along rays to the next contact."""

    def __init__(self, simulator: Simulator, rays: int) -> None:
        require(
            1 <= rays <= MOST_RAYS,
            "observation",
            f"has rays = {rays}",
            f"write 1 to {MOST_RAYS}",
        )
        self._simulator, self._parts = simulator, _Parts(simulator)
        self.directions = ray_directions(simulator.game.dim, rays)
        self.reach = 2 * simulator.tables.scale
        lengths = [(0.0, 1.0)] * len(self.directions)
        self.space = _space([*self._parts.own, *lengths, *self._parts.drawn_of_itself])

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return own entries, and for each ray the distance divided by ``reach``, at most 1."""
        own, _, rest = self._parts.of(observation)
        distances = np.minimum(self.distances() / self.reach, 1.0)
        drawn = self._parts.without_others(rest)[..., len(self._parts.obstacles) :]
        return _limited(np.concatenate([own, distances, drawn], axis=-1))

    def distances(self) -> np.ndarray:
        """Return (C, N, R) distances along rays to contact, infinite where there is none."""
        simulator, tables = self._simulator, self._simulator.tables
        result = np.full((*simulator.status.shape, len(self.directions)), np.inf)
        there = _present(simulator)
        for first in np.unique(tables.pair[:, 2]):
            rows = tables.pair[tables.pair[:, 2] == first]
            faces = slice(first, rows[0, 3])
            i, j = rows[:, 0], rows[:, 1]
            place = simulator.bodies[..., : simulator.game.dim]
            other = np.where((j >= 0)[:, None], place[:, j], 0.0)
            normals = tables.normals[faces]
            offsets = tables.offsets.reshape(-1, tables.own_faces or len(tables.offsets))
            room = offsets[:, None, faces] - (place[:, i] - other) @ normals.T
            for agents, sign, met in ((i, 1.0, there[:, j]), (j, -1.0, there[:, i])):
                if sign < 0:
                    movers = (j >= 0) & (j < simulator.status.shape[1])
                    agents, met, room = agents[movers], met[:, movers], room[:, movers]
                for r, slopes in enumerate(sign * self.directions @ normals.T):
                    lengths = np.where(met, contact(room, slopes), np.inf)
                    at: Any = (slice(None), agents)  # the stub expects one array
                    np.minimum.at(result[..., r], at, lengths)
        return result


class FullState:
    """The global state, and which agent observes."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator, N = simulator, len(simulator.game.agents)
        n, d = simulator.bodies.shape[2], simulator.game.dim
        lengths, flags = [(-LIMIT, LIMIT)], [(0.0, 1.0)]
        obstacles, drawn = len(moving_obstacles(simulator.game)) * d, simulator.entries.state_size
        limits = lengths * N * n + flags * (N + 1) + lengths * (obstacles + drawn) + flags * N
        self.space = _space(limits)

    def read(self, observation: np.ndarray) -> np.ndarray:
        """Return the same state for all agents of a copy, and each one's own place in it."""
        simulator, tables = self._simulator, self._simulator.tables
        share = simulator.clock[:, None] / simulator.max_cycles
        state = global_state(simulator.bodies, simulator.status, share, tables.centre, tables.scale)
        C, N = simulator.status.shape
        state = np.concatenate([state, simulator.drawn_state(np.arange(C))], axis=1)
        every = np.broadcast_to(state[:, None], (C, N, state.shape[1]))
        own = np.broadcast_to(np.eye(N), (C, N, N))
        return _limited(np.concatenate([every, own], axis=-1))


class _Parts:
    """Limits of the parts of the usual observation, and the parts themselves."""

    def __init__(self, simulator: Simulator) -> None:
        game, n = simulator.game, simulator.bodies.shape[2]
        length, flag = [(-LIMIT, LIMIT)], [(0.0, 1.0)]
        self.agents, self.dim = len(game.agents), game.dim
        self.own = length * (n + game.dim) + flag * 2
        self.other = flag + length * n
        self.obstacles = (flag + length * 2 * game.dim) * len(moving_obstacles(game))
        self.drawn = simulator.entries.limits(LIMIT)
        own = simulator.entries.own
        self.drawn_of_itself = [self.drawn[k] for k in np.flatnonzero(own)]
        self._kept = np.concatenate([np.ones(len(self.obstacles), dtype=bool), own])

    def without_others(self, rest: np.ndarray) -> np.ndarray:
        """Return the entries of obstacles and of what the agent itself has drawn."""
        return rest if self._kept.all() else rest[..., self._kept]

    def of(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return own entries (C, N, .), those of others (C, N, N - 1, 1 + n), and the rest.

        The rest are those of moving obstacles and of what is drawn.
        """
        first, size = len(self.own), len(self.other)
        end = first + (self.agents - 1) * size
        others = observation[..., first:end].reshape(*observation.shape[:2], self.agents - 1, size)
        return observation[..., :first], others, observation[..., end:]


def ray_directions(dim: int, rays: int) -> np.ndarray:
    """Return (R, d) unit vectors, evenly spread."""
    if dim == 1:
        return np.array([[1.0], [-1.0]])
    k = np.arange(rays)
    if dim == 2:
        angles = 2 * np.pi * k / rays
        return np.column_stack([np.cos(angles), np.sin(angles)])
    require(dim == 3, "observation", f"has rays in {dim} dimensions", "choose another observation")
    heights, turns = 1 - (2 * k + 1) / rays, np.pi * (3 - np.sqrt(5)) * k
    radii = np.sqrt(1 - heights**2)
    return np.column_stack([radii * np.cos(turns), radii * np.sin(turns), heights])


def contact(room: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return the length of a ray (...,) up to a polytope, infinite if it misses; 0 inside.

    The ray starts ``room`` (..., F) below the faces and rises by ``slopes`` (F,) per length.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        at = room / slopes
    enter = np.where(slopes < 0, at, -np.inf).max(axis=-1)
    leave = np.where(slopes > 0, at, np.inf).min(axis=-1)
    outside = ((slopes == 0) & (room < 0)).any(axis=-1)
    hit = (enter <= leave) & (leave >= 0) & ~outside
    return np.where(hit, np.maximum(enter, 0.0), np.inf)


def _present(simulator: Simulator) -> np.ndarray:
    """Return (C, N + K + 1) whether each body is there; the last entry, obstacles at rest, is."""
    status, times = simulator.status, simulator.tables.obstacle_times
    agents = (status == TRAFFIC) | (simulator.tables.stay & (status == ARRIVED))
    moving = simulator.clock[:, None] < times[:, 1]
    return np.concatenate([agents, moving, np.ones((len(status), 1), dtype=bool)], axis=1)


def _limited(values: np.ndarray) -> np.ndarray:
    finite = np.nan_to_num(values, nan=0.0, posinf=LIMIT, neginf=-LIMIT)
    return np.clip(finite, -LIMIT, LIMIT).astype(np.float32)


def _space(limits: list[tuple[float, float]]) -> Box:
    low, high = np.array(limits, dtype=np.float32).T
    return Box(low, high, dtype=np.float32)
