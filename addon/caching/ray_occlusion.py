# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion of surfaces without a material, which have no nodes that Cycles could ask.

The same quantity as Cycles' Ambient Occlusion node gives: the share of cosine-weighted rays
about the shading normal that meet nothing.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..camplace.frame import LocalFrame
from ..camplace.rays import RayCaster
from ..scene.geometry import SceneGeometry

# Depth and matrices have passed through float32: a place is known to some spacings (6e-8) of the
# largest number in its way. Rays start this many above their surface, as a share of it.
_LIFT = 64.0 * float(np.finfo(np.float32).eps)


class OcclusionCaster:
    """Traces rays in one scene. Builds what it needs when it is first asked.

    Attributes:
        rays: that leave from each place.
    """

    def __init__(self, geometry: SceneGeometry, rays: int) -> None:
        self._geometry = geometry
        self.rays = rays

    @cached_property
    def _frame(self) -> LocalFrame:
        return LocalFrame.of(self._geometry, (), None)

    @cached_property
    def _caster(self) -> RayCaster:
        return RayCaster(self._frame.geometry_from_world(self._geometry))

    def open_share(
        self,
        camera: CachingCamera,
        texels: NDArray[np.bool_],
        depth: NDArray[np.float32],
        normal: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Of each chosen texel the share of rays that meet nothing.

        Args:
            camera: that sees them, with resolution R.
            texels: (R, R) which are asked for, N of them, all with a depth.
            depth: (R, R) metres along the view axis.
            normal: (N, 3) world space, unit, towards the camera.

        Returns:
            (N,) float32; the same for the same camera.
        """
        row, column = np.nonzero(texels)
        size = camera.resolution
        uv = (np.stack([column, row], axis=-1) + 0.5) / size
        seen = np.concatenate([uv, depth[texels].astype(np.float64)[:, None]], axis=-1)
        place = self._frame.from_world(camera.unproject(seen))
        eye = self._frame.from_world(camera.origin)
        reach = np.maximum(np.abs(place).max(axis=-1), np.abs(eye).max())
        up = normal.astype(np.float64)
        # From along the way to the eye: a shading normal may lean below its surface.
        start = place + (_LIFT * reach)[:, None] * (_unit(eye - place) + up)
        rng = np.random.default_rng(camera.id)
        open_rays = np.zeros(len(place))
        for _ in range(self.rays):
            # Points of the unit sphere about the normal's tip lie in cosine-weighted directions.
            direction = _unit(up + _unit(rng.standard_normal(up.shape)))
            open_rays += self._caster.first_hit(start, direction).triangle < 0
        return (open_rays / self.rays).astype(np.float32)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, np.finfo(np.float64).tiny))
