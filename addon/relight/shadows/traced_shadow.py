# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows traced with embree, pixel by pixel: the exact way, where shadow maps are the fast one.

For one sample of the view and one point of a light a ray goes from each pixel's surface to the
light. Nothing is looked up in texels, so that contact, thin parts and far away edges are as sharp
as Cycles has them, and a lamp with an extent is a disk that is turned towards each pixel.

Of a cell of a light each pixel looks at one of 16 spots, neighbours at others, and all pixels of
a 4 x 4 block at all. Where pixels nearby don't agree, a pixel looks at one in each quarter of the
cell; where those don't, at all. So the penumbra of N samples is that of 16 N points, for a few rays
where the cell is seen in parts. Nothing is blurred: contact stays sharp.

On planes each spot is looked at from a place of its own in the pixel (`flat_places`). Were it the
sample's one place, an edge would be as smooth as the N pairs of a place and a cell are even, which
with 16 is 5 % of the light where the penumbra is one to three pixels wide; so it is 1.5 %.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts
from ...corrmap.local_scene import LocalScene
from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import Samplers, Texture, texture_from_array
from ...scene.geometry import SceneGeometry
from ...scene.light import Light
from ..light_points.light_cells import SPOTS
from ..light_points.light_sample import EmitterPoint, LightSample
from ..light_points.turned_disk import turned_way
from ..lights.light_reach import ReachPass
from ..lights.plain_reach import PlainReach
from ..shading.picture_tiles import PictureTiles
from ..shading.shadow import ShadowKind
from .first_rays import FirstRays
from .lit_pixels import LitPixels, lit_pixels, plainly_lit_pixels
from .receivers import SeenReceivers
from .shadow_rays import LIFT, ShadowRays, shadow_rays
from .sparse_rays import HIDDEN, SEEN, look_sparsely
from .spot_looks import ALL_SPOTS, PixelPlaces, look_at_spots
from .vectors import dot

_KIND = ShadowKind("traced_shadow", (("traced_spots", "FLOAT_2D"),), spots=SPOTS)

# Of a light's only point: highlights have nothing to tell apart.
_POINT_KIND = replace(_KIND, spots=0)

# Where sheer surfaces dim the light.
_TINT_SAMPLERS: Samplers = (("traced_tint", "FLOAT_2D"),)


# As in addon/glsl/lib/traced_shadow.glsl.
_SIDE_IS_KNOWN = 1 << SPOTS

# A ray ends this share of its length before the light's point. What holds a lamp may lie exactly
# at the point; the sum of the roundings of start, direction and length is a few spacings (1.2e-7).
_SHORT_OF_LIGHT = 16.0 * float(np.finfo(np.float32).eps)

# Rays that are made at once: few enough to stay in the processor's cache, and enough that numpy's
# calls are little beside them, also for those near the terminator.
_PART = 1 << 14

# Bytes of main memory for what is known of views' samples, 85 for a pixel.
_RECEIVER_BUDGET = 512 << 20


@dataclass(frozen=True)
class TracedShadow:
    """Which pixels of one sample of a view see one point of a light.

    Attributes:
        spots: R32F, a bit for each spot of the light's cell that is seen: all where its only point
            is. With 65536 added it also tells which side is lit, by its sign: positive the
            viewer's.
        rays: how many rays it took.
        lit: the tiles in which any is seen.
        has_spots: whether it is of a cell, and spots may differ.
        tint: RGBA32F, what sheer surfaces let through of what is seen; None for all.
    """

    spots: Texture
    rays: int
    lit: PictureTiles
    has_spots: bool = True
    tint: Texture | None = None

    @property
    def kind(self) -> ShadowKind:
        """What a shader that reads it is made of."""
        kind = _KIND if self.has_spots else _POINT_KIND
        if self.tint is None:
            return kind
        return replace(kind, samplers=(*kind.samplers, *_TINT_SAMPLERS), tinted=True)

    @property
    def textures(self) -> Mapping[str, Any]:
        """By the names of `kind.samplers`."""
        if self.tint is None:
            return {"traced_spots": self.spots}
        return {"traced_spots": self.spots, "traced_tint": self.tint}

    def uniforms(self, _local_origin: NDArray[np.float64]) -> Mapping[str, Mapping[str, Any]]:
        """It has no uniform blocks."""
        return {}


