"""Keys of tables: an unknown one is refused by that word, with the nearest known key."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ppg_env.errors import InputError, require


def require_table(value: Any, place: str) -> Mapping[str, Any]:
    """Return ``value`` if it is a table, else refuse it."""
    require(isinstance(value, Mapping), place, "is not a table", "write key = value pairs in { }")
    return value


def check_keys(table: Mapping[str, Any], known: Iterable[str], what: str, place: str = "") -> None:
    """Refuse the first key of ``table``, in alphabetical order, that is not one of ``known``."""
    names = list(known)
    unknown = sorted(str(key) for key in table if key not in names)
    if unknown:
        where = f"{place}.{unknown[0]}" if place else unknown[0]
        raise InputError(where, f"is an unknown key of {what}", nearest(unknown[0], names))


def nearest(word: str, names: Iterable[str]) -> str:
    """Return the remedy for a word that is not one of ``names``."""
    import difflib

    listed = list(names)
    close = difflib.get_close_matches(word, listed, 1)
    return f"perhaps you mean {close[0]!r}" if close else "use one of " + ", ".join(listed)
