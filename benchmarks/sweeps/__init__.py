"""Sweeps: cells addressed by what determines their results, rows in an SQLite store.

``sweep(cells, path)`` runs the cells that the store lacks, and returns the rows of all cells.
"""

from benchmarks.sweeps.cell import Cell
from benchmarks.sweeps.row import Row
from benchmarks.sweeps.run import sweep
from benchmarks.sweeps.store import Store

__all__ = ["Cell", "Row", "Store", "sweep"]
