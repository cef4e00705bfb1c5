r"""The branching rule: which disjunction to branch on, and its children.

A node branches where the relaxation underestimates the loss most; disjunctions at which bodies
overlap come first.  There is one child per face, and the face with the largest margin is explored
first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppg_env.game import objective
from solvers.engine.disjunction import Choice, Disjunction
from solvers.engine.node_lp import Relaxation
from solvers.engine.symmetry import Symmetry


@dataclass(frozen=True)
class RelaxationErrors:
    """Errors of the relaxed losses at a point.

    Attributes
    ----------
    margins : (F,) margin of every face.
    best : (K,) largest margin of each disjunction, at most its cap.
    gaps : (K,) weighted loss less the relaxed one; infinite where bodies overlap.
    total : sum of the positive gaps.
    spare : sum of the negative gaps, also where a better face than the chosen one counts.
    """

    margins: np.ndarray
    best: np.ndarray
    gaps: np.ndarray
    total: float
    spare: float


def relaxation_errors(lp: Relaxation, point: np.ndarray) -> RelaxationErrors:
    """Return by how much the relaxation underestimates each disjunction's loss at ``point``."""
    faces = lp.faces
    margins = faces.margins(point)
    best = np.minimum(np.maximum.reduceat(margins, faces.first), faces.caps)
    losses = objective.loss(lp.program.game, np.maximum(best, 0.0)) - point[faces.losses]
    gaps = np.where(best >= 0, faces.weights * losses, np.inf)
    spare = np.minimum(gaps, 0.0).sum()
    gaps[lp.active] = 0.0
    return RelaxationErrors(margins, best, gaps, float(np.maximum(gaps, 0.0).sum()), float(spare))


def select_disjunction(lp: Relaxation, errors: RelaxationErrors) -> int:
    """Return the disjunction to branch on."""
    overlap = np.flatnonzero(np.isinf(errors.gaps))
    return _first_overlap(lp, overlap, errors.best) if len(overlap) else int(errors.gaps.argmax())


def _first_overlap(lp: Relaxation, overlap: np.ndarray, best: np.ndarray) -> int:
    """Return the disjunction to decide first among those at which bodies overlap.

    A single mover finds a gap in a crowd soonest if its position half-way is decided first; for
    several movers, the smallest overlap shows best on which side they pass.  (Both were measured
    against selection by depth, time and crowding.)
    """
    arrivals = lp.program.arrivals
    if len(arrivals) > 1:
        return int(overlap[best[overlap].argmax()])
    times = lp.faces.times[overlap]
    distance = np.minimum(times, max(arrivals.values()) - times)
    middle = overlap[distance == distance.max()]
    return int(middle[best[middle].argmin()])


def children(
    lp: Relaxation,
    mirrors: Sequence[Symmetry],
    choice: Choice,
    k: int,
    margins: np.ndarray,
    value: float,
) -> list[tuple[float, Choice]]:
    """Return a child per face of disjunction ``k`` with its bound, the most promising last."""
    faces, disjunction = lp.faces, lp.program.disjunctions[k]
    # The relaxation let this loss be as small as possible; a face makes it larger.
    increase = np.maximum(faces.least[k] - faces.lowest[k], 0.0)
    bounds = value + lp.reduced_cost(disjunction) * increase
    order = margins.argsort(kind="stable").tolist()
    if len(mirrors) > 1:
        order = _distinct(lp, mirrors, choice, disjunction, order)
    return [(float(bounds[p]), (*choice, (k, p))) for p in order]


def _distinct(
    lp: Relaxation,
    mirrors: Sequence[Symmetry],
    choice: Choice,
    disjunction: Disjunction,
    order: list[int],
) -> list[int]:
    """Return one face of each orbit under the symmetries that keep ``choice``."""
    decided = {lp.program.face_key(k, p) for k, p in choice}
    stabiliser = [
        mirror
        for mirror in mirrors
        if {(mirror.encounters[e], t, mirror.faces[e][p]) for e, t, p in decided} == decided
        and mirror.encounters[disjunction.encounter] == disjunction.encounter
    ]
    kept: dict[int, int] = {}
    for p in order:  # the most promising face comes last and is kept
        face = disjunction.faces[p].index
        kept[min(mirror.faces[disjunction.encounter][face] for mirror in stabiliser)] = p
    return [p for p in order if p in kept.values()]