# Where rays start, and to where they go from there: (3, R) each.
_Aim = tuple[NDArray[np.float64], NDArray[np.float64]]

_Rows = NDArray[np.int64] | slice


class TracedShadowPass:
    """Traces the shadows of one scene's geometry. Builds what it needs when it is first asked.

    Args:
        geometry: the scene's.
        reach: asks what lights shine on.
        scene: the geometry in the space of the surfaces, if somebody has it already.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        reach: ReachPass | None = None,
        scene: LocalScene | None = None,
    ) -> None:
        self._geometry = geometry
        self._scene = scene
        self._reach = ReachPass() if reach is None else reach
        self._seen: OrderedDict[int, SeenReceivers] = OrderedDict()

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
        sparse: bool = False,
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
            sparse: whether pixels between others that see the same of a point need no ray of their
                own, see `look_sparsely`; of a light's cell and of coarse layers all have one, and
                where sheer surfaces dim the light.
        """
        seen = self._seen_by(surface, self.local_scene(surface.origin))
        plain = PlainReach.of(light, sample, surface.origin) if objects is None else None
        stops = shadow_rays(self.local_scene(surface.origin), casters)
        # Of a shadow that is moved, only the light itself tells what it shines on.
        tells_side = seen.smooth.any and not any(light.controls.shadow.offset)
        is_point, is_whole = len(sample.spots) == 0, surface.picture_height is None and stride == 1
        sparse = sparse and is_point and is_whole and not stops.dims
        if sparse and plain is not None and sample.emitter is None:
            first = FirstRays(stops, plain, seen, _SHORT_OF_LIGHT)
            known = look_sparsely(first.reach, first.sides, seen.even)
            return _of_known(known, first.count, tells_side=tells_side)
        if plain is not None:
            lit = plainly_lit_pixels(seen, plain, stride)
        else:
            is_smooth = seen.smooth.any
            reach = self._reach.draw(surface, light, sample, stride, objects, both_sides=is_smooth)
            lit = lit_pixels(seen, reach, stride, by_normals=is_smooth)
        rays = _Rays(stops, light, sample, seen=seen, lit=lit)
        if sparse:
            known = look_sparsely(
                lambda pixel: rays.reach_point(lit.rows(pixel)), lit.sides(), seen.even
            )
            return _of_known(known, rays.count, tells_side=tells_side)
        if is_point:
            spots = np.where(rays.reach_point(), ALL_SPOTS, 0)
        else:
            row, column = np.divmod(lit.pixel, lit.size[1])
            place = PixelPlaces(row, column, lit.size, surface.picture_height)
            spots = look_at_spots(rays.reach_spots, place, thorough)
        picture = np.zeros(lit.size, dtype=np.float32)
        picture.ravel()[lit.pixel] = spots
        tiles = PictureTiles.around(picture != 0.0)
        if tells_side:
            picture.ravel()[lit.pixel] = np.copysign(spots + _SIDE_IS_KNOWN, lit.side)
        texture = texture_from_array(picture[..., None], "R32F")
        tint = rays.tint()
        if tint is not None:
            tints = np.ones((*lit.size, 4), dtype=np.float32)
            tints.reshape(-1, 4)[lit.pixel, :3] = tint
            tint = texture_from_array(tints, "RGBA32F")
        return TracedShadow(texture, rays.count, tiles, has_spots=not is_point, tint=tint)

    def local_scene(self, origin: NDArray[np.float64]) -> LocalScene:
        """What rays meet, in the space around a place (3,) of the world."""
        if self._scene is None or not np.array_equal(self._scene.origin, origin):
            self._scene = LocalScene(self._geometry, origin)
            self._seen.clear()
        return self._scene

    def _seen_by(self, surface: SurfaceBuffer, scene: LocalScene) -> SeenReceivers:
        """Kept for lights to come, by the texture of the sample's places: that stays the same where
        surfaces are edited or told their objects, and is kept, so that its id stays its own."""
        key = id(surface.position)
        if key not in self._seen:
            # Only its places' texture is held on to: the rest may be much of the GPU's memory.
            bare = replace(
                surface,
                values=(),
                objects=None,
                triangles=None,
                bend=None,
                shading_normal=None,
                through=None,
                before=(),
            )
            self._seen[key] = replace(SeenReceivers.of(surface, scene), surface=bare)
            used = sum(seen.nbytes for seen in self._seen.values())
            while used > _RECEIVER_BUDGET and len(self._seen) > 1:
                used -= self._seen.popitem(last=False)[1].nbytes
        self._seen.move_to_end(key)
        return self._seen[key]


