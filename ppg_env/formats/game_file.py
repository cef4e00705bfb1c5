"""Game files: TOML in and out, strictly checked, exact on a round trip.

Reading executes no code; every mistake is one sentence that names the file, the place and the
remedy.  Plan files contain the same tables as plain dictionaries.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.errors import InputError, placed, require
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import Controls, checked_controls
from ppg_env.game.polytope import Polytope
from ppg_env.support.validation import finite_array

GAME_KEYS = ("horizon", "margin_cap", "objective", "crash_cost", "scale", "name")
AGENT_KEYS = tuple(field.name for field in fields(Agent))


def read_game(path: str | Path) -> Game:
    """Return the game in a TOML file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, or does not describe a game.
    """
    return game_from_tables(read_tables(path), str(path))


def read_tables(path: str | Path) -> dict[str, Any]:
    """Return the tables of a TOML file, syntax checked only.

    Raises
    ------
    InputError
        If the file is missing or is not TOML.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(str(path), "does not exist", "check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            str(path), f"cannot be read ({error})", "give a text file in UTF-8"
        ) from None
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # tomllib's own error is a ValueError
        raise InputError(
            str(path), f"is not valid TOML ({error})", "fix the syntax there"
        ) from None


def game_from_tables(tables: Mapping[str, Any], source: str) -> Game:
    """Return the game that ``tables`` (as parsed from TOML or JSON) describe.

    Parameters
    ----------
    tables : the tables ``game``, ``agent`` and ``obstacle``.
    source : name of their file, the place of any error.

    Raises
    ------
    InputError
        If they do not describe a game.
    """
    with placed(source, ": "):
        return _game(tables)


def game_to_tables(game: Game) -> dict[str, Any]:
    """Return dictionaries, lists and numbers that :func:`game_from_tables` reads back exactly."""
    head = {key: getattr(game, key) for key in GAME_KEYS}
    tables: dict[str, Any] = {
        "game": {key: value for key, value in head.items() if value is not None},
        "agent": [_agent_table(agent) for agent in game.agents],
    }
    if game.obstacles:
        tables["obstacle"] = [_shape_table(obstacle) for obstacle in game.obstacles]
    return tables


def game_to_toml(game: Game) -> str:
    """Return the game as the text of a TOML file."""
    import tomli_w

    return tomli_w.dumps(game_to_tables(game))


def _game(tables: Mapping[str, Any]) -> Game:
    _check_keys(tables, ("game", "agent", "obstacle"), "", "the file")
    head = _table(tables.get("game", {}), "game")
    _check_keys(head, GAME_KEYS, "game", "[game]")
    agents, obstacles = [], []
    for i, table in enumerate(_list_of_tables(tables.get("agent", []), "agent")):
        with placed(f"agent[{i}]"):
            agents.append(_agent(table))
    for k, table in enumerate(_list_of_tables(tables.get("obstacle", []), "obstacle")):
        with placed(f"obstacle[{k}]"):
            obstacles.append(read_shape(table))
    try:
        return Game(agents=tuple(agents), obstacles=tuple(obstacles), **head)
    except InputError as error:  # the place is game.horizon, not horizon
        raise (error.within("game") if error.place in GAME_KEYS else error) from None


def _agent(table: Mapping[str, Any]) -> Agent:
    _check_keys(table, AGENT_KEYS, "", "[[agent]]")
    for key in ("start", "goal", "shape", "control"):
        require(key in table, key, "is missing", f"add a line `{key} = ...`")
    values = dict(table)
    with placed("shape"):
        values["shape"] = read_shape(table["shape"])
    inputs = _width(table["B"]) if "B" in table else _length(table["start"])
    values["control"] = read_control(table["control"], inputs)
    return Agent(**values)


def read_shape(table: Any) -> Polytope:
    """Return a body or obstacle: ``{ box = [full sides] }``, ``vertices``, ``l1``, ``disc``, ...

    Raises
    ------
    InputError
        If the table is not one of these.
    """
    kind = _kind(table, ("l1", "dim"))
    if kind == "box":
        return Polytope.box(table["box"])
    if kind == "l1":
        return Polytope.l1(table["l1"], table.get("dim", 2))
    return _polytope(kind, table)


def read_control(value: Any, dim: int) -> Controls:
    """Return a control set, or a list of them, all but the first with their first step ``from``.

    Raises
    ------
    InputError
        If a set or step is wrong; its place is ``control`` or an item of the list.
    """
    if not isinstance(value, list):
        with placed("control"):
            return _control_set(value, dim)
    require(bool(value), "control", "is an empty list", "write one set as { box = [10.0, 10.0] }")
    sets = []
    for k, table in enumerate(value):
        with placed(f"control[{k}]"):
            rest = dict(_table(table, ""))
            require(k == 0 or "from" in rest, "", "has no step", "add one, such as from = 5")
            sets.append((rest.pop("from", 0), _control_set(rest, dim)))
    return checked_controls(sets)


