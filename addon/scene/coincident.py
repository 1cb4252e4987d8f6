# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that overlap in one plane: Cycles casts no light from what they have in common.

A shadow ray of Cycles starts on its triangle without any offset, and leaves only that triangle
itself out. Another one in the very same plane it meets at distance 0. Where that plane is at right
angles to an axis of the world, and x, y or z the same float32 for all corners, roundings cannot
part the two, and what lies in both is black on either side. In slanted planes roundings decide for
each ray, and so they do where several objects show one mesh, which Cycles leaves in its own space:
there it is dark in stripes and spots, by chance, and nothing here says anything of that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .plane_cells import PlaneCells

if TYPE_CHECKING:
    from .geometry import SceneGeometry

# Planes that only the rounding of places far from the world's origin makes one, differ by more than
# this share of the larger triangle's size: surfaces do not go dark there for being near each other.
_SAME_PLANE = 1e-6

# Triangles overlap if by more than this share of the larger one's size: less is what neighbours do
# by roundings.
LEAST_OVERLAP = 1e-6


@dataclass(frozen=True)
class Coincident:
    """Triangles that overlap another one in their plane.

    Attributes:
        triangles: (N,) int64, ascending: which.
        plane: (N,) int64: a number for the plane of each.
        axis: (N,) int64: the coordinate that is the same all over it.
    """

    triangles: NDArray[np.int64]
    plane: NDArray[np.int64]
    axis: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.triangles)


def in_plane(corners: NDArray[np.float64], axis: NDArray[np.int64] | int) -> NDArray[np.float64]:
    """(N, ..., 2) the other two coordinates of points (N, ..., 3), for an axis or one (N,) each."""
    axes = np.broadcast_to(axis, len(corners)).reshape(-1, *[1] * (corners.ndim - 1))
    return np.take_along_axis(corners, (axes + np.array([1, 2])) % 3, axis=-1)


def coincident_triangles(geometry: SceneGeometry) -> Coincident:
    """All of a scene's, from its places in the world."""
    vertices, triangles = geometry.vertices, geometry.triangles
    rounded = vertices.astype(np.float32)
    shared = geometry.shares_mesh
    alone = np.True_ if shared is None else ~shared[geometry.object_id]
    found: list[NDArray[np.int64]] = []
    planes = 0
    for axis in range(3):
        levels = rounded[:, axis].take(triangles)
        is_flat = (levels[:, 0] == levels[:, 1]) & (levels[:, 0] == levels[:, 2])
        flat = np.flatnonzero(is_flat & alone)
        different, plane = np.unique(levels[flat, 0], return_inverse=True)
        corners = vertices[triangles[flat]]
        some = _overlapping(plane, in_plane(corners, axis), corners[..., axis])
        found.append(np.stack([flat[some], planes + plane[some], np.full(some.sum(), axis)]))
        planes += len(different)
    every = np.concatenate(found, axis=1)
    return Coincident(*every[:, np.argsort(every[0])])


def _overlapping(
    plane: NDArray[np.int64], corners: NDArray[np.float64], level: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(N,) which triangles overlap another one.

    Args:
        plane: (N,) the number of the plane of each.
        corners: (N, 3, 2) where they are in it.
        level: (N, 3) the coordinate that tells it, before it was rounded.
    """
    overlaps = np.zeros(len(plane), dtype=np.bool_)
    cells = PlaneCells(plane, corners)
    size = np.maximum(*(cells.high - cells.low))
    for a, b in cells.near(plane, cells.low, cells.high):
        # Of two of about a size each finds the other.
        wanted = (size.take(a) < size.take(b)) | ((size.take(a) == size.take(b)) & (a < b))
        wanted &= ~(overlaps.take(a) & overlaps.take(b))
        one, other = a[wanted], b[wanted]
        off = np.abs(level[one, :, None] - level[other, None]).max(axis=(1, 2))
        same = off <= _SAME_PLANE * size[other]
        one, other = one[same], other[same]
        some = _overlap(corners[one], corners[other], LEAST_OVERLAP * size[other])
        overlaps[one[some]] = overlaps[other[some]] = True
    return overlaps


def _overlap(
    a: NDArray[np.float64], b: NDArray[np.float64], least: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(P,) whether triangles (P, 3, 2) overlap by more than `least` (P,): no line along a side of
    either parts them."""
    overlap = np.ones(len(a), dtype=np.bool_)
    corners = [[np.ascontiguousarray(x[:, k].T) for k in range(3)] for x in (a, b)]
    for one, other in (corners, corners[::-1]):
        for k in range(3):
            corner, side = one[k], one[(k + 1) % 3] - one[k]
            inward = np.where(_cross(side, one[(k + 2) % 3] - corner) < 0.0, -1.0, 1.0)
            theirs = [inward * _cross(side, point - corner) for point in other]
            within = np.maximum(np.maximum(theirs[0], theirs[1]), theirs[2])
            overlap &= within > least * np.hypot(*side)
    return overlap


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P,) of (2, P) vectors: positive where the second is to the left of the first."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])
