"""Rules of random draws as tables of a TOML file: numbers and words, never code.

    [randomize]
    lam = { uniform = [0.05, 0.95] }
    noise = { choice = [1.0, 2.0, 4.0] }
    start = { near = 10.0 }                              # in every component, of every agent
    goal = { agent_1 = { near = [0.0, 5.0] } }           # of one agent, by name or number
    agents = { choice = [2, 3] }
    shared = ["lam"]

The keys are the fields of :class:`~ppg_env.env.Randomize`, and ``uniform``, ``near`` and ``choice``
its distributions.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ppg_env.env.randomize import FIELDS, Choice, Distribution, Near, Randomize, Uniform
from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import read_tables
from ppg_env.formats.keys import check_keys, require_table

KEYS = (*FIELDS, "agents", "shared")
KINDS = ("uniform", "near", "choice")
REMEDY = "write { uniform = [low, high] }, { near = distance } or { choice = [...] }"


def read_randomize(path: str | Path) -> Randomize:
    """Return the rule in the table ``[randomize]`` of a TOML file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, or does not describe a rule.
    """
    tables = read_tables(path)
    with placed(str(path), ": "):
        check_keys(tables, ("randomize",), "a file of random draws")
        require("randomize" in tables, "randomize", "is missing", "add a table [randomize]")
        return randomize_from_table(tables["randomize"])


def randomize_from_table(table: Any) -> Randomize:
    """Return the rule that a table, as parsed from TOML or JSON, describes.

    Raises
    ------
    InputError
        If it describes none, or draws nothing.
    """
    check_keys(require_table(table, "randomize"), KEYS, "[randomize]", "randomize")
    values = {key: value for key, value in table.items() if key != "shared"}
    require(bool(values), "randomize", "draws nothing", "write lam = { uniform = [0.05, 0.95] }")
    with placed("randomize"):
        fields = {key: _field(value, key) for key, value in values.items()}
    shared = table.get("shared", [])
    words = isinstance(shared, list) and all(isinstance(name, str) for name in shared)
    require(words, "randomize.shared", f"is {shared!r:.40}", 'write a list, as in ["lam"]')
    return Randomize(**fields, shared=tuple(shared))


def randomize_to_table(rule: Randomize) -> dict[str, Any]:
    """Return a table that :func:`randomize_from_table` reads back exactly."""
    table: dict[str, Any] = {}
    for field in (*FIELDS, "agents"):
        draw = getattr(rule, field)
        if draw is not None:
            pairs = getattr(draw, "pairs", None)
            each = None if pairs is None else {str(key): _table(one) for key, one in pairs}
            table[field] = _table(draw) if each is None else each
    return table | ({"shared": list(rule.shared)} if rule.shared else {})


def _field(value: Any, place: str) -> Any:
    """Return the distribution of a field, or those of its agents, by name or number."""
    require(isinstance(value, Mapping) and bool(value), place, f"is {value!r:.40}", REMEDY)
    if place == "agents" or not all(isinstance(part, Mapping) for part in value.values()):
        return _distribution(value, place)
    return {
        int(key) if key.isdecimal() else key: _distribution(part, f"{place}.{key}")
        for key, part in value.items()
    }


def _distribution(table: Mapping[str, Any], place: str) -> Distribution:
    check_keys(table, KINDS, "a distribution", place)
    require(len(table) == 1, place, "has " + " and ".join(table), REMEDY)
    ((kind, value),) = table.items()
    pair = isinstance(value, list) and len(value) == 2
    if kind == "uniform" and not pair:
        raise InputError(place, f"is uniform = {value!r:.40}", "write uniform = [low, high]")
    with placed(place):
        if kind == "uniform":
            return Uniform(*value)
        return Near(value) if kind == "near" else Choice(value)


def _table(distribution: Distribution) -> dict[str, Any]:
    if isinstance(distribution, Uniform):
        return {"uniform": [distribution.low, distribution.high]}
    if isinstance(distribution, Near):
        return {"near": distribution.distance}
    return {"choice": list(distribution.values)}
