"""Sweeps: cells addressed by what determines them, rows in an SQLite store.

``sweep(cells, path)`` returns the rows of ``cells``, after a run of those that the store lacks.
"""

from benchmarks.sweeps.cell import Cell
from benchmarks.sweeps.row import Row
from benchmarks.sweeps.run import sweep
from benchmarks.sweeps.store import Store

__all__ = ["Cell", "Row", "Store", "sweep"]
