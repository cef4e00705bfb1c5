"""Provenance: who or what found a plan, when, and on what class of machine."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any


def provenance(by: str, command: str = "", seconds: float | None = None) -> dict[str, Any]:
    """Return the entries of a record about the origin of a plan or bound."""
    try:
        release = version("path-planning-games")
    except PackageNotFoundError:  # run from a checkout that is not installed
        release = "checkout"
    origin: dict[str, Any] = {"by": by, "date": datetime.now(UTC).date().isoformat()}
    origin |= {"version": release, "machine": f"{os.cpu_count()} cores, {platform.machine()}"}
    if command:
        origin["command"] = command
    if seconds is not None:
        origin["seconds"] = round(seconds, 3)
    return origin
