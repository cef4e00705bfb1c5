"""Game files: TOML in and out, strictly checked, exact on a round trip.

Reading executes no code; every mistake is one sentence that names the file, the place and the
remedy.  Plan files contain the same tables as plain dictionaries.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.formats.keys import check_keys, require_table
from ppg_env.formats.obstacle_tables import obstacle_table, read_obstacles
from ppg_env.formats.polytope_tables import (
    control_tables,
    read_control,
    read_shape,
    read_within,
    shape_table,
    within_tables,
)
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.support.read_file import MIB, read_text

LARGEST_FILE = 16 * MIB
MOST_DOTS = 40

MOST_AGENTS = 1000
"""Most agents of a game: half a million encounters."""

GAME_KEYS = (
    "horizon",
    "margin_cap",
    "objective",
    "crash_cost",
    "scale",
    "collisions",
    "on_goal",
    "name",
)
AGENT_KEYS = tuple(field.name for field in fields(Agent))


def read_game(path: str | Path) -> Game:
    """Return the game in a TOML file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, or does not describe a game.
    """
    return game_from_tables(read_tables(path), str(path), collisions="swept")


def read_tables(path: str | Path) -> dict[str, Any]:
    """Return the tables of a TOML file, syntax checked only.

    Raises
    ------
    InputError
        If the file is missing or is not TOML.
    """
    text = read_text(path, LARGEST_FILE)
    # The parser's time and memory grow with the square of the length of a dotted key.
    dots = max(part.count(".") for part in re.split(r"[=,{}\[\]\n]", text))
    require(dots <= MOST_DOTS, str(path), f"has a key of {dots} dots", "write keys of a game file")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # tomllib's own error is a ValueError
        raise InputError(
            str(path), f"is not valid TOML ({error})", "fix the syntax there"
        ) from None


def game_from_tables(
    tables: Mapping[str, Any], source: str, *, collisions: str = "instants"
) -> Game:
    """Return the game that ``tables`` (as parsed from TOML or JSON) describe.

    Parameters
    ----------
    tables : the tables ``game``, ``agent`` and ``obstacle``.
    source : name of their file, the place of any error.
    collisions : the rule of tables that name none.

    Raises
    ------
    InputError
        If they do not describe a game.
    """
    with placed(source, ": "):
        return _game(tables, collisions)


def game_to_tables(game: Game) -> dict[str, Any]:
    """Return dictionaries, lists and numbers that :func:`game_from_tables` reads back exactly."""
    head = {key: getattr(game, key) for key in GAME_KEYS}
    tables: dict[str, Any] = {
        "game": {key: value for key, value in head.items() if value is not None},
        "agent": [_agent_table(agent) for agent in game.agents],
    }
    if game.obstacles:
        tables["obstacle"] = [obstacle_table(obstacle) for obstacle in game.obstacles]
    return tables


def game_to_toml(game: Game) -> str:
    """Return the game as the text of a TOML file."""
    import tomli_w

    return tomli_w.dumps(game_to_tables(game))


def _game(tables: Mapping[str, Any], collisions: str) -> Game:
    check_keys(tables, ("game", "agent", "obstacle"), "the file")
    head = {"collisions": collisions, **require_table(tables.get("game", {}), "game")}
    check_keys(head, GAME_KEYS, "[game]", "game")
    agents, obstacles = [], []
    count = len(_list_of_tables(tables.get("agent", []), "agent"))
    require(count <= MOST_AGENTS, "agent", f"has {count} tables", f"write at most {MOST_AGENTS}")
    for i, table in enumerate(_list_of_tables(tables.get("agent", []), "agent")):
        with placed(f"agent[{i}]"):
            agents.append(_agent(table))
    for k, table in enumerate(_list_of_tables(tables.get("obstacle", []), "obstacle")):
        with placed(f"obstacle[{k}]"):
            obstacles += read_obstacles(table)
    try:
        return Game(agents=tuple(agents), obstacles=tuple(obstacles), **head)
    except InputError as error:  # the place is game.horizon, not horizon
        raise (error.within("game") if error.place in GAME_KEYS else error) from None


def _agent(table: Mapping[str, Any]) -> Agent:
    check_keys(table, AGENT_KEYS, "[[agent]]")
    for key in ("start", "goal", "shape", "control"):
        require(key in table, key, "is missing", f"add a line `{key} = ...`")
    values = dict(table)
    with placed("shape"):
        values["shape"] = read_shape(table["shape"])
    inputs = _width(table["B"]) if "B" in table else _length(table["start"])
    values["control"] = read_control(table["control"], inputs)
    if "within" in table:
        values["within"] = read_within(table["within"])
    return Agent(**values)


def _agent_table(agent: Agent) -> dict[str, Any]:
    n = agent.state_dim
    table: dict[str, Any] = {
        "start": agent.start.tolist(),
        "goal": agent.goal.tolist(),
        "lam": agent.lam,
        "gain": np.asarray(agent.gain).tolist(),
        "shape": shape_table(agent.shape),
        "control": control_tables(agent.control),
        "noise": np.asarray(agent.noise).tolist(),
    }
    if not np.array_equal(agent.A, np.eye(n)):
        table["A"] = agent.A.tolist()
    if agent.control_dim != n or not np.array_equal(agent.B, np.eye(n)):
        table["B"] = agent.B.tolist()
    if np.any(agent.sigma0):
        table["sigma0"] = np.asarray(agent.sigma0).tolist()
    if agent.within:
        table["within"] = within_tables(agent.within)
    for key in ("reserve", "effort"):
        if getattr(agent, key):
            table[key] = getattr(agent, key)
    if agent.name is not None:
        table["name"] = agent.name
    return table


def _list_of_tables(value: Any, name: str) -> list[Mapping[str, Any]]:
    ok = isinstance(value, list) and all(isinstance(item, Mapping) for item in value)
    require(ok, name, "is not a list of tables", f"write it as [[{name}]]")
    return value


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0


def _width(value: Any) -> int:
    rows = isinstance(value, list) and value and isinstance(value[0], list)
    return len(value[0]) if rows else 0
