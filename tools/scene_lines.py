# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that show at a glance what a scene is: sharp edges, and sections by a plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry

# Faces that meet at more than this angle make an edge that is drawn, in radians.
SHARP = np.radians(30.0)
# Of more triangles than these the sharp edges are not searched: the section must do.
MAX_TRIANGLES = 3_000_000


def section(geometry: SceneGeometry, axis: int, height: float) -> NDArray[np.float64]:
    """(L, 2, 3) where the plane on which coordinate `axis` is `height` cuts the triangles."""
    above = geometry.vertices[:, axis] > height
    corner_above = above[geometry.triangles]
    cut = corner_above.any(axis=1) & ~corner_above.all(axis=1)
    triangles, corner_above = geometry.triangles[cut], corner_above[cut]
    # The corner that is alone on its side: both edges that leave it are cut.
    lone = np.where(
        corner_above.sum(axis=1) == 1, corner_above.argmax(axis=1), corner_above.argmin(axis=1)
    )
    rows = np.arange(len(triangles))
    start = geometry.vertices[triangles[rows, lone]]
    ends = [geometry.vertices[triangles[rows, (lone + step) % 3]] for step in (1, 2)]
    lines = []
    for end in ends:
        share = (height - start[:, axis]) / (end[:, axis] - start[:, axis])
        lines.append(start + share[:, None] * (end - start))
    return np.stack(lines, axis=1)


def creases(geometry: SceneGeometry, box: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L, 2, 3) edges of one triangle alone, or between two that meet sharply.

    Only of triangles that reach into the box (2, 3); none where there are too many of them.
    """
    low = np.full((len(geometry), 3), np.inf)
    high = np.full((len(geometry), 3), -np.inf)
    for corner in geometry.triangles.T:
        low = np.minimum(low, geometry.vertices[corner])
        high = np.maximum(high, geometry.vertices[corner])
    inside = np.flatnonzero(((high >= box[0]) & (low <= box[1])).all(axis=1))
    if not 0 < len(inside) <= MAX_TRIANGLES:
        return np.empty((0, 2, 3))
    triangles, normal = geometry.triangles[inside], geometry.normal[inside]
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    ends = np.sort(ends.astype(np.int64), axis=1)
    key = ends[:, 0] * len(geometry.vertices) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    key, face = key[order], order // 3
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    count = np.diff(np.r_[first, len(key)])
    second = np.minimum(first + 1, len(key) - 1)
    cosine = np.einsum("ex,ex->e", normal[face[first]], normal[face[second]])
    drawn = (count != 2) | (np.abs(cosine) < np.cos(SHARP))
    return np.asarray(geometry.vertices[ends[order[first[drawn]]]])
