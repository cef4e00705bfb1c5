"""One door to every game: a scenario by name, a family with arguments, or a file.

make_game("head_on", speed="l1", lam=0.3)
make_game("circle(10, radius=90)")
make_game("my_game.toml", horizon=20)
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import AGENT_KEYS, GAME_KEYS, read_control, read_game, read_shape
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope
from ppg_env.scenarios.course import Course
from ppg_env.scenarios.registry import registry

SPEEDS: dict[str, Callable[[float, int], Polytope]] = {
    "box": lambda limit, dim: Polytope.box([2 * limit] * dim),
    "l1": lambda limit, dim: Polytope.l1(limit, dim),
    "disc": lambda limit, dim: Polytope.disc(limit),
}
TOP_SPEED = 10.0
BODY_SIDE = 15.0

LONGEST_CALL = 200
"""Characters of a scenario's call that are read; nobody needs more, and the parser has limits."""


def scenarios() -> dict[str, str]:
    """Every scenario and family: its call, such as ``circle(n=6, radius=None)``, and what it is."""
    listing = {}
    for name, function in registry().items():
        shown = str(inspect.signature(function).replace(return_annotation=inspect.Signature.empty))
        plain = [f"{p.name}={p.default}" for p in inspect.signature(function).parameters.values()]
        call = name + (f"({', '.join(plain)})" if shown != "()" else "")
        listing[call] = (inspect.getdoc(function) or "").splitlines()[0]
    return listing


def make_game(name_or_path: str | Path, **overrides: Any) -> Game:
    """The game of a scenario, a family such as ``circle(10)``, or a TOML file.

    Parameters
    ----------
    name_or_path
        A name of :func:`scenarios`, with arguments if it takes any, or a path ending in .toml.
    **overrides
        Any field of :class:`Game` or :class:`Agent`.  ``speed`` ('box', 'l1' or 'disc', top
        speed 10) sets the control set of a scenario.  An agent's field given once goes for all;
        a mapping from agent index to value sets single agents, and numbers ``lam`` and ``gain``
        may be lists of one per agent.

    Raises
    ------
    InputError
        If there is no such scenario, an argument does not fit, or the game is not valid.
    """
    text = str(name_or_path)
    if text.endswith(".toml") or isinstance(name_or_path, Path):
        game = read_game(name_or_path)
    else:
        game = _from_course(*_call(text))
    return override_game(game, **overrides)


def override_game(game: Game, **overrides: Any) -> Game:
    """``game`` with fields replaced, as in :func:`make_game`; None leaves a field as it is."""
    changes = {key: value for key, value in overrides.items() if value is not None}
    if "speed" in changes:
        require("control" not in changes, "speed", "is given beside control", "give one of the two")
        changes["control"] = _speed(changes.pop("speed"), game.agents[0].control_dim)
    for key in changes:
        if key not in (*AGENT_KEYS, *GAME_KEYS, "obstacles"):
            known = ", ".join((*GAME_KEYS, *AGENT_KEYS, "obstacles", "speed"))
            raise InputError(key, "is not a field of a game", f"use one of {known}")
    agents = list(game.agents)
    for i in range(len(agents)):
        chosen = {
            key: value
            for key in AGENT_KEYS
            if key in changes and key != "name"
            for value in _for_agent(key, changes[key], i, len(agents))
        }
        with placed(f"agent[{i}]"):
            for key, value in chosen.items():
                chosen[key] = _polytope(key, value, agents[i])
            agents[i] = replace(agents[i], **chosen) if chosen else agents[i]
    head = {key: changes[key] for key in (*GAME_KEYS, "obstacles") if key in changes}
    if "objective" in head and head["objective"] != game.objective:
        head.setdefault("margin_cap", None)  # each objective has its own default cap
    return replace(game, agents=tuple(agents), **head)


def _from_course(name: str, course: Course) -> Game:
    agents = tuple(
        Agent(
            start=np.array(start),
            goal=np.array(goal),
            shape=Polytope.box([BODY_SIDE] * len(start)),
            control=_speed("box", len(start)),
            gain=np.array(0.5),
        )
        for start, goal in zip(course.starts, course.goals, strict=True)
    )
    return Game(agents=agents, obstacles=course.obstacles, horizon=course.horizon, name=name)


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
    """The value of one agent in a list of its own; empty where it has none."""
    if isinstance(value, Mapping) and all(isinstance(k, (int, np.integer)) for k in value):
        strange = [k for k in value if not 0 <= k < count]
        require(not strange, key, f"names agent {strange[:1]} of {count}", "count agents from 0")
        return [value[i]] if i in value else []
    listed = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim == 1)
    if key in ("lam", "gain") and listed and all(np.ndim(item) == 0 for item in value):
        require(
            len(value) == count,
            key,
            f"has {len(value)} numbers for {count} agents",
            "give one number for all, or one per agent",
        )
        return [value[i]]
    return [value]


def _polytope(key: str, value: Any, agent: Agent) -> Any:
    """Shapes and control sets may be written as in a game file."""
    tables = value if isinstance(value, list) and value else [value]
    if key not in ("shape", "control") or not all(isinstance(one, Mapping) for one in tables):
        return value
    if key == "control":
        return read_control(value, agent.control_dim)
    with placed(key):
        return read_shape(value)


def _call(text: str) -> tuple[str, Course]:
    """Parse ``name`` or ``name(arguments)``; literals only, nothing is evaluated."""
    name, functions = text.split("(")[0].strip(), registry()
    if name not in functions:
        import difflib

        close = difflib.get_close_matches(name, functions, 1)
        hint = (
            f"did you mean {close[0]!r}, or a file ending in .toml"
            if close
            else ("use one of " + ", ".join(functions) + ", or a file ending in .toml")
        )
        raise InputError(repr(text), "is not a scenario", hint)
    function, positional, named = functions[name], [], {}
    signature = inspect.signature(function)
    shown = f"{name}({', '.join(signature.parameters)})" if signature.parameters else name
    if "(" in text:
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
    for key, value in signature.bind(*positional, **named).arguments.items():
        whole = isinstance(value, int) and not isinstance(value, bool)
        wanted = signature.parameters[key].annotation
        number = whole or (isinstance(value, float) and np.isfinite(value))
        fits = whole if wanted == "int" else number or value is None
        kind = "whole number" if wanted == "int" else "number"
        require(fits, repr(text), f"has {key} = {value!r}", f"write a {kind}")
    with placed(repr(text), ": "):
        return text, function(*positional, **named)
