"""What every episode draws: starts, goals, lam, noise, sizes of bodies and the number of agents.

    rule = Randomize(start=Near(10.0), lam=Uniform(0.1, 0.9), agents=Choice(range(2, 6)))
    env = parallel_env("circle(5)", randomize=rule)

A rule is data.  A field holds one distribution, from which a value is drawn for each agent, or a
mapping from agents (numbers or names) to distributions; agents without one keep the game's value.

=========================  ======================================================================
distribution               values
=========================  ======================================================================
``Uniform(low, high)``     evenly spread between two numbers, or in the box between two points
``Near(distance)``         the game's own value plus at most ``distance`` (one number, or one per
                           component) in either direction, evenly spread
``Choice(values)``         one of the values, with equal probabilities
=========================  ======================================================================
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.support.validation import finite_array, is_whole

FIELDS = ("start", "goal", "lam", "noise", "size")
SCALARS = ("lam", "noise", "size")

Point = float | Sequence[float]


@dataclass(frozen=True)
class Uniform:
    """Values between ``low`` and ``high``, which are numbers or points.

    Numbers bound every component of a position.
    """

    low: Point
    high: Point

    def __post_init__(self) -> None:
        low, high = _frozen(self, "low"), _frozen(self, "high")
        require(
            low.shape == high.shape and low.ndim < 2 and bool((low <= high).all()),
            "Uniform",
            f"is from {self.low} to {self.high}",
            "give two numbers or points of one length, low <= high",
        )

    @property
    def components(self) -> int:
        """Number of components of the points, 0 for numbers."""
        return len(self.low) if isinstance(self.low, tuple) else 0

    def draw(self, share: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return values (M, k) for uniform numbers ``share`` (M, k)."""
        low, high = np.asarray(self.low), np.asarray(self.high)
        return np.asarray(low + (high - low) * share)

    def extremes(self, own: np.ndarray) -> list[np.ndarray]:
        """Return the lowest and the highest value."""
        return [np.broadcast_to(bound, own.shape) for bound in (self.low, self.high)]


