# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether rays of pixels reach the world, with embree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...corrmap.local_scene import LocalScene
from ...corrmap.surface_buffer import SurfaceBuffer
from ..shadows.receivers import SeenReceivers
from ..shadows.shadow_rays import shadow_rays


class EnvironmentRays:
    """Rays against the triangles that cast shadows.

    Attributes:
        scene: the triangles.
    """

    def __init__(self, scene: LocalScene) -> None:
        self.scene = scene
        self._rays = shadow_rays(scene)
        # What the last sample sees.
        self._seen: SeenReceivers | None = None

    def open_share(self, surface: SurfaceBuffer, rays: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W), or (H, W, 3) where sheer surfaces cast shadows: 1 where a ray meets nothing, what
        they let through where it meets such alone, else 0.

        Args:
            surface: where rays start.
            rays: (H, W, 4): unit directions above the surface, local space, and 1 where there is
                one.
        """
        if self._seen is None or self._seen.surface is not surface:
            self._seen = SeenReceivers.of(surface, self.scene)
        seen = self._seen
        sent = (rays[..., 3] > 0.0) & seen.hit
        some, receivers = seen.number[sent], seen.receivers
        start = receivers.starts(some)
        toward = rays[sent][:, :3].astype(np.float64)
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        endless = np.full(len(toward), np.inf)
        is_open = ~self._rays.blocked(start.T, toward, endless)
        seen.close_buried(self._rays, some, is_open)
        if not self._rays.dims:
            result = np.zeros(sent.shape, dtype=np.float32)
            result[sent] = is_open
            return result
        through = np.zeros((len(toward), 3), dtype=np.float32)
        through[is_open] = self._rays.through(start.T[is_open], toward[is_open], endless[is_open])
        result = np.zeros((*sent.shape, 3), dtype=np.float32)
        result[sent] = through
        return result
