"""Names are text: they are checked where they come in, and other text is made printable."""

from __future__ import annotations

from typing import Any

from ppg_env.errors import require

LONGEST_NAME = 64
"""Characters of a name."""

REMEDY = f"write a name of 1 to {LONGEST_NAME} printable characters in quotes"


def require_name(value: Any, place: str) -> None:
    """Refuse a name that tables, pictures and pages could not show.

    Raises
    ------
    InputError
        If ``value`` is not text, is blank, is longer than :data:`LONGEST_NAME`, or has a character
        that is not printable: a control character, a line break, a change of writing direction.
    """
    require(isinstance(value, str), place, "is not a text", REMEDY)
    require(bool(value.strip()), place, "is empty", REMEDY)
    require(len(value) <= LONGEST_NAME, place, f"has {len(value)} characters", REMEDY)
    strange = next((c for c in value if not c.isprintable()), None)
    require(strange is None, place, f"has the character {strange!a}, not printable", REMEDY)


def printable(text: str) -> str:
    """Return ``text`` with escapes in place of its characters that are not printable.

    A terminal would obey escape sequences; lone surrogates could not be written at all.
    """
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )
