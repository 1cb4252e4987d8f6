# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that rays are traced against, with embree."""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from .parallel import in_parts

# Rays given to one thread at a time: a millisecond's work, beside which handing them over is
# nothing.
CHUNK = 4096


class EmbreeMesh:
    """Some of a geometry's triangles in an embree scene.

    Embree works in float32: give it geometry near the origin, and rays that are made so too.
    """

    def __init__(self, geometry: SceneGeometry, chosen: NDArray[np.bool_]) -> None:
        self._index = np.flatnonzero(chosen).astype(np.int32)
        self._met = np.append(self._index, np.int32(-1))
        self._scene: EmbreeScene | None = None
        if not self._index.size:
            return
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, *_in_use(geometry, self._index))
        # The first query builds the tree, which must not happen in two threads at once.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def __len__(self) -> int:
        return len(self._index)

    def any_hit(
        self,
        origins: NDArray[np.floating],
        directions: NDArray[np.floating],
        limit: NDArray[np.floating],
    ) -> NDArray[np.bool_]:
        """(R,) whether anything is met before `limit` (R,) along (R, 3) unit directions."""
        blocked = np.zeros(len(origins), dtype=np.bool_)
        scene = self._scene
        if scene is None:
            return blocked

        def ask(chunk: slice) -> None:
            answer = scene.run(
                origins[chunk].astype(np.float32, order="C"),
                directions[chunk].astype(np.float32, order="C"),
                dists=limit[chunk].astype(np.float32),
                query="OCCLUDED",
            )
            blocked[chunk] = answer >= 0

        in_parts(ask, len(origins), CHUNK)
        return blocked

    def first(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], limit: float
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Triangle (R,), -1 for none, and distance (R,) in lengths of (R, 3) directions; on the
        caller's thread."""
        if self._scene is None:
            return np.full(len(origins), -1, np.int32), np.zeros(len(origins), np.float32)
        answer = self._scene.run(
            origins.astype(np.float32, order="C"),
            directions.astype(np.float32, order="C"),
            dists=np.full(len(origins), min(limit, np.finfo(np.float32).max), np.float32),
            query="INTERSECT",
            output=1,
        )
        # The last number stands for nothing.
        return self._met.take(answer["primID"], mode="wrap"), answer["tfar"]

    def closest(
        self,
        origins: NDArray[np.floating],
        directions: NDArray[np.floating],
        limit: NDArray[np.floating] | None,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Triangle (R,), distance (R,), and the hit's weights of corners 1 and 2 (R, 2)."""
        count = len(origins)
        triangle = np.full(count, -1, dtype=np.int64)
        distance = np.full(count, np.inf)
        barycentric = np.zeros((count, 2))
        far = np.finfo(np.float32).max
        scene = self._scene
        if scene is None:
            return triangle, distance, barycentric

        def ask(chunk: slice) -> None:
            end = np.full(chunk.stop - chunk.start, far, dtype=np.float32)
            if limit is not None:
                end = np.minimum(limit[chunk], far).astype(np.float32)
            answer = scene.run(
                origins[chunk].astype(np.float32, order="C"),
                directions[chunk].astype(np.float32, order="C"),
                dists=end,
                query="INTERSECT",
                output=1,
            )
            met = answer["primID"] >= 0
            triangle[chunk] = np.where(met, self._index[answer["primID"]], -1)
            distance[chunk] = np.where(met, answer["tfar"], np.inf)
            barycentric[chunk, 0] = answer["u"]
            barycentric[chunk, 1] = answer["v"]

        in_parts(ask, count, CHUNK)
        return triangle, distance, barycentric


def _in_use(
    geometry: SceneGeometry, chosen: NDArray[np.int32]
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The vertices of some triangles, and these triangles as (N, 3) numbers of those."""
    triangles = geometry.triangles
    if len(chosen) < len(triangles):
        triangles = triangles[chosen]
    used = np.zeros(len(geometry.vertices), dtype=np.bool_)
    used[triangles.ravel()] = True
    if used.all():
        return geometry.vertices.astype(np.float32), triangles
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return geometry.vertices[used].astype(np.float32), number[triangles]
