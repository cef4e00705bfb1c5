"""Compiled projections of inputs on control sets, each in place."""

from __future__ import annotations

import numpy as np

from ppg_env.support.compilation import njit

SWEEPS = 200
"""Largest number of sweeps of Hildreth's method."""

SETTLED = 1e-12
"""Hildreth's method stops after a sweep that changes no multiplier by more than this."""


@njit(cache=True)
def project_on_polygon(edges: np.ndarray, first: int, last: int, u: np.ndarray) -> None:
    """Replace ``u`` (2,) by the nearest point of a polygon: the best of the edges it is beyond.

    Rows ``first`` up to ``last`` of ``edges``: corner (2), unit tangent (2) counter-clockwise,
    length.
    """
    x, y, best, bx, by = u[0], u[1], np.inf, u[0], u[1]
    for v in range(first, last):
        cx, cy, tx, ty = edges[v, 0], edges[v, 1], edges[v, 2], edges[v, 3]
        if (x - cx) * ty - (y - cy) * tx <= 0.0:
            continue  # on the inner side of this edge
        along = min(max((x - cx) * tx + (y - cy) * ty, 0.0), edges[v, 4])
        px, py = cx + along * tx, cy + along * ty
        far = (x - px) ** 2 + (y - py) ** 2
        if far < best:
            best, bx, by = far, px, py
    u[0], u[1] = bx, by


@njit(cache=True)
def project_on_faces(
    normals: np.ndarray, offsets: np.ndarray, first: int, last: int, u: np.ndarray
) -> None:
    """Replace ``u`` (m,) by the nearest point of a polytope, given by its half-spaces.

    Hildreth's method: coordinate ascent on the dual of min |v - u|^2.
    """
    price = np.zeros(last - first)
    for _ in range(SWEEPS):
        change = 0.0
        for f in range(first, last):
            reach = -offsets[f]
            for k in range(u.size):
                reach += normals[f, k] * u[k]
            amount = max(reach, -price[f - first])
            price[f - first] += amount
            for k in range(u.size):
                u[k] -= amount * normals[f, k]
            change = max(change, abs(amount))
        if change < SETTLED:
            return
