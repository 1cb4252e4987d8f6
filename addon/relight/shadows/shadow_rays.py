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
from ...scene.geometry import SceneGeometry
from .cutout_alpha import CutoutAlpha

# What embree makes of a triangle's plane is off by some roundings of the largest vector from the
# ray's origin to its corners: one of each corner's difference to the origin, and about four more
# of products and sums in the plane's distance. The origin itself is rounded to float32 once. 16
# half spacings (u = 6e-8) are above their sum for any triangle that is not a sliver.
LIFT = 16.0 * 0.5 * float(np.finfo(np.float32).eps)

# Cut-away layers that a ray may pass. Each pass that is needed costs one query for the rays that
# are left, so the bound is far above what foliage has.
MAX_LAYERS = 1024

# A surface that is looked for lies within this share of its distance from the eye, and is turned
# no more than this cosine from the normal that is known of it.
_NEAR_SHARE = 1e-2
_SAME_NORMAL = 0.99

# Receivers at once: what numpy makes of them stays in the processor's cache.
_PART = 1 << 14


@dataclass(frozen=True)
class Receivers:
    """Points on surfaces, ready for rays to start from.

    Attributes:
        place: (N, 3) float64, local space: on their triangles' own planes.
        normal: (N, 3) float64, unit: of their triangles, facing the viewer.
        lift: (N,) float64, metres: how far above its plane a ray must start.
    """

    place: NDArray[np.float64]
    normal: NDArray[np.float64]
    lift: NDArray[np.float64]


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

    def mesh(self, chosen: NDArray[np.bool_]) -> EmbreeMesh:
        """The tree of some triangles (T,), built when it is first asked for."""
        key = hashlib.blake2b(np.packbits(chosen).tobytes(), digest_size=16).digest()
        if key not in self._meshes:
            self._meshes[key] = EmbreeMesh(self.geometry, chosen)
        return self._meshes[key]

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


class ReceiverFinder:
    """Finds the triangles that pixels see, for where rays from them start.

    Rasterized positions are interpolated in float32 and off their planes by some spacings of
    their triangle's farthest corner. A ray along the pixel's own finds the triangle, and with it
    the place on its plane to float64, its exact normal and how far rays must start above it.

    Args:
        scene: the triangles.
    """

    def __init__(self, scene: LocalScene) -> None:
        self._geometry = scene.geometry
        self._mesh = scene.mesh(self._geometry.camera_visible)

    def receivers(
        self,
        eye: NDArray[np.float64],
        perspective: bool,
        position: NDArray[np.float64],
        normal: NDArray[np.float64],
    ) -> Receivers:
        """What pixels see.

        Args:
            eye: (3,) local space: the camera's place; without `perspective` the unit direction
                towards it.
            perspective: which of the two it is.
            position: (N, 3) local space, as rasterized.
            normal: (N, 3) unit geometric normals, facing the viewer.
        """
        to_eye = eye - position if perspective else np.broadcast_to(eye, position.shape)
        size = np.linalg.norm(to_eye, axis=1)
        # How far surfaces are from the viewer gives the scale of "near" them.
        scale = size if perspective else np.abs(position).max(axis=1)
        to_eye = to_eye / np.where(size > 0.0, size, 1.0)[:, None]
        triangle = np.full(len(position), -1, dtype=np.int64)
        exact = np.zeros_like(position)
        # From half way to the eye; where something that the view clips lies between, from near.
        for share in (0.5, _NEAR_SHARE):
            rest = np.flatnonzero(triangle < 0)
            back = share * scale[rest]
            hit, distance, _ = self._mesh.closest(
                position[rest] + back[:, None] * to_eye[rest], -to_eye[rest], None
            )
            near = (hit >= 0) & (np.abs(distance - back) <= _NEAR_SHARE * scale[rest])
            normal_there = self._geometry.normal_of(hit)
            cosine = _dot(normal_there, normal[rest])
            same = near & (np.abs(cosine) >= _SAME_NORMAL)
            triangle[rest[same]] = hit[same]
            exact[rest[same]] = np.where(cosine < 0.0, -1.0, 1.0)[same, None] * normal_there[same]
        return self._on_planes(position, normal, triangle, exact)

    def _on_planes(
        self,
        position: NDArray[np.float64],
        normal: NDArray[np.float64],
        triangle: NDArray[np.int64],
        exact: NDArray[np.float64],
    ) -> Receivers:
        """Receivers at (N, 3) positions: on their triangles' (N,) planes, of which `exact` (N, 3)
        are the normals. Where a pixel's triangle isn't found (-1, a hair's breadth of its outline),
        its own place and normal are all there is."""
        place, facing = position.copy(), normal.copy()
        reach = _largest(position)
        vertices, triangles = self._geometry.vertices, self._geometry.triangles

        def work(part: slice) -> None:
            found = part.start + np.flatnonzero(triangle[part] >= 0)
            corners = [vertices[triangles[triangle[found], k]] for k in range(3)]
            facing[found] = exact[found]
            above = _dot(position[found] - corners[0], exact[found])
            there = position[found] - above[:, None] * exact[found]
            place[found] = there
            away = _largest(there)
            for corner in corners:
                np.maximum(away, _largest(corner - there), out=away)
            reach[found] = away

        in_parts(work, len(position), _PART)
        return Receivers(place, facing, LIFT * reach)


def _largest(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) the largest component of each of (N, 3), whatever its sign."""
    x, y, z = np.abs(vectors).T
    return np.asarray(np.maximum(np.maximum(x, y), z))


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("nx,nx->n", a, b))
