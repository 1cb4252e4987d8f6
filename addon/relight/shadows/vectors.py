# SPDX-License-Identifier: GPL-3.0-or-later
"""Vectors whose components come first: numpy works on long rows several times faster than on
triples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def dot(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.floating]:
    """(N,) of (3, N) each."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def corner_weights(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """(R,) each: by which the corners make a place from which the first lies `a` (3, R) away, and
    from that the others `b` and `c`."""
    bb, bc, cc, pb, pc = dot(b, b), dot(b, c), dot(c, c), -dot(a, b), -dot(a, c)
    double_area_sq = bb * cc - bc * bc
    over = 1.0 / np.where(double_area_sq > 0.0, double_area_sq, np.inf)
    # Rasterizers see a triangle a little beyond its edges.
    of_b = np.maximum((cc * pb - bc * pc) * over, 0.0)
    of_c = np.maximum((bb * pc - bc * pb) * over, 0.0)
    beyond = np.maximum(of_b + of_c, 1.0)
    of_b, of_c = of_b / beyond, of_c / beyond
    return 1.0 - of_b - of_c, of_b, of_c
