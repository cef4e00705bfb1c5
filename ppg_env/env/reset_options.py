"""Options of ``reset``: values of one episode, in place of those of the game.

    env.reset(options={"lam": 0.8, "start": {"agent_0": [20.0, 50.0]}, "noise": 0.0})

=====================  ==========================================================================
option                 value
=====================  ==========================================================================
``start``, ``goal``    a point for all agents, a list of one point per agent, or a mapping from
                       agents (names or numbers) to points; positions alone leave other components
                       as the game has them.  Where one agent learns, a single point is its own
``lam``                a number for all agents, a list of one per agent, or a mapping
``noise``              a covariance, or a number s for s I; for all agents, or a mapping
``size``               a factor of the agents' bodies, in the forms of ``lam``
``agents``             how many agents play, the first ones; the others are missing
=====================  ==========================================================================

The episode is that of the game with these values, and is refused in one sentence where the game
would be.  What the game derives from its own values stays: the frame and scale of observations,
the arrival regions' widths, and the spaces.  The next reset, by the client or automatic, starts
from the game's values again.  Values that ``randomize`` would draw are not drawn.

Unknown keys are refused, except ``options``, which PettingZoo's own tests pass (Gymnasium's pass
an empty dictionary).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppg_env.env.randomize import Randomize, by_agent
from ppg_env.errors import InputError, placed, require
from ppg_env.formats.keys import check_keys
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope
from ppg_env.support.validation import finite_array, finite_number, is_whole

OPTIONS = ("start", "goal", "lam", "noise", "size", "agents")
OTHERS = ("options",)
"""Keys that are ignored: those of PettingZoo's ``api_test`` and ``parallel_api_test``."""


@dataclass(frozen=True)
class Given:
    """Values given for an episode.

    Attributes
    ----------
    agents : the game's agents with the given values.
    size : (N,) factors of their bodies.
    count : number of agents that play, None if it is not given.
    fields : for each option, (N,) whether the agent's value is given.
    """

    agents: tuple[Agent, ...]
    size: np.ndarray
    count: int | None
    fields: dict[str, np.ndarray]

    @property
    def given(self) -> list[str]:
        """Names of the given fields of agents."""
        return [field for field, agents in self.fields.items() if agents.any()]


def read_options(game: Game, options: Any) -> Given | None:
    """Return the values that ``options`` give for an episode of ``game``, None if there are none.

    Raises
    ------
    InputError
        If a key is unknown, or a value is not one of its agent.
    """
    values = checked_mapping(options)
    given = {k: v for k, v in values.items() if v is not None and k not in OTHERS}
    check_keys(given, OPTIONS, "reset", "options")
    if not given:
        return None
    N = len(game.agents)
    changes: list[dict[str, Any]] = [{} for _ in range(N)]
    fields = {key: np.zeros(N, dtype=bool) for key in OPTIONS}
    with placed("options"):
        for key in given:
            for i, value in _each(game, key, given[key]) if key != "agents" else ():
                changes[i][key], fields[key][i] = value, True
        count = _count(given["agents"], N) if "agents" in given else None
        sizes = [change.pop("size", 1.0) for change in changes]
        size = np.array([checked_size(own, f"agent[{i}].size") for i, own in enumerate(sizes)])
        agents = tuple(map(_changed, range(N), game.agents, changes))
    return Given(agents, size, count, fields)


def checked_mapping(options: Any) -> dict[Any, Any]:
    """Return ``options`` as a new dictionary, an empty one if they are None.

    Raises
    ------
    InputError
        If they are no mapping.
    """
    require(
        options is None or isinstance(options, Mapping),
        "options",
        f"are {options!r:.40}",
        'write a dictionary, as in {"lam": 0.5}',
    )
    return {} if options is None else dict(options)


def for_learner(options: Any, learner: int) -> Any:
    """Return ``options`` in which a single start or goal is that of the ``learner``."""
    if not isinstance(options, Mapping):
        return options
    return {
        key: {learner: value} if key in ("start", "goal") and _is_point(value) else value
        for key, value in options.items()
    }


def whole_point(value: Any, own: np.ndarray, dim: int, place: str) -> np.ndarray:
    """Return a state with the components of ``value``: all of those of ``own``, or positions only.

    Raises
    ------
    InputError
        If there are other numbers of components, or not finite ones.
    """
    sizes = " or ".join(str(size) for size in sorted({own.size, dim}))
    point = finite_array(value, place, f"write {sizes} numbers")
    require(
        point.ndim == 1 and point.size in (own.size, dim),
        place,
        f"is of shape {point.shape} where the agent has {sizes} components",
        f"write {sizes} numbers",
    )
    return np.concatenate([point, own[point.size :]])


def scaled(shape: Polytope, factor: float) -> Polytope:
    """Return the body of ``shape`` times ``factor``."""
    if factor == 1:
        return shape
    if shape.kind == "box":
        return Polytope.box(shape.params[0] * factor)
    return Polytope.from_vertices(shape.vertices * factor)


def _each(game: Game, key: str, value: Any) -> Iterator[tuple[int, Any]]:
    """Yield the agents that ``value`` is for, and each one's own."""
    names: Sequence[str] = game.agent_names
    if isinstance(value, Mapping):
        yield from by_agent(value.items(), names, key)
        return
    depth = _depth(value)
    per_agent = depth == (2 if key in ("start", "goal") else 1)
    if per_agent and key != "noise":
        require(
            len(value) == len(names),
            key,
            f"has {len(value)} entries for {len(names)} agents",
            "give one for each agent, one for all, or a mapping from agents to values",
        )
        yield from enumerate(value)
        return
    for i in range(len(names)):
        yield i, value


def _changed(i: int, agent: Agent, changes: dict[str, Any]) -> Agent:
    if not changes:
        return agent
    with placed(f"agent[{i}]"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of growing errors: the game's agents have been reported
        for key in ("start", "goal"):
            if key in changes:
                changes[key] = whole_point(changes[key], getattr(agent, key), agent.dim, key)
        return replace(agent, **changes)


def checked_size(value: Any, place: str) -> float:
    """Return a factor of a body's size.

    Raises
    ------
    InputError
        If it is no positive number.
    """
    remedy = "write a positive factor such as 1.5"
    size = finite_number(value, place, remedy)
    require(size > 0, place, f"is {size:g}", remedy)
    return size


def _count(value: Any, most: int) -> int:
    whole = is_whole(value)
    require(
        whole and 1 <= value <= most,
        "agents",
        f"is {value!r:.40}",
        f"write how many play, a whole number from 1 to {most}",
    )
    return int(value)


def _is_point(value: Any) -> bool:
    return not isinstance(value, Mapping) and _depth(value) == 1


def _depth(value: Any) -> int:
    """Return the number of axes of nested lists; -1 for what makes no array."""
    try:
        return int(np.ndim(value))
    except ValueError:
        return -1


def refuse_missing_learner(rule: Randomize | None, options: Any, game: Game, learner: int) -> None:
    """Refuse a rule or options with which the ``learner`` would not play.

    Raises
    ------
    InputError
        If there may be an episode without it.
    """
    least = len(game.agents) if rule is None else min(rule.counts(len(game.agents)))
    given = options.get("agents") if isinstance(options, Mapping) else None
    if isinstance(given, (int, np.integer)) and given >= 1:
        least = min(least, int(given))
    if least <= learner:
        raise InputError(
            "agents",
            f"may be {least}, so that the learner, agent {learner}, would not play",
            f"let {learner + 1} agents or more play",
        )
