# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows traced with embree, pixel by pixel: the exact way, where shadow maps are the fast one.

For one sample of the view and one point of a light a ray goes from each pixel's surface to the
light. Nothing is looked up in texels, so that contact, thin parts and far away edges are as sharp
as Cycles has them, and a lamp with an extent is a disk that is turned towards each pixel.

Of a cell of a light each pixel looks at one of 16 spots, neighbours at others, and all pixels of
a 4 x 4 block at all. Where pixels nearby don't agree, a pixel looks at one in each quarter of the
cell; where those don't, at all. So the penumbra of N samples is that of 16 N points, for a few rays
where the cell is seen in parts. Nothing is blurred: contact stays sharp.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import Texture, read_texture, texture_from_array
from ...scene.geometry import SceneGeometry
from ...scene.light import Light
from ..light_points.light_cells import SPOTS
from ..light_points.light_sample import EmitterPoint, LightSample
from ..light_points.turned_disk import turned_way
from ..lights.light_reach import ReachPass
from ..shading.shadow import ShadowKind
from .shadow_rays import LIFT, LocalScene, ReceiverFinder, Receivers, ShadowRays
from .spot_looks import ALL_SPOTS, PixelPlaces, look_at_spots

_KIND = ShadowKind("traced_shadow", (("traced_spots", "FLOAT_2D"),), spots=SPOTS)


# A ray ends this share of its length before the light's point. What holds a lamp may lie exactly
# at the point; the sum of the roundings of start, direction and length is a few spacings (1.2e-7).
_SHORT_OF_LIGHT = 16.0 * float(np.finfo(np.float32).eps)

# Bytes of main memory for what is known of views' samples, 72 for a pixel.
_RECEIVER_BUDGET = 512 << 20


@dataclass(frozen=True)
class TracedShadow:
    """Which pixels of one sample of a view see one point of a light.

    Attributes:
        spots: R32F, a bit for each spot of the light's cell that is seen: all where its only point
            is.
        rays: how many rays it took.
    """

    spots: Texture
    rays: int

    @property
    def kind(self) -> ShadowKind:
        """What a shader that reads it is made of."""
        return _KIND

    @property
    def textures(self) -> Mapping[str, Any]:
        """By the names of `kind.samplers`."""
        return {"traced_spots": self.spots}

    def uniforms(self, _local_origin: NDArray[np.float64]) -> Mapping[str, Mapping[str, Any]]:
        """It has no uniform blocks."""
        return {}


@dataclass(frozen=True)
class _Seen:
    """What one sample of a view sees, at N pixels.

    Attributes:
        surface: the sample.
        rasterized: (N, 3) float32: the pixels' places as the shaders know them.
        receivers: the same as rays need them.
        number: (H, W) int32: which of the N a pixel is.
    """

    surface: SurfaceBuffer
    rasterized: NDArray[np.float32]
    receivers: Receivers
    number: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        each = self.receivers
        arrays = (self.rasterized, each.place, each.normal, each.lift, self.number)
        return sum(array.nbytes for array in arrays)


class TracedShadowPass:
    """Traces the shadows of one scene's geometry. Builds what it needs when it is first asked.

    Args:
        geometry: the scene's.
        reach: asks what lights shine on.
    """

    def __init__(self, geometry: SceneGeometry, reach: ReachPass | None = None) -> None:
        self._geometry = geometry
        self._scene: LocalScene | None = None
        self._reach = ReachPass() if reach is None else reach
        self._seen: OrderedDict[int, _Seen] = OrderedDict()

    def draw(
        self,
        surface: SurfaceBuffer,
        light: Light,
        sample: LightSample,
        *,
        stride: int = 1,
        casters: NDArray[np.bool_] | None = None,
        objects: Any = None,
        thorough: float = 0.5,
    ) -> TracedShadow:
        """The shadow of one point of a light, or of its cell.

        Args:
            surface: the sample of the view that is lit.
            light: the light.
            sample: its point, from `light_sample`.
            stride: the surface's pixels along the side of one of the layer's.
            casters: (T,) bool: the triangles that cast it; None for all that are
                `shadow_visible`. Each set that is met gets a tree of its own, once.
            objects: `ObjectShares.texture`; `surface` must then have its `objects`.
            thorough: where more than this share of the pixels sees the cell in parts, they look at
                four spots only, one in each quarter: by default it takes ten rays a pixel at most.
        """
        scene = self.local_scene(surface.origin)
        reach = self._reach.draw(surface, light, sample, stride, objects)
        seen = self._seen_by(surface, scene)
        row, column = np.nonzero(reach[..., 3])
        number = seen.number[
            _texel(row, stride, surface.height), _texel(column, stride, surface.width)
        ]
        rays = _Rays(
            ShadowRays(scene, casters),
            light,
            sample,
            seen=seen,
            number=number,
            way=reach[row, column].astype(np.float64),
        )
        if len(sample.spots):
            place = PixelPlaces(row, column, reach.shape[:2], surface.picture_height)
            spots = look_at_spots(rays.reach_spots, place, thorough)
        else:
            spots = np.where(rays.reach_point(), ALL_SPOTS, 0)
        picture = np.zeros((*reach.shape[:2], 1), dtype=np.float32)
        picture[row, column, 0] = spots
        return TracedShadow(texture_from_array(picture, "R32F"), rays.count)

    def local_scene(self, origin: NDArray[np.float64]) -> LocalScene:
        """What rays meet, in the space around a place (3,) of the world."""
        if self._scene is None or not np.array_equal(self._scene.origin, origin):
            self._scene = LocalScene(self._geometry, origin)
            self._seen.clear()
        return self._scene

    def _seen_by(self, surface: SurfaceBuffer, scene: LocalScene) -> _Seen:
        """Kept for lights to come, by the texture of the sample's places: that stays the same where
        surfaces are edited or told their objects, and is kept, so that its id stays its own."""
        key = id(surface.position)
        if key not in self._seen:
            self._seen[key] = _find(surface, ReceiverFinder(scene))
            used = sum(seen.nbytes for seen in self._seen.values())
            while used > _RECEIVER_BUDGET and len(self._seen) > 1:
                used -= self._seen.popitem(last=False)[1].nbytes
        self._seen.move_to_end(key)
        return self._seen[key]


