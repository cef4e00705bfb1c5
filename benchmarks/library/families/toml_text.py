"""Game tables as TOML with one line per field: a third of the size of a general writer's text."""

from __future__ import annotations

import json
import math
from typing import Any

from benchmarks.library.families.tables import Table


def toml_text(name: str, tables: Table) -> str:
    """Return the text of the file of the game ``name``."""
    lines = ["[game]", f"name = {json.dumps(name)}", *_fields(tables["game"])]
    for kind in ("agent", "obstacle"):
        for table in tables.get(kind, ()):
            lines += ["", f"[[{kind}]]", *_fields(table)]
    return "\n".join(lines) + "\n"


def _fields(table: Table) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in table.items()]


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(_fields(value)) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return json.dumps(value)
