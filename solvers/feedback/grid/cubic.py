r"""Cubic convolution (Keys, 1981) on a uniform axis, and its exact integral against a normal.

The interpolant of values f_k at points p_k = p_0 + k h is sum_k f_k phi((x - p_k) / h) with the
piecewise cubic phi of Keys, which reproduces quadratics.  Outside the axis the first and the last
value continue.  The expectation of the interpolant at y + w, w ~ N(0, sigma^2), over an interval of
y + w is linear in f; its weights are sums of truncated normal moments, without quadrature.
"""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit

TAPS = np.array(
    [[0.0, -0.5, 1.0, -0.5], [1.0, 0.0, -2.5, 1.5], [0.0, 0.5, 2.0, -1.5], [0.0, 0.0, -0.5, 0.5]]
)
"""Row q: the polynomial in the fraction s that weighs the point q - 1 cells from the left end."""

WIDEST = 8.5
"""Standard deviations beyond which a normal is zero."""


@njit(cache=True)
def keys_weights(fraction, out):
    """Write the weights (4,) of the points -1, 0, 1, 2 cells from the left end of a cell."""
    s = fraction
    out[0] = ((-0.5 * s + 1.0) * s - 0.5) * s
    out[1] = (1.5 * s - 2.5) * s * s + 1.0
    out[2] = ((-1.5 * s + 2.0) * s + 0.5) * s
    out[3] = (0.5 * s - 0.5) * s * s


def point_weights(first: float, step: float, size: int, at: np.ndarray) -> np.ndarray:
    """Return the weights (M, size) of the interpolant at the points ``at`` (M,)."""
    place = np.clip((at - first) / step, 0, size - 1) if size > 1 else np.zeros(len(at))
    cell = np.clip(np.floor(place).astype(int), 0, max(size - 2, 0))
    powers = (place - cell)[:, None] ** np.arange(4)
    weights = np.zeros((len(at), size))
    for q in range(4):
        index = np.clip(cell + q - 1, 0, size - 1)
        np.add.at(weights, (np.arange(len(at)), index), powers @ TAPS[q])
    return weights


def gaussian_weights(
    first: float,
    step: float,
    size: int,
    at: np.ndarray,
    deviation: float,
    within: tuple[float, float] = (-np.inf, np.inf),
) -> np.ndarray:
    """Return the weights (M, size) of E[1{low <= x <= high} f(x)], x ~ N(at, deviation^2).

    Parameters
    ----------
    first, step, size
        The points of the axis.
    at
        (M,) means.
    deviation
        Standard deviation; with 0 the interpolant at the means.
    within
        The interval (low, high) over which to integrate.
    """
    low, high = within
    if deviation <= 0:
        inside = (at >= low - 1e-9) & (at <= high + 1e-9)
        return point_weights(first, step, size, at) * inside[:, None]
    pad = int(np.ceil(WIDEST * deviation / step)) + 2
    cells = np.arange(-pad, size - 1 + pad)
    left = first + step * cells
    a = (np.maximum(left, low)[None] - at[:, None]) / deviation
    b = (np.minimum(left + step, high)[None] - at[:, None]) / deviation
    a, b = np.clip(a, -40.0, 40.0), np.clip(b, -40.0, 40.0)
    moments = _moments(a, np.maximum(a, b))
    shift, slope = (at[:, None] - left[None]) / step, deviation / step
    powers = [moments[0], shift * moments[0] + slope * moments[1]]
    powers.append(shift**2 * moments[0] + 2 * shift * slope * moments[1] + slope**2 * moments[2])
    powers.append(
        shift**3 * moments[0]
        + 3 * shift**2 * slope * moments[1]
        + 3 * shift * slope**2 * moments[2]
        + slope**3 * moments[3]
    )
    weights = np.zeros((len(at), size))
    for q in range(4):
        part = sum(coefficient * power for coefficient, power in zip(TAPS[q], powers, strict=True))
        np.add.at(weights.T, np.clip(cells + q - 1, 0, size - 1), part.T)
    return weights


def _moments(a: np.ndarray, b: np.ndarray) -> list[np.ndarray]:
    """Return the integrals of z^k, k = 0..3, against the standard normal from ``a`` to ``b``."""
    from scipy.special import ndtr

    density = [np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi) for z in (a, b)]
    mass = np.where(a > 0, ndtr(-a) - ndtr(-b), ndtr(b) - ndtr(a))
    first = density[0] - density[1]
    second = mass + a * density[0] - b * density[1]
    return [mass, first, second, 2 * first + a**2 * density[0] - b**2 * density[1]]
