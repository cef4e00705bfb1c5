"""Small cells, and rows without what differs between runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest

from benchmarks.sweeps import Cell, Row


def quick(count: int = 6, episodes: int = 50) -> list[Cell]:
    """Cells of a few milliseconds each."""
    return [
        Cell("parallel", "straight", {"lam": k / count}, episodes=episodes) for k in range(count)
    ]


def timeless(rows: Iterable[Row]) -> list[Row]:
    """Rows by address, without their seconds."""
    return sorted((replace(row, seconds=0.0) for row in rows), key=lambda row: row.address)


@pytest.fixture(scope="session")
def row() -> Row:
    """The row of an equilibrium."""
    from benchmarks.sweeps.row import make_row
    from benchmarks.sweeps.run import play

    cell = Cell("head_on", "nash", {"speed": "l1", "gain": 0.5}, episodes=500)
    return make_row(cell, play((cell, cell.address)))
