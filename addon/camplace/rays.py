# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray queries against the scene's surfaces, with embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from .embree_mesh import EmbreeMesh
from .mask import Mask

# A ray that starts on a surface starts this many spacings of float32 above it, at the largest
# coordinate in play: a vertex, the ray's origin and embree's plane test are each off by about
# one spacing, so 16 keeps clear of the surface with room to spare.
LIFT_SPACINGS = 16.0
# Cut-away layers that a ray may pass before it counts as stopped.
MAX_LAYERS = 8


@dataclass(frozen=True)
class Hits:
    """First surfaces met.

    Attributes:
        triangle: (R,) int64, index into the geometry's triangles; -1 where nothing is met.
        distance: (R,) float64 along the unit direction; inf where nothing is met.
    """

    triangle: NDArray[np.int64]
    distance: NDArray[np.float64]


class RayCaster:
    """What cameras see of a scene: triangles that are visible to them, cut-outs observed.

    Give it geometry near the origin: embree works in float32.
    """

    def __init__(self, geometry: SceneGeometry) -> None:
        self._mask = Mask(geometry)
        there, away = self._mask.uniform
        mixed = self._mask.masked & ~there & ~away
        self._solid = EmbreeMesh(geometry, geometry.camera_visible & ~mixed & ~away)
        self._masked = EmbreeMesh(geometry, geometry.camera_visible & mixed)
        self._triangles = geometry.triangles
        x, y, z = np.abs(geometry.vertices.T)
        self._reach = np.maximum(np.maximum(x, y), z)

    def lift(self, points: NDArray[np.float64], triangle: NDArray[np.int64]) -> NDArray[np.float64]:
        """(S,) how far above its triangle a ray from each of `points` (S, 3) must start."""
        a, b, c = self._reach[self._triangles[triangle]].T
        x, y, z = np.abs(points).T
        reach = np.maximum(np.maximum(np.maximum(a, b), c), np.maximum(np.maximum(x, y), z))
        return LIFT_SPACINGS * np.finfo(np.float32).eps * reach

    def first_hit(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limit: NDArray[np.float64] | None = None,
    ) -> Hits:
        """The first surface along each ray: (R, 3) origins, (R, 3) unit directions.

        `limit` (R,) ends the rays early; surfaces beyond it do not count.
        """
        triangle, distance, _ = self._solid.closest(origins, directions, limit)
        if not len(self._masked):
            return Hits(triangle, distance)
        mask_triangle, mask_distance = self._first_unmasked(origins, directions, distance)
        nearer = mask_distance < distance
        return Hits(
            np.where(nearer, mask_triangle, triangle), np.where(nearer, mask_distance, distance)
        )

    def first_triangle(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> Hits:
        """As `first_hit`, but a triangle of which some is cut away counts as a whole one."""
        triangle, distance, _ = self._solid.closest(origins, directions, None)
        if len(self._masked):
            other, other_distance, _ = self._masked.closest(origins, directions, distance)
            triangle = np.where(other >= 0, other, triangle)
            distance = np.where(other >= 0, other_distance, distance)
        return Hits(triangle, distance)

    def occluded(
        self, origins: NDArray[np.float64], targets: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(R,) whether a surface lies between (R, 3) origins and (R, 3) or (3,) targets.

        Both ends must be clear of the surfaces (see `lift`).
        """
        way = np.broadcast_to(targets, origins.shape) - origins
        length = np.linalg.norm(way, axis=-1)
        directions = way / np.where(length > 0.0, length, 1.0)[:, None]
        blocked = self._solid.any_hit(origins, directions, length)
        if len(self._masked):
            rest = np.flatnonzero(~blocked)
            _, distance = self._first_unmasked(origins[rest], directions[rest], length[rest])
            blocked[rest] = distance < length[rest]
        return blocked

    def _first_unmasked(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limit: NDArray[np.float64],
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The first hit on a cut-out's opaque part: triangle (R,) and distance (R,)."""
        triangle = np.full(len(origins), -1, dtype=np.int64)
        distance = np.full(len(origins), np.inf)
        travelled = np.zeros(len(origins))
        active = np.arange(len(origins))
        for layer in range(MAX_LAYERS + 1):
            start = origins[active] + travelled[active, None] * directions[active]
            hit, step, barycentric = self._masked.closest(
                start, directions[active], limit[active] - travelled[active]
            )
            met = hit >= 0
            active, hit, step = active[met], hit[met], step[met]
            if not active.size:
                break
            opaque = self._mask.opaque_at(hit, barycentric[met]) | (layer == MAX_LAYERS)
            reached = travelled[active] + step
            triangle[active[opaque]] = hit[opaque]
            distance[active[opaque]] = reached[opaque]
            travelled[active] = reached + self.lift(origins[active], hit)
            active = active[~opaque]
        return triangle, distance
