"""Games by name: a scenario, a family with arguments, or a file.

make_game("head_on", speed="l1", lam=0.3)
make_game("circle(10, radius=90)")
make_game("my_game.toml", horizon=20)
"""

from __future__ import annotations

import ast
import inspect
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import AGENT_KEYS, GAME_KEYS, MOST_AGENTS, read_game
from ppg_env.formats.keys import nearest
from ppg_env.formats.obstacle_tables import read_obstacles
from ppg_env.formats.polytope_tables import read_control, read_shape, read_within
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.polytope import Polytope
from ppg_env.scenarios.course import Course
from ppg_env.scenarios.registry import load_registry, registry

SPEEDS: dict[str, Callable[[float, int], Polytope]] = {
    "box": lambda limit, dim: Polytope.box([2 * limit] * dim),
    "l1": lambda limit, dim: Polytope.l1(limit, dim),
    "disc": lambda limit, dim: Polytope.disc(limit),
}
TOP_SPEED = 10.0
BODY_SIDE = 15.0

LONGEST_CALL = 200
"""Characters read of a scenario's call: no call needs more, and the parser has limits."""


class BrokenScenarioWarning(UserWarning):
    """A module of scenarios that fails to import, or whose functions are not annotated."""


def scenarios() -> dict[str, str]:
    """Return the call of every scenario, such as ``circle(n=6, radius=None)``, and its summary.

    A module of scenarios that cannot be used is reported by a :class:`BrokenScenarioWarning`.
    """
    listing = {}
    for name, function in registry().items():
        parameters = inspect.signature(function).parameters.values()
        plain = ", ".join(f"{p.name}={p.default}" for p in parameters)
        call = f"{name}({plain})" if plain else name
        listing[call] = (inspect.getdoc(function) or name).splitlines()[0]
    for sentence in load_registry().broken:
        warnings.warn(f"{sentence}; fix that file.", BrokenScenarioWarning, stacklevel=2)
    return listing


def make_game(name_or_path: str | Path, **overrides: Any) -> Game:
    """Return the game of a scenario, a family such as ``circle(10)``, or a TOML file.

    Parameters
    ----------
    name_or_path
        A name of :func:`scenarios`, with arguments if it takes any, or a path ending in .toml.
    **overrides
        Any field of :class:`Game` or :class:`Agent`.  ``speed`` ('box', 'l1' or 'disc', top
        speed 10) sets the control set of a scenario.  A single value of an agent's field applies
        to all agents; a mapping from agent index to value applies to the agents it names, and
        ``lam``, ``gain``, ``reserve`` and ``effort`` may be lists of one number per agent.
        Shapes, control sets, ``within`` and ``obstacles`` may be tables as in a game file.

    Raises
    ------
    InputError
        If the scenario does not exist, an argument does not fit, or the game is not valid.
    """
    text = str(name_or_path)
    if text.endswith(".toml") or isinstance(name_or_path, Path):
        game = read_game(name_or_path)
    else:
        game = _from_course(text, _course(text))
    return override_game(game, **overrides)


def override_game(game: Game, **overrides: Any) -> Game:
    """Return ``game`` with fields replaced, as in :func:`make_game`; None leaves a field as is."""
    changes = {key: value for key, value in overrides.items() if value is not None}
    if not changes:
        return game
    if "speed" in changes:
        require(
            "control" not in changes, "speed", "is given together with control", "give only one"
        )
        changes["control"] = _speed(changes.pop("speed"), game.agents[0].control_dim)
    fields = (*GAME_KEYS, *AGENT_KEYS, "obstacles", "speed")
    for key in changes:
        if key not in fields:
            raise InputError(key, "is not a field of a game", nearest(key, fields))
    agents = tuple(
        _override_agent(agent, i, len(game.agents), changes) for i, agent in enumerate(game.agents)
    )
    head = {key: changes[key] for key in GAME_KEYS if key in changes}
    if "obstacles" in changes:
        head["obstacles"] = _obstacles(changes["obstacles"])
    if "objective" in head and head["objective"] != game.objective:
        head.setdefault("margin_cap", None)  # each objective has its own default cap
    return replace(game, agents=agents, **head)


def _override_agent(agent: Agent, i: int, count: int, changes: Mapping[str, Any]) -> Agent:
    chosen = {
        key: value
        for key in AGENT_KEYS
        if key in changes and key != "name"
        for value in _for_agent(key, changes[key], i, count)
    }
    if not chosen:
        return agent
    with placed(f"agent[{i}]"):
        return replace(agent, **{k: _as_polytope(k, v, agent) for k, v in chosen.items()})


