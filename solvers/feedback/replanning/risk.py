"""Compiled: probability that two bodies overlap if they follow given means.

    Pr(a_p D <= b_p) = Phi(-(a_p mean - b_p) / sigma_p)

For a collision set that is a box along the axes the probability is the product over its axes;
otherwise that of the best face, an upper bound.  The probability of a step is that of the face
that is best at both of its ends.
"""

from __future__ import annotations

from ppg_env.support.compilation import njit
from solvers.feedback.replanning.normal_tail import normal_below


@njit(inline="always")
def within_face(tail, clearance, deviation):
    """Return the probability to be on the inner side of a face."""
    if deviation > 0.0:
        return normal_below(tail, -clearance / deviation)
    return 1.0 if clearance < 0.0 else 0.0


@njit(inline="always")
def clearance_of(first_mean, second_mean, normals, offsets, f, d):
    """Return the distance of a displacement beyond the face ``f``."""
    clear = -offsets[f]
    for k in range(d):
        clear += normals[f, k] * (first_mean[k] - second_mean[k])
    return clear


@njit(cache=True)
def overlap_risk(
    first, second, t, swept, d, normals, offsets, start, stop, opposite, box, deviations, tail
):  # fmt: skip
    """Return the probability of an overlap at time t, or during the step that ends then.

    ``first`` and ``second`` (L + 1, n) are means from now on.
    """
    best, product = 1.0, 1.0
    for f in range(start, stop):
        clear = clearance_of(first[t], second[t], normals, offsets, f, d)
        risk = within_face(tail, clear, deviations[t, f])
        if swept:
            clear = clearance_of(first[t - 1], second[t - 1], normals, offsets, f, d)
            risk = max(risk, within_face(tail, clear, deviations[t - 1, f]))
        best = min(best, risk)
        if best <= 0.0:
            return 0.0
        if box and not swept and opposite[f] > f:
            other = clearance_of(first[t], second[t], normals, offsets, opposite[f], d)
            both = risk + within_face(tail, other, deviations[t, opposite[f]]) - 1.0
            product *= max(both, 0.0)
            if product <= 0.0:
                return 0.0
    return min(best, product)


@njit(cache=True)
def meeting_risk(
    first, second, first_alive, second_alive, steps, swept, stay, d, normals, offsets, start, stop,
    opposite, box, deviations, tail,
):  # fmt: skip
    """Return the probability of a crash of two bodies within ``steps``.

    ``*_alive`` (L + 1,) are the probabilities that a body still moves.
    """
    safe = 1.0
    for t in range(1, steps + 1):
        at = t - 1 if swept else t
        one, two = first_alive[at], second_alive[at]
        moving = one + two - one * two if stay else one * two
        if moving <= 1e-4:
            if not stay:
                break
            continue
        risk = overlap_risk(first, second, t, swept, d, normals, offsets, start, stop, opposite,
                            box, deviations, tail)  # fmt: skip
        safe *= 1.0 - moving * risk
    return 1.0 - safe
