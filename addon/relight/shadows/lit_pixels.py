# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels a light's point may reach, and on which side of what they see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts
from ..lights.plain_reach import PlainReach
from .receivers import SeenReceivers
from .vectors import dot

# Pixels at once: what numpy makes of them stays in the processor's cache.
_PART = 1 << 14


@dataclass(frozen=True)
class LitPixels:
    """Pixels that a light may reach.

    Attributes:
        size: (rows, columns) of the layer.
        pixel: (N,) in the layer, row by row.
        number: (N,) which receivers of the view's sample they are.
        side: (N,) float32, the side that is lit: 1 the viewer's, -1 the other.
    """

    size: tuple[int, int]
    pixel: NDArray[np.int64]
    number: NDArray[np.int32]
    side: NDArray[np.float32]

    def sides(self) -> NDArray[np.int8]:
        """(rows, columns) the side of each pixel of the layer; 0 where none is lit."""
        sides = np.zeros(self.size, dtype=np.int8)
        sides.ravel()[self.pixel] = self.side
        return sides

    def rows(self, pixel: NDArray[np.int64]) -> NDArray[np.int64]:
        """(R,) which of the N some lit pixels (R,) of the layer are."""
        return np.searchsorted(self.pixel, pixel)


def lit_pixels(
    seen: SeenReceivers, reach: NDArray[np.float32], stride: int, *, by_normals: bool
) -> LitPixels:
    """What a light reaches, as `ReachPass.draw` gave it.

    Args:
        seen: the sample of the view.
        reach: (H, W, 4), of both sides where the normals tell.
        stride: the surface's pixels along the side of one of the layer's.
        by_normals: whether interpolated normals tell the side.
    """
    rows, columns = reach.shape[:2]
    pixel = np.flatnonzero(reach[..., 3])
    number = _numbers(seen, stride).ravel().take(pixel)
    way = np.ascontiguousarray(reach.reshape(-1, 4).take(pixel, axis=0).T)
    side, direction = np.sign(way[3]), way[:3]
    if not by_normals:
        return LitPixels((rows, columns), pixel, number, side)
    side = seen.smooth.side(number, direction)
    # What does not stand in its own light is lit whatever side its facets say.
    wanted = (side > 0.0) | (np.abs(way[3]) > 1.0)
    if seen.surface.layout.has("HAS_TRANSLUCENT"):
        wanted |= side < 0.0
    some = np.flatnonzero(wanted)
    return LitPixels((rows, columns), pixel[some], number[some], side[some])


def plainly_lit_pixels(seen: SeenReceivers, reach: PlainReach, stride: int) -> LitPixels:
    """The same without the GPU.

    Args:
        seen: the sample of the view.
        reach: of the light's point.
        stride: the surface's pixels along the side of one of the layer's.
    """
    numbers, hit = _numbers(seen, stride), _strided(seen.hit, stride).ravel()
    number = numbers.ravel()
    through = seen.surface.layout.has("HAS_TRANSLUCENT")
    sides = np.zeros(len(number), dtype=np.float32)
    place, normal = seen.receivers.place, seen.smooth.normal
    # Then receivers are pixels.
    direct = place.shape[1] == len(number)

    def work(part: slice) -> None:
        if direct:
            own, facing = place[:, part], normal[:, part]
        else:
            some = number[part]
            own = place.take(some, axis=1, mode="clip")
            facing = normal.take(some, axis=1, mode="clip")
        way = reach.way(own)
        side = np.sign(dot(facing, way)).astype(np.float32)
        side *= reach.shines(way) & hit[part]
        sides[part] = side if through else np.maximum(side, 0.0)

    if place.shape[1]:
        in_parts(work, len(number), _PART)
    pixel = np.flatnonzero(sides)
    rows, columns = numbers.shape
    return LitPixels((rows, columns), pixel, number.take(pixel), sides.take(pixel))


def _numbers(seen: SeenReceivers, stride: int) -> NDArray[np.int32]:
    """Which receivers a layer's pixels are."""
    return np.asarray(_strided(seen.number, stride))


def _strided(values: NDArray[Any], stride: int) -> NDArray[Any]:
    """What a layer of (H, W) pixels reads of."""
    if stride == 1:
        return values
    rows, columns = (_texels(-(-size // stride), size, stride) for size in values.shape)
    return values[np.ix_(rows, columns)]


def _texels(pixels: int, size: int, stride: int) -> NDArray[np.int64]:
    """What so many pixels along a side read of `size` texels, as `surface_texel` in
    addon/glsl/lib/surface_texel.glsl."""
    return np.minimum(np.arange(pixels) * stride + stride // 2, size - 1)
