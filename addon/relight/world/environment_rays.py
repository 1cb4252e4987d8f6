# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether rays of pixels reach the world, with embree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import read_texture
from ...scene.geometry import SceneGeometry
from ..shadows.shadow_rays import LocalScene, ReceiverFinder, Receivers, ShadowRays


class EnvironmentRays:
    """Rays against the triangles that cast shadows.

    Args:
        geometry: the triangles.
        origin: (3,) float64, world space: local space's origin.
    """

    def __init__(self, geometry: SceneGeometry, origin: NDArray[np.float64]) -> None:
        scene = LocalScene(geometry, origin)
        self._finder = ReceiverFinder(scene)
        self._rays = ShadowRays(scene)
        # Of the last sample: (H, W) which of the receivers a pixel is, or -1.
        self._seen: tuple[SurfaceBuffer, NDArray[np.int64], Receivers] | None = None

    def open_share(self, surface: SurfaceBuffer, rays: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W): 1 where a ray meets nothing, else 0.

        Args:
            surface: where rays start.
            rays: (H, W, 4): unit directions above the surface, local space, and 1 where there is
                one.
        """
        number, receivers = self._receivers(surface)
        sent = (rays[..., 3] > 0.0) & (number >= 0)
        some = number[sent]
        start = receivers.place[some] + receivers.lift[some, None] * receivers.normal[some]
        toward = rays[sent][:, :3].astype(np.float64)
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        result = np.zeros(sent.shape, dtype=np.float32)
        result[sent] = ~self._rays.blocked(start, toward, np.full(len(start), np.inf))
        return result

    def _receivers(self, surface: SurfaceBuffer) -> tuple[NDArray[np.int64], Receivers]:
        if self._seen is None or self._seen[0] is not surface:
            position = read_texture(surface.position)
            normal = read_texture(surface.geometric_normal)[..., :3].astype(np.float64)
            hit = position[..., 3] > 0.0
            number = np.full(hit.shape, -1, dtype=np.int64)
            number[hit] = np.arange(np.count_nonzero(hit))
            receivers = self._finder.receivers(
                surface.eye,
                surface.perspective,
                position[hit][:, :3].astype(np.float64),
                normal[hit],
            )
            self._seen = surface, number, receivers
        return self._seen[1], self._seen[2]