def _from_course(name: str, course: Course) -> Game:
    agents = []
    for i, (start, goal) in enumerate(zip(course.starts, course.goals, strict=True)):
        with placed(f"agent[{i}]"):
            agents.append(
                Agent(
                    start=np.array(start),
                    goal=np.array(goal),
                    shape=Polytope.box([BODY_SIDE] * len(start)),
                    control=_speed("box", len(start)),
                    gain=np.array(0.5),
                )
            )
    walls = tuple(Obstacle(wall) for wall in course.obstacles)
    return Game(tuple(agents), obstacles=walls, horizon=course.horizon, name=name)


def _speed(word: Any, dim: int) -> Polytope:
    require(
        isinstance(word, str) and word in SPEEDS, "speed", f"is {word!r}", "write box, l1 or disc"
    )
    require(
        word != "disc" or dim == 2,
        "speed",
        f"disc is for 2 inputs, and there are {dim}",
        "write box or l1",
    )
    return SPEEDS[word](TOP_SPEED, dim)


def _for_agent(key: str, value: Any, i: int, count: int) -> list[Any]:
    """Return a list of the value for agent ``i``, empty if it has none."""
    if isinstance(value, Mapping) and all(isinstance(k, (int, np.integer)) for k in value):
        strange = [k for k in value if not 0 <= k < count]
        require(not strange, key, f"names agent {strange[:1]} of {count}", "count agents from 0")
        return [value[i]] if i in value else []
    listed = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim == 1)
    if (
        key in ("lam", "gain", "reserve", "effort")
        and listed
        and all(np.ndim(item) == 0 for item in value)
    ):
        require(
            len(value) == count,
            key,
            f"has {len(value)} numbers for {count} agents",
            "give one number for all, or one per agent",
        )
        return [value[i]]
    return [value]


def _as_polytope(key: str, value: Any, agent: Agent) -> Any:
    """Return the polytopes of a shape or control set written as in a game file."""
    tables = value if isinstance(value, list) and value else [value]
    if key not in ("shape", "control", "within") or not all(
        isinstance(table, Mapping) for table in tables
    ):
        return value
    if key == "within":
        return read_within(value)
    if key == "control":
        return read_control(value, agent.control_dim)
    with placed(key):
        return read_shape(value)


def _obstacles(value: Any) -> Any:
    """Return obstacles of which some may be written as tables of a game file."""
    items = value if isinstance(value, (list, tuple)) else [value]
    obstacles: list[Any] = []
    for k, item in enumerate(items):
        with placed(f"obstacle[{k}]"):
            obstacles += read_obstacles(item) if isinstance(item, Mapping) else [item]
    return obstacles


def _course(text: str) -> Course:
    """Return the course of ``name`` or ``name(arguments)``, whose arguments are literals."""
    name = text.split("(")[0].strip()
    function = _scenario(text, name)
    signature = inspect.signature(function)
    positional, named = _arguments(text, name, signature) if "(" in text else ([], {})
    for key, value in signature.bind(*positional, **named).arguments.items():
        _check_argument(text, key, value, signature.parameters[key].annotation in ("int", int))
    try:
        with placed(repr(text), ": "):
            course = function(*positional, **named)
    except InputError:
        raise
    except Exception as error:  # a mistake in the scenario's file, not in the call
        problem = f"fails with {type(error).__name__}: {error}"
        raise InputError(repr(text), f"{problem:.200}", f"fix {_file_of(function)}") from None
    if not isinstance(course, Course):
        raise InputError(repr(text), "returns no Course", f"fix {_file_of(function)}")
    return course


def _file_of(function: Callable[..., Course]) -> str:
    return inspect.getsourcefile(function) or function.__module__


def _scenario(text: str, name: str) -> Callable[..., Course]:
    functions, broken = registry(), load_registry().broken
    if name in functions:
        return functions[name]
    raise InputError(
        repr(text),
        " and ".join(("is not a scenario", *broken)),
        f"{nearest(name, functions)}, or a file ending in .toml",
    )


def _arguments(
    text: str, name: str, signature: inspect.Signature
) -> tuple[list[Any], dict[str, Any]]:
    shown = f"{name}({', '.join(signature.parameters)})" if signature.parameters else name
    try:
        call = ast.parse(text[:LONGEST_CALL], mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name):
            raise ValueError
        positional = [ast.literal_eval(value) for value in call.args]
        named = {str(word.arg): ast.literal_eval(word.value) for word in call.keywords}
        signature.bind(*positional, **named)
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        raise InputError(
            f"{text!r:.80}", "has arguments that do not fit", f"write {shown}"
        ) from None
    return positional, named


def _check_argument(text: str, key: str, value: Any, whole: bool) -> None:
    kinds = (int,) if whole else (int, float, type(None))
    fits = isinstance(value, kinds) and not isinstance(value, bool)
    largest = MOST_AGENTS if key == "n" else tol.LARGEST
    require(
        fits and (value is None or abs(value) <= largest),
        repr(text),
        f"has {key} = {value!r:.40}",
        f"write a {'whole number' if whole else 'number'} of at most {largest:g} in size",
    )
