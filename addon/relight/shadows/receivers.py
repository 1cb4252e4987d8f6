# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays start that leave the surfaces of a view."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts
from ...corrmap.local_scene import LocalScene
from ...corrmap.seen_triangles import RayHits
from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import read_texture
from .even_places import lies_between
from .flat_places import REACH, flat_steps
from .shadow_rays import LIFT, ShadowRays
from .terminator import SmoothReceivers
from .vectors import dot

# A surface that is looked for lies within this share of its distance from the eye, and is turned
# no more than this cosine from the normal that is known of it.
_NEAR_SHARE = 1e-2
_SAME_NORMAL = 0.99

# Of a float32 near a plane for the place on it.
_ROUNDED_UP = 1.0 + 1e-6

# What is kept of a receiver of which nobody asked whether it is buried.
_UNKNOWN = -1

# Receivers at once: what numpy makes of them stays in the processor's cache.
_PART = 1 << 14


@dataclass(frozen=True)
class Receivers:
    """Points on surfaces, ready for rays to start from. Components come first: numpy works on
    long rows several times faster than on triples.

    Attributes:
        place: (3, N) float64, local space: on their triangles' own planes.
        normal: (3, N) float32, unit: of their triangles, facing the viewer.
        lift: (N,) float32, metres: how far above its plane a ray must start.
        triangle: (N,) int32 which triangle that is; -1 where it is not known.
    """

    place: NDArray[np.float64]
    normal: NDArray[np.float32]
    lift: NDArray[np.float32]
    triangle: NDArray[np.int32]

    def starts(
        self, number: NDArray[np.integer[Any]], side: NDArray[np.float32] | None = None
    ) -> NDArray[np.float64]:
        """(3, R) where rays from some of them (R,) start.

        Args:
            number: (R,) which.
            side: (R,) 1 for rays on the viewer's side, -1 for the other; None for 1.
        """
        up = self.normal.take(number, axis=1) * self.lift.take(number)
        if side is not None:
            up *= side
        return self.place.take(number, axis=1) + up

    @property
    def viewer_starts(self) -> NDArray[np.float32]:
        """(3, N) the same of all on the viewer's side."""
        starts = np.empty(self.place.shape, dtype=np.float32)

        def work(part: slice) -> None:
            up = self.normal[:, part] * self.lift[part]
            np.add(self.place[:, part], up, out=starts[:, part], casting="same_kind")

        in_parts(work, starts.shape[1], _PART)
        return starts


