# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest points of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def closest_on_triangle(
    place: NDArray[np.float64], corners: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Nearest points (..., 3) to (..., 3) places on triangles (..., 3, 3).

    The foot of the perpendicular where it falls inside, else the nearest of the three edges'
    nearest points.
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    place = np.broadcast_to(place, a.shape)
    normal = np.cross(b - a, c - a)
    squared = np.maximum(_dot(normal, normal), np.finfo(np.float64).tiny)
    foot = place - (_dot(place - a, normal) / squared)[..., None] * normal
    inside = np.ones(foot.shape[:-1], dtype=np.bool_)
    best = foot
    least = np.full(foot.shape[:-1], np.inf)
    for start, stop in ((a, b), (b, c), (c, a)):
        edge = stop - start
        inside &= _dot(np.cross(edge, foot - start), normal) >= 0.0
        length = np.maximum(_dot(edge, edge), np.finfo(np.float64).tiny)
        along = np.clip(_dot(place - start, edge) / length, 0.0, 1.0)
        point = start + along[..., None] * edge
        gap = _dot(place - point, place - point)
        best = np.where((gap < least)[..., None], point, best)
        least = np.minimum(least, gap)
    return np.where(inside[..., None], foot, best)


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("...x,...x->...", a, b))
