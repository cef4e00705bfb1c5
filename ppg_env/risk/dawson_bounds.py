r"""Lower bounds on the probability of a union from single and joint probabilities.

Let N be the number of the events A_1, ..., A_K that happen.  Then

    Pr(union) = sum_k E[1(A_k) / N]  >=  sum_k Pr(A_k) phi(m_k),    m_k = E[N | A_k]
    m_k = sum_l Pr(A_k, A_l) / Pr(A_k),    phi(m) = 1/j - (m - j) / (j (j + 1)),   j = floor(m),

because phi, the line between the values of 1/x at whole numbers, is convex (Jensen).  phi
decreases: joint probabilities may be replaced by larger numbers.  Averaging the m_k first gives the
bound of Dawson & Sankoff from the sums of single and joint probabilities, which is at most that.

Any of the events may be left out.  The likeliest one is taken first, which alone gives its own
probability; then always the one that raises the bound most, until none does.

Source: Dawson & Sankoff, Proceedings of the American Mathematical Society 18 (1967); Kuai, Alajaji
& Takahara, Discrete Mathematics 215 (2000).
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

from ppg_env.risk.joint_bounds import SAME, SHY, WIDE, log_joint_tails


def log_union_bound(logs: np.ndarray, joint: np.ndarray) -> float:
    """Return a lower bound on the log of the probability of a union.

    Parameters
    ----------
    logs
        (K,) logs of the probabilities, in descending order, the first one finite.
    joint
        (K, K) upper bounds on the logs of the joint probabilities; the diagonal is not read.
    """
    shares, weights = np.exp(joint - logs[:, None]), np.exp(logs - logs[0])
    chosen, left, numbers, best = [0], list(range(1, len(logs))), np.ones(1), 1.0
    while left:
        with_each = numbers[:, None] + shares[np.ix_(chosen, left)]
        own = 1.0 + shares[np.ix_(left, chosen)].sum(axis=1)
        values = weights[chosen] @ _least_share(with_each) + weights[left] * _least_share(own)
        k = int(values.argmax())
        if values[k] <= best:
            break
        best, numbers = float(values[k]), np.append(with_each[:, k], own[k])
        chosen.append(left.pop(k))
    return float(logs[0] + max(np.log(best) + np.log1p(-SHY), 0.0))


def _least_share(numbers: np.ndarray) -> np.ndarray:
    """Return phi, the least mean of 1/N for a whole number N >= 1 with the given mean."""
    whole = np.floor(numbers)
    share: np.ndarray = 1.0 / whole - (numbers - whole) / (whole * (whole + 1.0))
    return share


def log_joint_tails_above(rho: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return (...,) upper bounds on log Pr(x <= -first, y <= -second).

    x and y are standard normals with correlation ``rho``.
    """
    most = np.minimum(log_ndtr(-first), log_ndtr(-second))
    use = np.isfinite(first) & np.isfinite(second) & (rho <= SAME)
    a, b = first[use], second[use]
    inner = log_joint_tails(np.maximum(rho[use], -SAME), a, b) + 3.0 * SHY
    outer = np.logaddexp(*(log_ndtr(-np.maximum(end, 0.0) - WIDE) for end in (a, b)))
    most[use] = np.minimum(most[use], np.logaddexp(inner, outer))
    return most
