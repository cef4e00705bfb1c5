"""What a study is: a question, cells that bear on it, and what their rows tell.

Rows are plain: what JSON can hold, a dictionary for each cell.  Most studies are made of the cells
of :mod:`benchmarks.sweeps`, which a store keeps whole, plans and all; a row is then a digest of
what the store has.  A study whose cells are of another kind says how to run one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.studies.results import StudyRow, completed, digested

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from benchmarks import sweeps

SPEEDS = ("l1", "disc", "box")
PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")
"""The scenarios of the paper."""

OUT_OF_REACH = {("intersection3", 8.0)}
"""Scenarios and caps M' whose optimum takes longer to prove (l1 speed, without feedback) than all
the rest of a study; studies leave them out.
"""


@dataclass(frozen=True)
class Choice:
    """What a study ranges over; the command line can narrow it."""

    scenarios: tuple[str, ...]
    speeds: tuple[str, ...]
    lams: tuple[float, ...]
    episodes: int
    seed: int = 0


@dataclass(frozen=True)
class Table:
    """What a study tells in a table; the first ``texts`` columns are words."""

    title: str
    columns: tuple[str, ...]
    lines: Sequence[tuple[str, ...]]
    note: str = ""
    texts: int = 1


@dataclass(frozen=True)
class Study:
    """An experiment that is told with tables, figures and words.

    Attributes
    ----------
    name : as on the command line, and in the names of files.
    question : what it asks, in a sentence.
    choice : everything it ranges over.
    cells : its cells, those of a sweep or its own; own ones are frozen dataclasses.
    tables, words, draw : what rows say, in tables, in sentences that the data write, and in
        figures by what is added to the name of their file (nothing, if there is one).
    digest : for a sweep's cells, what to keep of a row besides its ``address``.
    run : otherwise, the row of a cell, from (cell, episodes, seed): the fields of the cell,
        ``episodes``, ``seed``, and what was found.
    """

    name: str
    question: str
    choice: Choice
    cells: Callable[[Choice], Sequence[Any]]
    tables: Callable[[Sequence[StudyRow]], Iterable[Table]]
    words: Callable[[Sequence[StudyRow]], Iterable[str]]
    draw: Callable[[Sequence[StudyRow]], Mapping[str, Figure]]
    digest: Callable[[sweeps.Row], StudyRow] | None = None
    run: Callable[[Any, int, int], StudyRow] | None = None

    def rows(
        self,
        choice: Choice,
        results: Path,
        store: Path,
        *,
        jobs: int = 1,
        progress: Callable[[int], None] = lambda _count: None,
    ) -> list[StudyRow]:
        """Rows of the cells of ``choice``, in order; those that ``results`` has are not run again.

        Rows of a sweep's cells are taken from ``store`` if it has them, and kept there in full.
        """
        todo = self.cells(choice)
        if self.digest is not None:
            return digested(
                results, self.name, todo, self.digest, store, jobs=jobs, progress=progress
            )
        assert self.run is not None
        asked = {"episodes": choice.episodes, "seed": choice.seed}

        def same(cell: Any, row: StudyRow) -> bool:
            return all(row.get(key) == value for key, value in (vars(cell) | asked).items())

        return completed(
            results,
            self.name,
            todo,
            partial(self.run, **asked),
            same,
            jobs=jobs,
            progress=progress,
        )
