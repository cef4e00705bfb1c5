"""Tables of polytopes in game files: shapes and control sets, read and written.

A body's box has full side lengths, a control box largest values; an L1 ball of controls has the
dimension of the agent's inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ppg_env.errors import InputError, placed, require
from ppg_env.formats.keys import check_keys, require_table
from ppg_env.game.half_spaces import HalfSpaces
from ppg_env.game.input_sets import Controls, checked_controls
from ppg_env.game.polytope import Polytope
from ppg_env.support.validation import finite_array

SET_KEYS = ("box", "l1", "disc", "sides", "vertices", "normals", "offsets")
SHAPE_KEYS = (*SET_KEYS, "dim")
CONTROL_KEYS = (*SET_KEYS, "from")
MOST_ROWS = 1000
"""Most corners or faces of a polytope; time grows with the square of their number."""

WITHIN_KEYS = ("low", "high", *SHAPE_KEYS, "sigmas")


def read_shape(table: Any) -> Polytope:
    """Return a body or obstacle: ``{ box = [full sides] }``, ``vertices``, ``l1``, ``disc``, ...

    Raises
    ------
    InputError
        If the table is not one of these.
    """
    check_keys(require_table(table, ""), SHAPE_KEYS, "a body")
    return body_of(table)


def body_of(table: Mapping[str, Any]) -> Polytope:
    """Return the polytope of a table whose keys were checked; a box has full side lengths."""
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
            rest = dict(require_table(table, ""))
            require(k == 0 or "from" in rest, "", "has no step", "add one, such as from = 5")
            sets.append((rest.pop("from", 0), _control_set(rest, dim)))
    return checked_controls(sets)


def _control_set(table: Any, dim: int) -> Polytope:
    """Return ``{ box = [largest values] }``, ``l1``, ``disc`` and ``sides``, or a general set."""
    check_keys(require_table(table, ""), CONTROL_KEYS, "a control set")
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
    rows = table[kind]
    count = len(rows) if isinstance(rows, list) else 0
    require(count <= MOST_ROWS, kind, f"has {count} rows", f"write at most {MOST_ROWS}")
    if kind == "vertices":
        return Polytope.from_vertices(table["vertices"])
    return Polytope.from_halfspaces(table["normals"], table["offsets"])


def read_within(value: Any) -> tuple[HalfSpaces, ...]:
    """Return the sets in which a mean stays: one table, or a list of tables that all hold.

    Each is ``{ low, high }`` (inf for no limit), ``{ box = [largest values] }``, ``{ vertices }``
    or ``{ normals, offsets }``, of positions or of whole states, with ``sigmas`` if wanted.

    Raises
    ------
    InputError
        If a table is not one of these.
    """
    listed = value if isinstance(value, list) else [value]
    regions = []
    for k, table in enumerate(listed):
        with placed("within" if len(listed) == 1 else f"within[{k}]"):
            regions.append(_region(require_table(table, "")))
    return tuple(regions)


def _region(table: Mapping[str, Any]) -> HalfSpaces:
    check_keys(table, WITHIN_KEYS, "within")
    rest = dict(table)
    sigmas = rest.pop("sigmas", 0.0)
    if "low" in rest or "high" in rest:
        for key, other in (("low", "high"), ("high", "low")):
            require(key in rest, key, f"is missing next to {other}", "add it, inf for no limit")
        _alone(rest, ("low", "high"))
        return HalfSpaces.between(rest["low"], rest["high"], sigmas)
    if set(rest) == {"normals", "offsets"}:
        return HalfSpaces(rest["normals"], rest["offsets"], sigmas)
    if _kind(rest, ("l1", "dim")) == "box":
        largest = finite_array(rest["box"], "box", "write one number per component")
        return HalfSpaces.between(-largest, largest, sigmas)
    return HalfSpaces.of(body_of(rest), sigmas)


def within_tables(within: tuple[HalfSpaces, ...]) -> list[dict[str, Any]]:
    """Return the tables of the sets in which a mean stays."""
    return [
        {"normals": w.normals.tolist(), "offsets": w.offsets.tolist(), "sigmas": w.sigmas}
        for w in within
    ]


def shape_table(shape: Polytope) -> dict[str, Any]:
    """Return the table of a body or obstacle."""
    if shape.kind == "box":
        return {"box": shape.params[0].tolist()}
    if shape.kind == "halfspaces":
        return {"normals": shape.params[0].tolist(), "offsets": shape.params[1].tolist()}
    if shape.kind == "l1":
        return {"l1": float(shape.params[0]), "dim": shape.dim}
    if shape.kind == "disc":
        return {"disc": float(shape.params[0]), "sides": int(shape.params[1])}
    return {"vertices": shape.params[0].tolist()}


def control_tables(control: Controls) -> dict[str, Any] | list[dict[str, Any]]:
    """Return the table of a control set, or the list of tables of sets that change."""
    if isinstance(control, Polytope):
        return _control_table(control)
    return [
        ({"from": first} if first else {}) | _control_table(admissible)
        for first, admissible in control
    ]


def _control_table(control: Polytope) -> dict[str, Any]:
    if control.kind == "box":
        return {"box": (control.params[0] / 2).tolist()}
    if control.kind == "l1":
        return {"l1": float(control.params[0])}
    return shape_table(control)


def _alone(table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    extra = sorted(set(table) - set(keys))
    if extra:
        raise InputError(str(extra[0]), f"cannot be combined with {keys[0]}", "remove one of them")
