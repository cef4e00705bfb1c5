r"""Half-spaces that contain a collision set K and are unlikely to be entered.

K lies in every half-space made of its faces with weights u >= 0:

    delta in K  implies  a . delta <= b,   a = sum_f u_f normal_f,  b = sum_f u_f offset_f.

The least likely of them under delta ~ N(mean, Sigma) touches K where an overlap is most likely:
at the point nearest to the mean in the metric of Sigma.  It is a face, or lies between faces at a
corner.  Least-distance programming finds u (Lawson & Hanson, Solving Least Squares Problems,
ch. 23).
"""

from __future__ import annotations

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.game.dynamics import square_root

PROBES = np.linspace(0.0, 1.0, 17)
"""Shares of a step at which half-spaces are computed as candidates for the whole step."""


def nearest_weights(normals: np.ndarray, room: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return (F,) weights u of the least likely half-space; zero if the mean is in K.

    ``room`` (F,) are the offsets less the faces' values at the mean.
    """
    from scipy.optimize import nnls

    program = np.vstack([-(normals @ square_root(covariance)).T, -room])
    weights, _ = nnls(program, np.append(np.zeros(len(covariance)), 1.0))
    return weights


def supporting_halfspaces(
    normals: np.ndarray,
    offsets: np.ndarray,
    means: np.ndarray,
    covariances: np.ndarray,
    steps: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return (C, d) unit normals and (C,) offsets of half-spaces that might cover ``steps``.

    These are all faces of K, and the least likely half-spaces at ``PROBES`` of each step t -> t + 1
    between the displacements ``means`` (K, d), with ``covariances`` (K, d, d).
    """
    weights, rooms = [*np.eye(len(normals))], offsets - means @ normals.T
    for t in steps:
        for s in PROBES:
            between = ((1 - s) * x[t] + s * x[t + 1] for x in (rooms, covariances))
            weights.append(nearest_weights(normals, *between))
    shares = np.array(weights)
    directions = shares @ normals
    lengths = np.linalg.norm(directions, axis=1)
    proper = lengths > tol.FLAT * shares.sum(axis=1)
    scale = lengths[proper, None]
    return directions[proper] / scale, (shares[proper] / scale) @ offsets