@dataclass(frozen=True)
class Near:
    """Values within ``distance`` of the game's own, per component."""

    distance: Point

    def __post_init__(self) -> None:
        distance = _frozen(self, "distance")
        require(
            distance.ndim < 2 and bool((distance >= 0).all()),
            "Near",
            f"has the distance {self.distance}",
            "give a number, or one per component, that is not negative",
        )

    @property
    def components(self) -> int:
        """Number of components of the points, 0 for one distance."""
        return len(self.distance) if isinstance(self.distance, tuple) else 0

    def draw(self, share: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return values (M, k) around ``own`` (k,) for uniform numbers ``share`` (M, k)."""
        return np.asarray(own + np.asarray(self.distance) * (2 * share - 1))

    def extremes(self, own: np.ndarray) -> list[np.ndarray]:
        """Return the lowest and the highest value."""
        return [own - np.asarray(self.distance), own + np.asarray(self.distance)]


@dataclass(frozen=True)
class Choice:
    """One of ``values``, which are numbers or points of one length."""

    values: Sequence[Point]

    def __post_init__(self) -> None:
        listed = list(self.values) if isinstance(self.values, Iterable) else []
        object.__setattr__(self, "values", listed)
        array = _frozen(self, "values")
        require(
            array.ndim in (1, 2) and array.size > 0,
            "Choice",
            "has no values",
            "give a list of numbers, or of points of one length",
        )

    @property
    def components(self) -> int:
        """Number of components of the points, 0 for numbers."""
        first = self.values[0]
        return len(first) if isinstance(first, tuple) else 0

    def draw(self, share: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return values (M, k); the first of the uniform numbers ``share`` (M, .) decides."""
        values = np.asarray(self.values).reshape(len(self.values), -1)
        return np.asarray(values[(share[:, 0] * len(values)).astype(np.int64)])

    def extremes(self, own: np.ndarray) -> list[np.ndarray]:
        """Return all values."""
        return [np.atleast_1d(value) for value in self.values]


Distribution = Uniform | Near | Choice
Field = Distribution | Mapping[int | str, Distribution] | None


@dataclass(frozen=True)
class Randomize:
    """What is drawn for every episode; fields that are None stay as the game has them.

    Attributes
    ----------
    start, goal : points, of all state components or of positions only.
    lam : weights of time.
    noise : variances s of the noise, which is s I.
    size : factors of the agents' bodies.
    agents : numbers of agents that play, the first ones of the game; the others are missing.
    shared : names among ``lam``, ``noise`` and ``size`` of which one draw holds for all agents.

    Raises
    ------
    InputError
        If a field is no distribution.  Whether it fits a game is checked by the simulator.
    """

    start: Field = None
    goal: Field = None
    lam: Field = None
    noise: Field = None
    size: Field = None
    agents: Choice | None = None
    shared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in FIELDS:
            draw = getattr(self, field)
            pairs = list(draw.items()) if isinstance(draw, Mapping) else [(0, draw)]
            if isinstance(draw, _Draws):
                continue
            for key, one in pairs:
                require(
                    isinstance(one, Distribution) or (draw is None and key == 0),
                    f"randomize.{field}",
                    f"is {one!r:.60}",
                    "give a Uniform, Near or Choice, or a mapping from agents to them",
                )
            if isinstance(draw, Mapping):
                object.__setattr__(self, field, _Draws(tuple(pairs)))
        whole = isinstance(self.agents, Choice) and all(
            isinstance(n, float) and n >= 1 and n == int(n) for n in self.agents.values
        )
        require(
            self.agents is None or whole,
            "randomize.agents",
            f"is {self.agents!r:.60}",
            "give a Choice of whole numbers, as in Choice(range(2, 6))",
        )
        shared = (self.shared,) if isinstance(self.shared, str) else tuple(self.shared)
        object.__setattr__(self, "shared", shared)
        for name in shared:
            require(
                name in SCALARS and getattr(self, name) is not None,
                "randomize.shared",
                f"names {name!r}",
                "name fields that are drawn, among " + ", ".join(SCALARS),
            )

    def each(self, field: str, names: Sequence[str]) -> list[Distribution | None]:
        """Return the distribution of ``field`` for each of the agents, None where it has none.

        Raises
        ------
        InputError
            If an agent is not in the game.
        """
        draw = getattr(self, field)
        if not isinstance(draw, _Draws):
            return [draw] * len(names)
        result: list[Distribution | None] = [None] * len(names)
        for agent, one in by_agent(draw.pairs, names, f"randomize.{field}"):
            result[agent] = one
        return result

    def counts(self, agents: int) -> tuple[int, ...]:
        """Return the numbers of agents that may play, of ``agents`` in the game."""
        return (agents,) if self.agents is None else tuple(map(int, np.ravel(self.agents.values)))


@dataclass(frozen=True)
class _Draws:
    """Distributions of some agents, as pairs that hash."""

    pairs: tuple[tuple[int | str, Distribution], ...]


def by_agent(
    pairs: Iterable[tuple[Any, Any]], names: Sequence[str], place: str
) -> list[tuple[int, Any]]:
    """Return pairs of an agent's number and its value, from names or numbers and values.

    Raises
    ------
    InputError
        If an agent is not in the game, or is named twice.
    """
    numbered = [(agent_number(key, names, place), value) for key, value in pairs]
    for i, (agent, _) in enumerate(numbered):
        twice = agent in [other for other, _ in numbered[:i]]
        require(not twice, place, f"names agent {agent} twice", "give each agent one value")
    return numbered


def agent_number(key: Any, names: Sequence[str], place: str) -> int:
    """Return the number of the agent that ``key`` names, or whose number it is.

    Raises
    ------
    InputError
        If there is none.
    """
    if isinstance(key, str) and key in names:
        return list(names).index(key)
    whole = is_whole(key)
    if whole and 0 <= key < len(names):
        return int(key)
    remedy = f"count agents from 0, or use names such as {names[0]}"
    raise InputError(place, f"names agent {key!r:.60} of {len(names)}", remedy)


def _frozen(distribution: Any, field: str) -> np.ndarray:
    """Replace a field by nested tuples of floats, and return it as an array."""
    with placed(type(distribution).__name__):
        array = finite_array(getattr(distribution, field), field, "give numbers")
    value = array.tolist()
    if isinstance(value, list):
        value = tuple(tuple(v) if isinstance(v, list) else v for v in value)
    object.__setattr__(distribution, field, value)
    return array
