# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of triangles that lie together, to leave out those that a view cannot see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Triangles in a cluster: a draw call costs about what so many cost to transform.
CLUSTER = 1024

# Bits of each coordinate in the order of objects.
_BITS = 10

# Box sides grow by this share of their distance from the local origin: above float32's rounding
# of what is drawn, and of the matrix that it is drawn with.
BOX_MARGIN = 1e-5


@dataclass(frozen=True)
class Clusters:
    """Consecutive triangles, `CLUSTER` at a time.

    Attributes:
        count: triangles in all.
        low, high: (C, 3) float64, corners of their bounding boxes, local space, metres.
    """

    count: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def of(cls, corners: NDArray[np.float32]) -> Clusters:
        """From (T, 3, 3) in the order in which they are drawn."""
        starts, points = np.arange(0, 3 * len(corners), 3 * CLUSTER), corners.reshape(-1, 3)
        low = np.minimum.reduceat(points, starts).astype(np.float64)
        high = np.maximum.reduceat(points, starts).astype(np.float64)
        margin = BOX_MARGIN * np.maximum(np.abs(low), np.abs(high))
        return cls(len(corners), low - margin, high + margin)

    def seen(self, clip_from_local: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(C,) whether something of each may lie before the sides of a picture.

        Near and far are not looked at: passes clip there by rules of their own.
        """
        x, y, _, w = clip_from_local
        planes = np.stack([w + x, w - x, w + y, w - y])
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        reach = middle @ planes[:, :3].T + half @ np.abs(planes[:, :3]).T + planes[:, 3]
        return np.asarray((reach >= 0.0).all(axis=1))

    def ranges(self, seen: NDArray[np.bool_]) -> list[tuple[int, int]]:
        """(first, end) triangle of each stretch of clusters that are seen."""
        padded = np.concatenate([[False], seen, [False]])
        changes = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2) * CLUSTER
        return [(int(first), min(int(end), self.count)) for first, end in changes]


def overlaps(some: list[tuple[int, int]], others: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """What two ascending lists of (first, end) share."""
    result = []
    i = j = 0
    while i < len(some) and j < len(others):
        first, end = max(some[i][0], others[j][0]), min(some[i][1], others[j][1])
        if first < end:
            result.append((first, end))
        if some[i][1] < others[j][1]:
            i += 1
        else:
            j += 1
    return result


def order_of_objects(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], object_id: NDArray[np.int32]
) -> NDArray[np.int64]:
    """(O,) a rank for each object: those that lie together come after one another (G. M. Morton's
    order of their places, 1966)."""
    count = int(object_id.max(initial=-1)) + 1
    if not count:
        return np.zeros(0, dtype=np.int64)
    # A corner stands for an object: of small ones it is near the middle, and large ones fill
    # clusters of their own.
    first = np.zeros(count, dtype=np.int64)
    first[object_id[::-1]] = np.arange(len(object_id))[::-1]
    place = vertices[triangles[first, 0]]
    low, high = place.min(axis=0), place.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    cell = ((place - low) / span * (2**_BITS - 1)).astype(np.int64)
    code = np.zeros(count, dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    rank = np.empty(count, dtype=np.int64)
    rank[np.argsort(code, kind="stable")] = np.arange(count)
    return rank