@dataclass(frozen=True)
class SeenReceivers:
    """What one sample of a view sees, at N pixels.

    Attributes:
        surface: the sample.
        receivers: the pixels' places, as rays need them.
        smooth: the same as they are shaded.
        number: (H, W) int32: which of the N a pixel is; any where it sees nothing.
        hit: (H, W) whether it sees a surface.
    """

    surface: SurfaceBuffer
    receivers: Receivers
    smooth: SmoothReceivers
    number: NDArray[np.int32]
    hit: NDArray[np.bool_]
    _buried: dict[int, NDArray[np.int8]] = field(default_factory=dict)

    @classmethod
    def of(cls, surface: SurfaceBuffer, scene: LocalScene) -> SeenReceivers:
        """Of a sample of the view in a scene around the same origin."""
        seen = surface.triangles
        if seen is not None and seen.hits is not None:
            shape = (surface.height, surface.width)
            hit, found = _of_hits(scene, surface, seen.hits)
            hit, shaded = hit.reshape(shape), seen.hits.shaded
            if shaded is not None and not hit.all():
                shaded = shaded[:, hit.ravel()]
        else:
            hit, found = _of_textures(scene, surface)
            texture = surface.shading_normal
            shaded = (
                None if texture is None else _pixels(read_texture(texture), np.flatnonzero(hit))
            )
        number = np.cumsum(hit, dtype=np.int32).reshape(hit.shape) - np.int32(1)
        smooth = SmoothReceivers(scene.geometry, found.triangle, found.place, found.normal, shaded)
        return cls(surface, found, smooth, number, hit)

    @cached_property
    def starts(self) -> NDArray[np.float32]:
        """(3, H W) `Receivers.starts` of the pixels on the viewer's side; not numbers where these
        see nothing. Made when it is first asked for, as all below."""
        return self._pictured(self.receivers.viewer_starts)

    @cached_property
    def shaded(self) -> NDArray[np.floating]:
        """(3, H W) the normals that the pixels are shaded with."""
        return self._pictured(self.smooth.normal)

    @cached_property
    def even(self) -> NDArray[np.bool_]:
        """(H, W) see `lies_between`."""
        return lies_between(self.starts.reshape(3, *self.hit.shape))

    def _pictured(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """(3, H W) of all pixels, from (3, N)."""
        if values.shape[1] == self.hit.size:
            return values
        picture = np.full((3, self.hit.size), np.nan, dtype=values.dtype)
        picture[:, self.hit.ravel()] = values
        return picture

    @cached_property
    def steps(self) -> NDArray[np.float32]:
        """(2, 3, N) see `flat_steps`; found when it is first asked for."""
        return flat_steps(self.receivers, self.hit, self.surface.picture_height)

    def close_buried(
        self, rays: ShadowRays, number: NDArray[np.integer], is_open: NDArray[np.bool_]
    ) -> None:
        """Of rays that are open (R,), close those from places that none leaves. Which these are is
        found once for each receiver and the same rays, which must last as long as this.

        Args:
            rays: what stops them.
            number: (R,) the receivers that they leave.
            is_open: (R,) is changed.
        """
        if not rays.buried.exist:
            return
        free = np.flatnonzero(is_open)
        number = number.take(free)
        if id(rays) not in self._buried:
            nothing = np.full(len(self.receivers.triangle), _UNKNOWN, dtype=np.int8)
            # Several threads ask.
            self._buried.setdefault(id(rays), nothing)
        known = self._buried[id(rays)]
        new = np.unique(number[known.take(number) == _UNKNOWN])
        known[new] = rays.buried.of(self.receivers, new)
        is_open[free] = known.take(number) == 0

    @property
    def around(self) -> NDArray[np.float64] | None:
        """(PLACES, 2) the surface's; None where some lie farther away than `steps` knows of, as a
        wide pixel filter's do. Of Blender's default filter they are up to 1.8 pixels away."""
        around = self.surface.around
        return None if around is None or np.abs(around).max() > REACH else around

    @property
    def nbytes(self) -> int:
        """Bytes of main memory, with those of `steps`, and of others once they are made."""
        each = self.receivers
        made = (vars(self).get(name) for name in ("starts", "even"))
        arrays = (each.place, each.normal, each.lift, self.number, self.hit, *made)
        kept = sum(array.nbytes for array in arrays if array is not None)
        return kept + 24 * len(each.lift) + self.smooth.nbytes


def on_planes(
    scene: LocalScene,
    position: NDArray[np.float32],
    normal: NDArray[np.float32],
    triangle: NDArray[np.int64],
) -> Receivers:
    """Receivers on the planes of their triangles.

    Rasterized positions are made in float32 and off their planes by some spacings.

    Args:
        scene: the triangles.
        position: (3, N) local space, as rasterized.
        normal: (3, N) unit geometric normals, facing the viewer.
        triangle: (N,) by their numbers in the geometry. Where one isn't known (-1), or has no
            plane to speak of, the pixel's own place and normal are all there is.
    """
    planes = scene.planes
    place, facing = position.astype(np.float64), normal.copy()
    count = place.shape[1]
    lift, on = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.int32)

    def work(part: slice) -> None:
        some, known, own = triangle[part], facing[:, part], place[:, part]
        number = np.maximum(some, 0)
        exact = planes.normal.take(number, axis=0).T
        cosine = dot(exact, known)
        same = (some >= 0) & (np.abs(cosine) >= _SAME_NORMAL)
        above = dot(own, exact) - planes.offset.take(number)
        above[~same] = 0.0
        reach = np.zeros(len(some))
        turn = np.where(cosine < 0.0, np.float32(-1.0), np.float32(1.0))
        for axis in range(3):
            own[axis] -= above * exact[axis]
            np.maximum(reach, np.abs(own[axis]), out=reach)
            np.copyto(known[axis], exact[axis] * turn, where=same)
        np.maximum(reach, planes.extent.take(number), out=reach, where=same)
        lift[part] = LIFT * reach
        on[part] = np.where(same, some, -1)

    in_parts(work, count, _PART)
    return Receivers(place, facing, lift, on)


