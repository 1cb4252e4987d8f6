# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays against a scene's triangles, with embree."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...corrmap.local_scene import LocalScene, digest
from .buried import BuriedPlaces
from .cutout_alpha import CutoutAlpha
from .sheer_light import SheerLight

# What embree makes of a triangle's plane is off by some roundings of the largest vector from the
# ray's origin to its corners: one of each corner's difference to the origin, and about four more
# of products and sums in the plane's distance. The origin itself is rounded to float32 once. 16
# half spacings (u = 6e-8) are above their sum for any triangle that is not a sliver, with the three
# of the normal (`TrianglePlanes`), by which a start is off its plane.
LIFT = 16.0 * 0.5 * float(np.finfo(np.float32).eps)

# Cut-away layers that a ray may pass. Each pass that is needed costs one query for the rays that
# are left, so the bound is far above what foliage has.
MAX_LAYERS = 1024


def shadow_rays(scene: LocalScene, casters: NDArray[np.bool_] | None = None) -> ShadowRays:
    """Rays that some triangles (T,) stop, see `ShadowRays`; kept with the scene."""
    key = ("shadow rays", b"" if casters is None else digest(casters))
    if key not in scene.made:
        scene.made[key] = ShadowRays(scene, casters)
    rays: ShadowRays = scene.made[key]
    return rays


class ShadowRays:
    """Rays that are stopped by some of a scene's triangles, and dimmed by sheer ones.

    Args:
        scene: the triangles.
        casters: (T,) bool: which of them cast shadows; None for all that are `shadow_visible`.
    """

    def __init__(self, scene: LocalScene, casters: NDArray[np.bool_] | None = None) -> None:
        self._geometry = scene.geometry
        casters = self._geometry.shadow_visible if casters is None else casters
        away, mixed = scene.cut
        sheer = self._geometry.is_sheer
        self._sheer = scene.mesh(casters & sheer) if sheer.any() else None
        self._light = SheerLight(self._geometry)
        solid = casters & ~mixed & ~away & ~sheer
        self._scene, self._solid_casters = scene, solid
        self._solid = scene.mesh(solid)
        self._masked = scene.mesh(casters & mixed)
        self._alpha = CutoutAlpha(self._geometry)

    @property
    def dims(self) -> bool:
        """Whether there is anything that lets light pass in part."""
        return self._sheer is not None and len(self._sheer) > 0

    def through(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limit: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """(R, 3) what sheer surfaces let through, all along rays as of `blocked`: the product of
        what each does, as of Cycles' transparent shadows."""
        result = np.ones((len(origins), 3))
        mesh = self._sheer
        if mesh is None or not len(mesh):
            return result
        travelled = np.zeros(len(origins))
        # Most rays meet none, which is found sooner than what is met.
        active = np.flatnonzero(mesh.any_hit(origins, directions, limit))
        for _ in range(MAX_LAYERS):
            start = origins[active] + travelled[active, None] * directions[active]
            hit, step, barycentric = mesh.closest(
                start, directions[active], limit[active] - travelled[active]
            )
            met = hit >= 0
            active, hit, step, start = active[met], hit[met], step[met], start[met]
            if not active.size:
                return result
            result[active] *= self._light.through(hit, barycentric[met])
            travelled[active] += step + self._lift_from(start, hit)
            goes_on = (travelled[active] < limit[active]) & result[active].any(axis=1)
            active = active[goes_on]
        result[active] = 0.0
        return result

    @cached_property
    def buried(self) -> BuriedPlaces:
        """Places in opaque triangles that stop rays, which no ray leaves but those that start
        above their triangle for the terminator's sake. Those in cut-out and sheer ones are not
        told."""
        return BuriedPlaces(self._scene, self._solid_casters)

    def blocked(
        self,
        origins: NDArray[np.floating],
        directions: NDArray[np.floating],
        limit: NDArray[np.floating],
    ) -> NDArray[np.bool_]:
        """(R,) whether something stops rays before `limit` (R,) along (R, 3) unit directions."""
        blocked = self._solid.any_hit(origins, directions, limit)
        if len(self._masked):
            rest = np.flatnonzero(~blocked)
            blocked[rest] = self._stopped(origins[rest], directions[rest], limit[rest])
        return blocked

    def _stopped(
        self,
        origins: NDArray[np.floating],
        directions: NDArray[np.floating],
        limit: NDArray[np.floating],
    ) -> NDArray[np.bool_]:
        """(R,) whether a cut-out stops rays where it is not cut away."""
        stopped = np.zeros(len(origins), dtype=np.bool_)
        travelled = np.zeros(len(origins))
        active = np.arange(len(origins))
        for _ in range(MAX_LAYERS):
            start = origins[active] + travelled[active, None] * directions[active]
            hit, step, barycentric = self._masked.closest(
                start, directions[active], limit[active] - travelled[active]
            )
            met = hit >= 0
            active, hit, step, start = active[met], hit[met], step[met], start[met]
            if not active.size:
                return stopped
            opaque = self._alpha.opaque(hit, barycentric[met])
            stopped[active[opaque]] = True
            # One that is met again is cut away again.
            travelled[active] += step + self._lift_from(start, hit)
            active = active[~opaque & (travelled[active] < limit[active])]
        stopped[active] = True
        return stopped

    def _lift_from(
        self, points: NDArray[np.floating], triangle: NDArray[np.int64]
    ) -> NDArray[np.floating]:
        """(R,) metres above (R,) triangles at which rays from (R, 3) points don't meet them."""
        corners = self._geometry.vertices[self._geometry.triangles[triangle]]
        reach = np.abs(corners - points[:, None]).max(axis=(1, 2))
        return LIFT * np.maximum(reach, np.abs(points).max(axis=1))
