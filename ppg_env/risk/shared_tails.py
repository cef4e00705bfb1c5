r"""What successive half-spaces of a cover share, by which its union bound is too large.

A cover (:mod:`ppg_env.game.swept_bound`) is a sequence of events H_1, H_2, ... in order of time,
each a half-space for the displacement at one instant.  By Hunter and Worsley

    Pr(union of H_k)  <=  sum_k Pr(H_k) - sum_k Pr(H_k and H_(k+1)),

because successive events are the edges of a tree.  Both displacements are Gaussian, so each joint
probability is that of a bivariate normal; it is bounded from below, so that the bound holds.
"""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from ppg_env import tolerances as tol
from ppg_env.game.swept_bound import Cover
from ppg_env.risk.joint_bounds import log_joint_tails


def log_tree_bound(cover: Cover, spreads: np.ndarray, crosses: np.ndarray) -> float:
    """Return the log of the bound above; minus infinity if no noise leads to an overlap.

    ``spreads`` (H+1, d, d) are the covariances of the displacement at each time, ``crosses`` those
    with the displacement one step later.
    """
    logs = cover.log_tails
    if not logs.size or np.isneginf(logs).all():
        return -np.inf
    total = float(logsumexp(logs))
    noisy = cover.deviations > tol.DEVIATION
    at = np.flatnonzero(noisy[:-1] & noisy[1:])
    first, second = cover.times[at], cover.times[at + 1]
    between = np.where((first == second)[:, None, None], spreads[first], crosses[first])
    joint = np.einsum("ki,kij,kj->k", cover.normals[at], between, cover.normals[at + 1])
    rho = np.clip(joint / (cover.deviations[at] * cover.deviations[at + 1]), -1.0, 1.0)
    shared = log_joint_tails(rho, cover.levels[at], cover.levels[at + 1])
    share = min(float(np.exp(shared - total).sum()), 1.0 - np.exp(float(logs.max()) - total))
    return total + float(np.log1p(-max(share, 0.0)))