def _control_set(table: Any, dim: int) -> Polytope:
    """Return ``{ box = [largest values] }``, ``l1``, ``disc`` and ``sides``, or a general set."""
    kind = _kind(table, ("l1",))
    if kind == "box":
        return Polytope.box(2 * finite_array(table["box"], "box", "write numbers, as in [10, 10]"))
    if kind == "l1":
        return Polytope.l1(table["l1"], dim)
    if kind == "disc":
        require(dim == 2, "disc", f"is for 2 inputs and this agent has {dim}", "write box or l1")
    return _polytope(kind, table)


def _kind(table: Any, l1_keys: tuple[str, ...]) -> str:
    """Return the first key of the kind of polytope that ``table`` describes."""
    kinds = (("box",), l1_keys, ("disc", "sides"), ("vertices",), ("normals", "offsets"))
    _table(table, "")
    for keys in kinds:
        if keys[0] in table and (keys[0] != "normals" or "offsets" in table):
            _alone(table, keys)
            return keys[0]
    written = ", ".join(sorted(map(str, table))) or "nothing"
    raise InputError(
        "", f"has {written}", "write one of box, l1, disc, vertices, normals and offsets"
    )


def _polytope(kind: str, table: Mapping[str, Any]) -> Polytope:
    if kind == "disc":
        return Polytope.disc(table["disc"], table.get("sides", 16))
    if kind == "vertices":
        return Polytope.from_vertices(table["vertices"])
    return Polytope.from_halfspaces(table["normals"], table["offsets"])


def _shape_table(shape: Polytope) -> dict[str, Any]:
    if shape.kind == "box":
        return {"box": shape.params[0].tolist()}
    if shape.kind == "halfspaces":
        return {"normals": shape.params[0].tolist(), "offsets": shape.params[1].tolist()}
    if shape.kind == "l1":
        return {"l1": float(shape.params[0]), "dim": shape.dim}
    if shape.kind == "disc":
        return {"disc": float(shape.params[0]), "sides": int(shape.params[1])}
    return {"vertices": shape.params[0].tolist()}


def _control_tables(control: Controls) -> dict[str, Any] | list[dict[str, Any]]:
    if isinstance(control, Polytope):
        return _control_table(control)
    return [({"from": first} if first else {}) | _control_table(held) for first, held in control]


def _control_table(control: Polytope) -> dict[str, Any]:
    if control.kind == "box":
        return {"box": (control.params[0] / 2).tolist()}
    if control.kind == "l1":
        return {"l1": float(control.params[0])}
    return _shape_table(control)


def _agent_table(agent: Agent) -> dict[str, Any]:
    n = agent.state_dim
    table: dict[str, Any] = {
        "start": agent.start.tolist(),
        "goal": agent.goal.tolist(),
        "lam": agent.lam,
        "gain": np.asarray(agent.gain).tolist(),
        "shape": _shape_table(agent.shape),
        "control": _control_tables(agent.control),
        "noise": np.asarray(agent.noise).tolist(),
    }
    if not np.array_equal(agent.A, np.eye(n)):
        table["A"] = agent.A.tolist()
    if agent.control_dim != n or not np.array_equal(agent.B, np.eye(n)):
        table["B"] = agent.B.tolist()
    if np.any(agent.sigma0):
        table["sigma0"] = np.asarray(agent.sigma0).tolist()
    if agent.name is not None:
        table["name"] = agent.name
    return table


def _table(value: Any, place: str) -> Mapping[str, Any]:
    require(isinstance(value, Mapping), place, "is not a table", "write key = value pairs in { }")
    return value


def _list_of_tables(value: Any, name: str) -> list[Mapping[str, Any]]:
    ok = isinstance(value, list) and all(isinstance(item, Mapping) for item in value)
    require(ok, name, "is not a list of tables", f"write it as [[{name}]]")
    return value


def _check_keys(table: Mapping[str, Any], keys: tuple[str, ...], place: str, what: str) -> None:
    unknown = sorted(set(table) - set(keys))
    if unknown:
        where = f"{place}.{unknown[0]}" if place else str(unknown[0])
        raise InputError(where, f"is not a key of {what}", "use one of " + ", ".join(keys))


def _alone(table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    extra = sorted(set(table) - set(keys))
    if extra:
        raise InputError(str(extra[0]), f"cannot be combined with {keys[0]}", "remove one of them")


def _length(value: Any) -> int:
    return len(value) if isinstance(value, list) else 0


def _width(value: Any) -> int:
    rows = isinstance(value, list) and value and isinstance(value[0], list)
    return len(value[0]) if rows else 0
