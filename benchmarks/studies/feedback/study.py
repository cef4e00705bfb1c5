"""The study ``feedback``: its question, its extent, and the presentation of its rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from benchmarks.studies.feedback.data import cells, digest
from benchmarks.studies.feedback.figure import draw_all
from benchmarks.studies.feedback.findings import findings
from benchmarks.studies.feedback.measures import by_game
from benchmarks.studies.feedback.tables import tables
from benchmarks.studies.results import StudyRow, crash_event
from benchmarks.studies.study import PAPER, Study, StudyChoice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUESTION = (
    "Which of the paper's findings on selfish and social plans hold among players that observe all "
    "agents, computed and learned?"
)
CHOICE = StudyChoice(("head_on", "intersection"), ("l1",), (0.2, 0.5, 0.8), episodes=20_000)


def draw(rows: Sequence[StudyRow]) -> Mapping[str, Figure]:
    """Draw the figures of cost, crash probability and regret."""
    return draw_all(by_game(rows), crash_event(rows))


STUDY = Study(
    "feedback", QUESTION, CHOICE, cells, tables, findings, draw, digest=digest, more=PAPER
)
