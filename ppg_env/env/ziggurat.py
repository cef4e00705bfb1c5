"""Compiled: standard normals from the bits of SFC64, the same ones as NumPy's ``Generator`` draws.

Compiled together, the generator and the method take a third of NumPy's time, which calls the
generator once per number and branches on every sign.

Sources: Marsaglia & Tsang, The ziggurat method for generating random variables (2000), in NumPy's
variant with 256 layers, whose tables Numba holds; Chris Doty-Humphrey, PractRand (2010), for SFC64.
"""

from __future__ import annotations

import math

import numpy as np
from numba.np.random._constants import (
    fi_double,
    ki_double,
    wi_double,
    ziggurat_nor_inv_r,
    ziggurat_nor_r,
)

from ppg_env.support.compilation import njit

SURE = np.asarray(ki_double, dtype=np.uint64)
"""Per layer, the numbers below which a point is inside the density for sure."""
WIDTH = np.asarray(wi_double, dtype=np.float64)
HEIGHT = np.asarray(fi_double, dtype=np.float64)
START, RATE = float(ziggurat_nor_r), float(ziggurat_nor_inv_r)
"""Where the tail starts, and the rate of the exponential density from which it is drawn."""

WORD, UNIT = np.uint64, 1.0 / 2**53


@njit(cache=True)
def fill_normals(words, out):
    """Fill ``out`` with standard normals and advance ``words`` (4,), the state of SFC64."""
    flat, k = out.reshape(-1), 0
    a, b, c, count = words[0], words[1], words[2], words[3]
    while k < flat.size:
        a, b, c, count, bits = _advance(a, b, c, count)
        layer = np.int64(bits & WORD(0xFF))
        sign = 1 - 2 * np.int64((bits >> WORD(8)) & WORD(1))
        size = (bits >> WORD(9)) & WORD(0xFFFFFFFFFFFFF)
        flat[k] = np.float64(np.int64(size)) * (WIDTH[layer] * np.float64(sign))
        k += 1
        if size >= SURE[layer]:  # one in a hundred
            words[0], words[1], words[2], words[3] = a, b, c, count
            accepted, flat[k - 1] = _decide(words, layer, size, flat[k - 1])
            k -= not accepted
            a, b, c, count = words[0], words[1], words[2], words[3]
    words[0], words[1], words[2], words[3] = a, b, c, count


@njit(cache=True)
def _decide(words, layer, size, value):
    """Return whether a point near the edge of its layer counts, and its value."""
    if layer > 0:
        share = HEIGHT[layer] + (HEIGHT[layer - 1] - HEIGHT[layer]) * _uniform(words)
        return share < math.exp(-0.5 * value * value), value
    while True:
        beyond = -RATE * math.log1p(-_uniform(words))
        height = -math.log1p(-_uniform(words))
        if height + height > beyond * beyond:
            negative = (size >> WORD(8)) & WORD(1)
            return True, -(START + beyond) if negative else START + beyond


@njit(inline="always")
def _advance(a, b, c, count):
    """Return the next state of SFC64, and its output."""
    bits = a + b + count
    rotated = (c << WORD(24)) | (c >> WORD(40))
    return b ^ (b >> WORD(11)), c + (c << WORD(3)), rotated + bits, count + WORD(1), bits


@njit(inline="always")
def _uniform(words):
    words[0], words[1], words[2], words[3], bits = _advance(words[0], words[1], words[2], words[3])
    return (bits >> WORD(11)) * UNIT
