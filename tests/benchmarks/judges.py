"""Small judges of what ``ppg`` leaves behind."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height of a PNG in pixels, read from its header."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[12:16] == b"IHDR"
    assert data[-8:-4] == b"IEND"
    return struct.unpack(">II", data[16:24])


def timeless(value: Any) -> Any:
    """``value`` without the fields that hold wall times."""
    if isinstance(value, dict):
        return {key: timeless(item) for key, item in value.items() if key != "seconds"}
    if isinstance(value, list):
        return [timeless(item) for item in value]
    return value