class _Rays:
    """Rays from N pixels to a light.

    Attributes:
        count: how many were sent.

    Args:
        shadow_rays: what stops them.
        light: the light.
        sample: its point or cell.
        seen: the sample of the view.
        number: (N,) which of its receivers the pixels are.
        way: (N, 4) as of `ReachPass.draw`.
    """

    def __init__(
        self,
        shadow_rays: ShadowRays,
        light: Light,
        sample: LightSample,
        *,
        seen: _Seen,
        number: NDArray[np.int32],
        way: NDArray[np.float64],
    ) -> None:
        self._rays, self._light, self._sample = shadow_rays, light, sample
        self._origin = seen.surface.origin
        receivers = seen.receivers
        self._rasterized = seen.rasterized[number]
        self._way = way[:, :3]
        self._up = receivers.normal[number] * way[:, 3:]
        self._start = receivers.place[number] + self._up * receivers.lift[number, None]
        self.count = 0

    def reach_point(self) -> NDArray[np.bool_]:
        """(N,) whether rays to the sample's point meet nothing."""
        if self._light.type == "SUN":
            return self._open(slice(None), self._way)
        # The way was measured from where the surface was rasterized.
        return self._open(slice(None), self._rasterized + self._way - self._start)

    def reach_spots(
        self, rows: NDArray[np.int64], spots: NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Rays of some pixels to a spot each.

        Args:
            rows: (R,) which of the N.
            spots: (R,) which spots.

        Returns:
            (R,), (R,) whether it is open, and whether the spot is on the side that is lit.
        """
        places, start = self._sample.spots[spots], self._start[rows]
        if self._sample.per_receiver:
            from_centre = start - (self._light.position - self._origin)
            way = turned_way(self._light, from_centre, places[:, :2])
        elif self._light.type == "SUN":
            way = places
        else:
            way = places - self._origin - start
        above = np.einsum("rx,rx->r", way, self._up[rows]) > 0.0
        is_open = np.zeros(len(rows), dtype=np.bool_)
        is_open[above] = self._open(rows[above], way[above])
        return is_open, above

    def _open(self, rows: NDArray[np.int64] | slice, way: NDArray[np.float64]) -> NDArray[np.bool_]:
        start, sample = self._start[rows], self._sample
        self.count += len(start)
        if self._light.type == "SUN":
            return ~self._rays.blocked(start, way, np.full(len(way), np.inf))
        length = np.linalg.norm(way, axis=1)
        limit = length * (1.0 - _SHORT_OF_LIGHT)
        if sample.emitter is not None:
            short = _before_emitter(sample.emitter, start + self._origin, way)
            limit = np.maximum(limit - short, 0.0)
        direction = way / np.where(length > 0.0, length, 1.0)[:, None]
        return ~self._rays.blocked(start, direction, limit)


def _before_emitter(
    emitter: EmitterPoint, start: NDArray[np.float64], way: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(R,) metres before a glowing triangle at which rays must end, so as not to meet it.

    Args:
        emitter: the point on the triangle.
        start: (R, 3) world space: where the rays start.
        way: (R, 3) from there to the point.
    """
    length = np.linalg.norm(way, axis=1)
    reach = np.abs(emitter.corners[None] - start[:, None]).max(axis=(1, 2))
    # As for where rays start, along a slanted ray; one along the triangle ends at its start.
    cosine = np.abs(way @ emitter.normal) / np.maximum(length, np.finfo(np.float64).tiny)
    return LIFT * reach / np.maximum(cosine, LIFT)


def _find(surface: SurfaceBuffer, finder: ReceiverFinder) -> _Seen:
    position = read_texture(surface.position)
    normal = read_texture(surface.geometric_normal)
    hit = position[..., 3] > 0.0
    number = np.cumsum(hit, dtype=np.int32).reshape(hit.shape) - 1
    places = position[hit][:, :3]
    receivers = finder.receivers(
        surface.eye,
        surface.perspective,
        places.astype(np.float64),
        normal[hit][:, :3].astype(np.float64),
    )
    return _Seen(surface, places, receivers, number)


def _texel(pixel: NDArray[np.int64], stride: int, size: int) -> NDArray[np.int64]:
    """As `surface_texel` in addon/glsl/lib/surface_texel.glsl, along one side."""
    return np.minimum(pixel * stride + stride // 2, size - 1)
