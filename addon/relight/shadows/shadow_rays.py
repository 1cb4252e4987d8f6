# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays against a scene's triangles, with embree."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...camplace.embree_mesh import EmbreeMesh
from ...camplace.mask import Mask
from ...camplace.parallel import in_parts
from ...scene.geometry import PART, SceneGeometry
from .cutout_alpha import CutoutAlpha

# What embree makes of a triangle's plane is off by some roundings of the largest vector from the
# ray's origin to its corners: one of each corner's difference to the origin, and about four more
# of products and sums in the plane's distance. The origin itself is rounded to float32 once. 16
# half spacings (u = 6e-8) are above their sum for any triangle that is not a sliver, with the three
# of the normal (`TrianglePlanes`), by which a start is off its plane.
LIFT = 16.0 * 0.5 * float(np.finfo(np.float32).eps)

# Cut-away layers that a ray may pass. Each pass that is needed costs one query for the rays that
# are left, so the bound is far above what foliage has.
MAX_LAYERS = 1024

# Above a rounding to float32.
_ROUNDED_UP = 1.0 + 1e-6


@dataclass(frozen=True)
class TrianglePlanes:
    """The planes of triangles, in the space of their vertices.

    Attributes:
        normal: (T, 3) float32, unit; zero of a triangle that has none.
        offset: (T,) float64, metres: its product with any point of the plane.
        extent: (T,) float32, metres: the largest component of its edges, or a little more.
    """

    normal: NDArray[np.float32]
    offset: NDArray[np.float64]
    extent: NDArray[np.float32]

    @classmethod
    def of(cls, geometry: SceneGeometry) -> TrianglePlanes:
        """Of all triangles."""
        count = len(geometry)
        normal = np.empty((count, 3), dtype=np.float32)
        offset, extent = np.empty(count), np.empty(count, dtype=np.float32)

        def work(part: slice) -> None:
            normal[part] = geometry.normal_of(part)
            a, b, c = (geometry.vertices[geometry.triangles[part, k]] for k in range(3))
            # Of the normal as it is kept, so that its rounding counts from this corner only.
            offset[part] = np.einsum("tx,tx->t", normal[part].astype(np.float64), a)
            longest = np.maximum(np.maximum(np.abs(b - a), np.abs(c - b)), np.abs(a - c))
            extent[part] = longest.max(axis=1) * _ROUNDED_UP

        in_parts(work, count, PART)
        return cls(normal, offset, extent)


class LocalScene:
    """A scene's triangles in a local space, and embree's trees of some of them.

    The triangles' corners are made relative to `origin` in float64 and then rounded to float32,
    as for the GPU, so that what is rasterized and what is traced is the same surface, and a scene
    far from the world's origin keeps its precision.

    Attributes:
        geometry: in local space.
        origin: (3,) float64, world space: where local space has its origin.
    """

    def __init__(self, geometry: SceneGeometry, origin: NDArray[np.float64]) -> None:
        local = (geometry.vertices - origin).astype(np.float32).astype(np.float64)
        self.geometry = replace(geometry, vertices=local)
        self.origin = origin
        self._meshes: dict[bytes, EmbreeMesh] = {}
        self._rays: dict[bytes, ShadowRays] = {}

    def mesh(self, chosen: NDArray[np.bool_]) -> EmbreeMesh:
        """The tree of some triangles (T,), built when it is first asked for."""
        key = _digest(chosen)
        if key not in self._meshes:
            self._meshes[key] = EmbreeMesh(self.geometry, chosen)
        return self._meshes[key]

    @cached_property
    def planes(self) -> TrianglePlanes:
        """Of the triangles; made when they are first asked for."""
        return TrianglePlanes.of(self.geometry)

    def rays(self, casters: NDArray[np.bool_] | None) -> ShadowRays:
        """Rays that some triangles (T,) stop, see `ShadowRays`."""
        key = b"" if casters is None else _digest(casters)
        if key not in self._rays:
            self._rays[key] = ShadowRays(self, casters)
        return self._rays[key]

    @cached_property
    def cut(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(T,), (T,) which triangles are cut away all over, and which in parts or perhaps."""
        mask = Mask(self.geometry)
        there, away = mask.uniform
        return away, mask.masked & ~there & ~away


class ShadowRays:
    """Rays that are stopped by some of a scene's triangles.

    Args:
        scene: the triangles.
        casters: (T,) bool: which of them cast shadows; None for all that are `shadow_visible`.
    """

    def __init__(self, scene: LocalScene, casters: NDArray[np.bool_] | None = None) -> None:
        self._geometry = scene.geometry
        casters = self._geometry.shadow_visible if casters is None else casters
        away, mixed = scene.cut
        self._solid = scene.mesh(casters & ~mixed & ~away)
        self._masked = scene.mesh(casters & mixed)
        self._alpha = CutoutAlpha(self._geometry)

    def blocked(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limit: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """(R,) whether something stops rays before `limit` (R,) along (R, 3) unit directions."""
        blocked = self._solid.any_hit(origins, directions, limit)
        if len(self._masked):
            rest = np.flatnonzero(~blocked)
            blocked[rest] = self._stopped(origins[rest], directions[rest], limit[rest])
        return blocked

    def _stopped(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limit: NDArray[np.float64],
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
        self, points: NDArray[np.float64], triangle: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """(R,) metres above (R,) triangles at which rays from (R, 3) points don't meet them."""
        corners = self._geometry.vertices[self._geometry.triangles[triangle]]
        reach = np.abs(corners - points[:, None]).max(axis=(1, 2))
        return LIFT * np.maximum(reach, np.abs(points).max(axis=1))


def _digest(chosen: NDArray[np.bool_]) -> bytes:
    return hashlib.blake2b(np.packbits(chosen).tobytes(), digest_size=16).digest()