def _of_known(known: NDArray[np.int8], rays: int, *, tells_side: bool) -> TracedShadow:
    """The shadow of a light's only point, of what `look_sparsely` found."""
    is_seen = np.abs(known) == SEEN
    values = np.array([0.0, 0.0, ALL_SPOTS], dtype=np.float32)
    if tells_side:
        values[HIDDEN:] += _SIDE_IS_KNOWN
        # A negative side counts from the end.
        values = np.concatenate([values, -values[:0:-1]])
        picture = values.take(known, mode="wrap")
    else:
        picture = values.take(np.abs(known))
    texture = texture_from_array(picture[..., None], "R32F")
    return TracedShadow(texture, rays, PictureTiles.around(is_seen), has_spots=False)


class _Rays:
    """Rays from N pixels to a light.

    Attributes:
        count: how many were sent.

    Args:
        shadow_rays: what stops them.
        light: the light.
        sample: its point or cell.
        seen: the sample of the view.
        lit: the pixels.
    """

    def __init__(
        self,
        shadow_rays: ShadowRays,
        light: Light,
        sample: LightSample,
        *,
        seen: SeenReceivers,
        lit: LitPixels,
    ) -> None:
        self._rays, self._light, self._sample = shadow_rays, light, sample
        self._seen, self._lit = seen, lit
        self.count = 0
        # What came through sheer surfaces along open rays, and how many these were.
        self._through = np.zeros((len(lit.number), 3)) if shadow_rays.dims else None
        self._opened = np.zeros(len(lit.number))

    def tint(self) -> NDArray[np.float64] | None:
        """(N, 3) the mean of what open rays brought; None where nothing was lost."""
        if self._through is None or not self._opened.any():
            return None
        mean = self._through / np.maximum(self._opened, 1.0)[:, None]
        mean[self._opened == 0.0] = 1.0
        return None if (mean == 1.0).all() else mean

    def reach_point(self, rows: NDArray[np.int64] | None = None) -> NDArray[np.bool_]:
        """(R,) whether rays of some (R,) of the N to the sample's point meet nothing; of all for
        None."""

        def aim(part: slice) -> _Aim:
            some = part if rows is None else rows[part]
            start = self._start(some)
            return self._lifted(some, start, self._way_to_point(start))

        every = np.arange(len(self._lit.number)) if rows is None else rows
        return self._open(every, aim)

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
        above = np.zeros(len(rows), dtype=np.bool_)
        around = self._seen.around
        # Found here: of the threads below each would find them for itself.
        steps = None if around is None else self._seen.steps

        def aim(part: slice) -> _Aim:
            some = rows[part]
            start = self._start(some)
            if around is not None and steps is not None:
                right, up = around.take(spots[part], axis=0).T
                along = steps.take(self._lit.number[some], axis=2)
                start += right * along[0] + up * along[1]
            way = self._way_to_spots(start, spots[part])
            side = self._seen.smooth.side(self._lit.number[some], way)
            above[part] = side == self._lit.side[some]
            return self._lifted(some, start, way)

        is_open = self._open(rows, aim, above)
        return is_open & above, above

    def _start(self, rows: _Rows) -> NDArray[np.float64]:
        """(3, R) where rays of some of the pixels start, but for lifts near the terminator."""
        return self._seen.receivers.starts(self._lit.number[rows], self._lit.side[rows])

    def _lifted(self, rows: _Rows, start: NDArray[np.float64], way: NDArray[np.float64]) -> _Aim:
        """Where rays start near the terminator, and where they go from there to the same place."""
        if not self._seen.smooth.any:
            return start, way
        number, side = self._lit.number[rows], self._lit.side[rows]
        some, lift = self._seen.smooth.lift(number, _unit(way), side)
        start[:, some] += lift
        if self._light.type != "SUN":
            way[:, some] -= lift
        return start, way

    def _way_to_point(self, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, R) from (3, R) places to the sample's point."""
        on_disk = self._sample.on_disk
        if self._sample.per_receiver and on_disk is not None:
            from_centre = start.T - (self._light.position - self._seen.surface.origin)
            place = np.broadcast_to(on_disk, (start.shape[1], 2))
            return np.ascontiguousarray(turned_way(self._light, from_centre, place).T)
        position = self._sample.position[:, None]
        if self._light.type == "SUN":
            return np.repeat(position, start.shape[1], axis=1)
        return np.asarray(position - self._seen.surface.origin[:, None] - start)

    def _way_to_spots(
        self, start: NDArray[np.float64], spots: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """(3, R) from (3, R) places to a spot (R,) each."""
        places, origin = self._sample.spots, self._seen.surface.origin
        if self._sample.per_receiver:
            from_centre = start.T - (self._light.position - origin)
            return np.ascontiguousarray(turned_way(self._light, from_centre, places[spots, :2]).T)
        if self._light.type != "SUN":
            places = places - origin
        way = np.ascontiguousarray(places.T).take(spots, axis=1)
        return way if self._light.type == "SUN" else way - start

    def _open(
        self,
        rows: NDArray[np.int64],
        aim: Callable[[slice], _Aim],
        chosen: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.bool_]:
        """(R,) whether a ray of each of some pixels meets nothing that stops it, of those that are
        chosen (R,) once they were aimed."""
        count = len(rows)
        is_open = np.zeros(count, dtype=np.bool_)
        through = None if self._through is None else np.zeros((count, 3))

        def work(part: slice) -> None:
            start, way = aim(part)
            some = slice(None) if chosen is None else np.flatnonzero(chosen[part])
            found, dimmed = self._meets_nothing(start[:, some], way[:, some])
            self._seen.close_buried(self._rays, self._lit.number[rows[part][some]], found)
            is_open[part][some] = found
            if through is not None and dimmed is not None:
                through[part][some] = dimmed * found[:, None]

        in_parts(work, count, _PART)
        if through is not None and self._through is not None:
            # A pixel may have sent several.
            pixels = len(self._opened)
            for channel in range(3):
                self._through[:, channel] += np.bincount(rows, through[:, channel], pixels)
            self._opened += np.bincount(rows, is_open, pixels)
        self.count += count if chosen is None else int(np.count_nonzero(chosen))
        return is_open

    def _meets_nothing(
        self, start: NDArray[np.float64], way: NDArray[np.float64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64] | None]:
        """(R,) whether rays are open, and (R, 3) what comes through, 0 of others; None for all."""
        if self._light.type == "SUN":
            return self._comes_through(start.T, way.T, np.full(way.shape[1], np.inf))
        length = np.sqrt(dot(way, way))
        limit = length * (1.0 - _SHORT_OF_LIGHT)
        emitter = self._sample.emitter
        if emitter is not None:
            short = _before_emitter(emitter, start.T + self._seen.surface.origin, way.T)
            limit = np.maximum(limit - short, 0.0)
        direction = way / np.where(length > 0.0, length, 1.0)
        return self._comes_through(start.T, direction.T, limit)

    def _comes_through(
        self,
        start: NDArray[np.float64],
        direction: NDArray[np.float64],
        limit: NDArray[np.float64],
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64] | None]:
        is_open = ~self._rays.blocked(start, direction, limit)
        if self._through is None:
            return is_open, None
        through = np.zeros((len(is_open), 3))
        some = np.flatnonzero(is_open)
        through[some] = self._rays.through(start[some], direction[some], limit[some])
        # What lets nothing through stops the ray.
        return through.any(axis=1), through


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, N) of length one; zeros stay."""
    length = np.sqrt(dot(vectors, vectors))
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


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