def _of_textures(scene: LocalScene, surface: SurfaceBuffer) -> tuple[NDArray[np.bool_], Receivers]:
    """(H, W) which pixels see a surface, and these on their triangles."""
    position = read_texture(surface.position)
    hit = position[..., 3] > 0.0
    some = np.flatnonzero(hit)
    places, normal = (
        _pixels(pixels, some) for pixels in (position, read_texture(surface.geometric_normal))
    )
    if surface.triangles is None:
        triangle = find_triangles(scene, surface, places, normal)
    else:
        triangle = surface.triangles.read().take(some)
    return hit, on_planes(scene, places, normal, triangle)


def _of_hits(
    scene: LocalScene, surface: SurfaceBuffer, hits: RayHits
) -> tuple[NDArray[np.bool_], Receivers]:
    """(P,) the same of P pixels whose rays met the triangles."""
    hit = hits.triangle >= 0
    triangle, place = hits.triangle, hits.place
    if not hit.all():
        some = np.flatnonzero(hit)
        triangle, place = triangle.take(some), place.take(some, axis=1)
    planes, eye = scene.planes, surface.eye[:, None].astype(np.float32)
    on, facing = np.empty(place.shape), np.empty(place.shape, dtype=np.float32)
    lift = np.empty(len(triangle), dtype=np.float32)

    def work(part: slice) -> None:
        number, own = triangle[part], place[:, part]
        exact = np.ascontiguousarray(planes.normal.take(number, axis=0).T)
        to_eye = eye - own if surface.perspective else eye
        turn = np.where(dot(exact, to_eye) < 0.0, np.float32(-1.0), np.float32(1.0))
        np.multiply(exact, turn, out=facing[:, part])
        above = dot(own.astype(np.float64), exact) - planes.offset.take(number)
        np.subtract(own, above * exact, out=on[:, part])
        x, y, z = np.abs(own)
        reach = np.maximum(np.maximum(x, y), np.maximum(z, planes.extent.take(number)))
        lift[part] = np.float32(LIFT * _ROUNDED_UP) * reach

    in_parts(work, len(triangle), _PART)
    return hit, Receivers(on, facing, lift, triangle)


def _pixels(picture: NDArray[np.float32], some: NDArray[np.int64]) -> NDArray[np.float32]:
    """(3, N) of some pixels of (H, W, 4), in their order."""
    pixels = picture.reshape(-1, 4)
    found = np.empty((3, len(some)), dtype=np.float32)
    every = len(some) == len(pixels)

    def work(part: slice) -> None:
        chosen = pixels[part] if every else pixels.take(some[part], axis=0)
        found[:, part] = chosen[:, :3].T

    in_parts(work, len(some), _PART)
    return found


def find_triangles(
    scene: LocalScene,
    surface: SurfaceBuffer,
    position: NDArray[np.float32],
    normal: NDArray[np.float32],
) -> NDArray[np.int64]:
    """(N,) the triangles that pixels see, by rays along theirs, of surfaces that nobody rasterized;
    -1 where there is none.

    Args:
        scene: the triangles.
        surface: from where it is seen.
        position: (3, N) local space.
        normal: (3, N) unit geometric normals, facing the viewer.
    """
    places, normal = position.T.astype(np.float64), normal.T
    to_eye = np.broadcast_to(surface.eye, places.shape)
    if surface.perspective:
        to_eye = to_eye - places
    size = np.linalg.norm(to_eye, axis=1)
    # How far surfaces are from the viewer gives the scale of "near" them.
    scale = size if surface.perspective else np.abs(places).max(axis=1)
    to_eye = to_eye / np.where(size > 0.0, size, 1.0)[:, None]
    mesh = scene.mesh(scene.geometry.camera_visible)
    triangle = np.full(len(places), -1, dtype=np.int64)
    # From half way to the eye; where something that the view clips lies between, from near.
    for share in (0.5, _NEAR_SHARE):
        rest = np.flatnonzero(triangle < 0)
        back = share * scale[rest]
        hit, distance, _ = mesh.closest(
            places[rest] + back[:, None] * to_eye[rest], -to_eye[rest], None
        )
        near = (hit >= 0) & (np.abs(distance - back) <= _NEAR_SHARE * scale[rest])
        cosine = np.einsum("nx,nx->n", scene.geometry.normal_of(hit), normal[rest])
        same = near & (np.abs(cosine) >= _SAME_NORMAL)
        triangle[rest[same]] = hit[same]
    return triangle
