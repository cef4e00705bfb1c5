"""The interface of a study: a question, its cells, and the presentation of their rows.

A row is a dictionary of JSON values, one for each cell.  Most studies use the cells of
:mod:`benchmarks.sweeps`, whose store keeps complete rows with plans; a row of the study is then a
digest of the stored row.  A study with cells of another kind defines how to run them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.studies.results import StudyRow, completed, digested
from ppg_env.errors import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from benchmarks import sweeps

SPEEDS = ("l1", "disc", "box")
PAPER = ("opposing", "head_on", "parallel", "intersection", "intersection3")
"""The scenarios of the paper."""

OUT_OF_REACH = {("intersection3", 8.0)}
"""Pairs of a scenario and a cap M' that studies leave out: proving their optimum (l1 speed,
without feedback) takes longer than the rest of a study.
"""


@dataclass(frozen=True)
class StudyChoice:
    """The extent of a study; the command line can narrow it.

    ``collisions`` is the rule of all games of a sweep; ``instants`` is the paper's.
    """

    scenarios: tuple[str, ...]
    speeds: tuple[str, ...]
    lams: tuple[float, ...]
    episodes: int
    seed: int = 0
    collisions: str = "instants"


@dataclass(frozen=True)
class Table:
    """A table of results; the first ``texts`` columns are text, the others numbers."""

    title: str
    columns: tuple[str, ...]
    lines: Sequence[tuple[str, ...]]
    note: str = ""
    texts: int = 1


@dataclass(frozen=True)
class Study:
    """An experiment, presented by tables, figures and sentences.

    Attributes
    ----------
    name : name on the command line and in the names of files.
    question : the question, one sentence.
    choice : the whole extent.
    cells : returns the cells: those of a sweep, or frozen dataclasses of the study.
    tables, words, draw : return tables, sentences and figures from rows; figures are keyed by a
        suffix of their file name (empty for a single figure).
    more : scenarios that can be chosen in addition to those of ``choice``.
    digest : for cells of a sweep, returns the part of a row to keep next to its ``address``.
    run : for other cells, returns the row of a cell, from (cell, episodes, seed): the fields of
        the cell, ``episodes``, ``seed`` and the results.
    """

    name: str
    question: str
    choice: StudyChoice
    cells: Callable[[StudyChoice], Sequence[Any]]
    tables: Callable[[Sequence[StudyRow]], Iterable[Table]]
    words: Callable[[Sequence[StudyRow]], Iterable[str]]
    draw: Callable[[Sequence[StudyRow]], Mapping[str, Figure]]
    digest: Callable[[sweeps.Row], StudyRow] | None = None
    run: Callable[[Any, int, int], StudyRow] | None = None
    more: tuple[str, ...] = ()

    def rows(
        self,
        choice: StudyChoice,
        results: Path,
        store: Path,
        *,
        jobs: int = 1,
        progress: Callable[[int], None] = lambda _count: None,
    ) -> list[StudyRow]:
        """Return the rows of the cells of ``choice``, in order; those in ``results`` are not run.

        Rows of a sweep's cells are read from ``store`` if it has them, and else stored there.

        Raises
        ------
        InputError
            If the games shall be swept, and the cells are not those of a sweep.
        """
        todo = self.cells(choice)
        if choice.collisions != "instants":
            remedy = "leave it out: this study measures games with the paper's rule"
            require(self.digest is not None, "collisions", f"is {choice.collisions!r}", remedy)
            rule = {"collisions": choice.collisions}
            todo = [replace(cell, fields={**cell.fields, **rule}) for cell in todo]
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
