# SPDX-License-Identifier: GPL-3.0-or-later
"""Which places of a view a light reaches: its cone, its filters and what stands between count.

This judges lights, and shades nothing: some pixels and a few points of each light are enough, and
shadows that an artist moved are where they would be without that.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.local_scene import LocalScene
from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import read_texture
from ...scene.light import Light
from ..light_points.light_sample import light_sample
from ..lights.light_reach import ReachPass
from .receivers import Receivers, find_triangles, on_planes
from .shadow_rays import shadow_rays

# About as many pixels of a view are looked at.
_PLACES = 1000

# Points of a light that each of them may see.
_POINTS = 4

# A ray ends this share of its length before its light's point: well before what holds a lamp, or
# glows itself.
_SHORT = 1e-3


class ReachedPlaces:
    """Some places of one view.

    Args:
        surface: a sample of the view.
    """

    def __init__(self, surface: SurfaceBuffer) -> None:
        self._surface = surface
        pixels = surface.width * surface.height
        self._stride = max(1, round(float(np.sqrt(pixels / _PLACES))))
        position = self._some(surface.position)
        self._seen = position[..., 3] > 0.0
        self._local = position[self._seen, :3]
        self._found: tuple[LocalScene, Receivers] | None = None

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,) world space: where the surfaces' local space has its origin."""
        return self._surface.origin

    @property
    def places(self) -> NDArray[np.float64]:
        """(N, 3) world space."""
        return self._local + self.origin

    def share(
        self,
        light: Light,
        reach: ReachPass,
        scene: LocalScene | None,
        casters: NDArray[np.bool_] | None = None,
        objects: tuple[SurfaceBuffer, Any] | None = None,
    ) -> NDArray[np.float64]:
        """(N,) the share of a light's points that reach each place.

        Args:
            light: the light.
            reach: asks what it shines on.
            scene: what casts its shadows, in the surfaces' local space; None for nothing.
            casters: (T,) bool: the triangles that do; None for all that are `shadow_visible`.
            objects: the same sample of the view with its `objects`, and `ObjectShares.texture`.
        """
        surface, table = (self._surface, None) if objects is None else objects
        reached = np.zeros(len(self._local))
        for k in range(_POINTS):
            sample = light_sample(light, k, _POINTS)
            way = reach.draw(surface, light, sample, self._stride, table)[self._seen]
            number = np.flatnonzero(way[:, 3])
            if scene is not None and number.size:
                free = self._free(scene, casters, number, way[number].astype(np.float64), light)
                number = number[free]
            reached[number] += 1.0 / _POINTS
        return reached

    def _free(
        self,
        scene: LocalScene,
        casters: NDArray[np.bool_] | None,
        number: NDArray[np.int64],
        way: NDArray[np.float64],
        light: Light,
    ) -> NDArray[np.bool_]:
        """Whether nothing blocks some of the places' ways to a point."""
        receivers = self._receivers(scene)
        start = receivers.starts(number, np.sign(way[:, 3]).astype(np.float32))
        length = np.linalg.norm(way[:, :3], axis=1)
        limit = np.full(len(way), np.inf) if light.type == "SUN" else length * (1.0 - _SHORT)
        direction = way[:, :3] / np.where(length > 0.0, length, 1.0)[:, None]
        rays = shadow_rays(scene, casters)
        is_open = ~rays.blocked(start.T, direction, limit)
        return is_open & ~rays.buried.of(receivers, number)

    def _receivers(self, scene: LocalScene) -> Receivers:
        if self._found is None or self._found[0] is not scene:
            triangles = self._surface.triangles
            if triangles is None:
                found = find_triangles(scene, self._surface, self._local.T, self._normal.T)
            else:
                found = self._sampled(triangles.read())[self._seen]
            self._found = (scene, on_planes(scene, self._local.T, self._normal.T, found))
        return self._found[1]

    @cached_property
    def _normal(self) -> NDArray[np.float32]:
        return self._some(self._surface.geometric_normal)[self._seen, :3]

    def _some(self, texture: Any) -> NDArray[np.float32]:
        return self._sampled(read_texture(texture))

    def _sampled(self, pixels: NDArray[Any]) -> NDArray[Any]:
        """The texels that `surface_texel` in addon/glsl/lib/surface_texel.glsl reads."""
        rows, columns = (
            np.minimum(np.arange(-(-n // self._stride)) * self._stride + self._stride // 2, n - 1)
            for n in pixels.shape[:2]
        )
        return pixels[np.ix_(rows, columns)]
