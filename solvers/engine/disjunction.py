"""Disjunctions: one encounter at one event, of whose faces at least one has to hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Clearance:
    """Clearance of a face at an instant: values . x[columns] + constant, ``unit`` per margin."""

    columns: np.ndarray
    values: np.ndarray
    constant: float
    unit: float


@dataclass(frozen=True)
class Face:
    """One term of a disjunction: face ``index`` p of the collision set.

    It has one clearance at an instant, and those at both ends of a step.  ``least`` is the
    smallest loss that it allows.
    """

    index: int
    clearances: tuple[Clearance, ...]
    least: float


@dataclass(frozen=True)
class Disjunction:
    """One encounter at one undecided event, an instant or the step that starts there.

    Attributes
    ----------
    encounter, time : what is undecided.
    margin, loss : columns of the margin, if there is one, and of the loss.
    cap, lowest : largest margin and smallest loss within reach.
    weight : weight of the loss in the objective.
    faces : the faces that can be reached.
    """

    encounter: int
    time: int
    margin: int | None
    loss: int
    cap: float
    lowest: float
    weight: float
    faces: tuple[Face, ...]


Choice = tuple[tuple[int, int], ...]
"""The branching decisions of a node: pairs (disjunction, face) that hold there."""
