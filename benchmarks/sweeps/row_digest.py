"""A digest of a stored row, by which damage is seen."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any


def row_digest(entries: Sequence[Any]) -> bytes:
    """Return the SHA-256 of the ``entries`` of a row, as SQLite returns them, with their types."""
    digest = hashlib.sha256()
    for entry in entries:
        content = (
            entry if isinstance(entry, bytes) else _text(entry).encode(errors="surrogateescape")
        )
        digest.update(f"{type(entry).__name__} {len(content)} ".encode())
        digest.update(content)
    return digest.digest()


def _text(entry: Any) -> str:
    return entry if isinstance(entry, str) else repr(entry)
