# SPDX-License-Identifier: GPL-3.0-or-later
"""Which receivers lie in another triangle too, and so get no light, see `coincident`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ...corrmap.local_scene import LocalScene
    from .receivers import Receivers

# Receivers at once: some lie in the planes of a hundred triangles.
_PART = 1 << 12


def buried(
    scene: LocalScene, casters: NDArray[np.bool_], receivers: Receivers
) -> NDArray[np.bool_] | None:
    """(N,) which receivers lie in another of the triangles that cast shadows; None for none.

    Args:
        scene: the triangles.
        casters: (T,) which of them stop light.
        receivers: N of them.
    """
    pairs = scene.coincident
    # Of most scenes that is all.
    if not len(pairs) or not casters[pairs.second].any():
        return None
    in_pair = np.zeros(len(scene.geometry) + 1, dtype=np.bool_)
    # The last is of triangles that are not known.
    in_pair[pairs.triangles] = True
    rows = np.flatnonzero(in_pair.take(receivers.triangle, mode="wrap"))
    found = np.zeros(len(receivers.triangle), dtype=np.bool_)
    for start in range(0, len(rows), _PART):
        some = rows[start : start + _PART]
        first = np.searchsorted(pairs.first, receivers.triangle[some], "left")
        count = np.searchsorted(pairs.first, receivers.triangle[some], "right") - first
        each = np.repeat(np.arange(len(some)), count)
        pair = np.arange(len(each)) + np.repeat(first - (np.cumsum(count) - count), count)
        stops = casters[pairs.second[pair]]
        each, pair = each[stops], pair[stops]
        corners = scene.geometry.vertices[scene.geometry.triangles[pairs.second[pair]]]
        inside = _holds(corners, receivers.place[:, some[each]], pairs.axis[pair])
        found[some[each[inside]]] = True
    return found if found.any() else None


def _holds(
    corners: NDArray[np.float64], place: NDArray[np.float64], axis: NDArray[np.int8]
) -> NDArray[np.bool_]:
    """(P,) whether triangles (P, 3, 3) hold places (3, P) of their planes, all of one coordinate
    along an axis (P,)."""
    row = np.arange(len(axis))
    across = [(axis + step) % 3 for step in (1, 2)]
    x, y = (corners[row, :, a].T - place[a, row] for a in across)
    turns = [x[k - 1] * y[k] - x[k] * y[k - 1] for k in range(3)]
    left = (turns[0] >= 0.0) & (turns[1] >= 0.0) & (turns[2] >= 0.0)
    right = (turns[0] <= 0.0) & (turns[1] <= 0.0) & (turns[2] <= 0.0)
    return np.asarray(left | right)
