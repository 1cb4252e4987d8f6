# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels a light's point may reach, and on which side of what they see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .receivers import SeenReceivers


@dataclass(frozen=True)
class LitPixels:
    """Pixels that a light may reach.

    Attributes:
        pixel: (N,) in the layer, row by row.
        number: (N,) which receivers of the view's sample they are.
        way: (3, N) as of `ReachPass.draw`.
        side: (N,) the side that is lit: 1 the viewer's, -1 the other.
    """

    pixel: NDArray[np.int64]
    number: NDArray[np.int32]
    way: NDArray[np.float32]
    side: NDArray[np.float32]


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
    pixel = np.flatnonzero(reach[..., 3])
    numbers = seen.number
    if stride > 1:
        sides = zip(reach.shape[:2], numbers.shape, strict=True)
        numbers = numbers[np.ix_(*(_texels(*side, stride) for side in sides))]
    number = numbers.ravel().take(pixel)
    way = np.ascontiguousarray(reach.reshape(-1, 4).take(pixel, axis=0).T)
    lit = LitPixels(pixel, number, way[:3], np.sign(way[3]))
    if not by_normals:
        return lit
    side = seen.smooth.side(number, lit.way)
    # What does not stand in its own light is lit whatever side its facets say.
    wanted = (side > 0.0) | (np.abs(way[3]) > 1.0)
    if seen.surface.layout.has("HAS_TRANSLUCENT"):
        wanted |= side < 0.0
    some = np.flatnonzero(wanted)
    return LitPixels(pixel[some], number[some], lit.way.take(some, axis=1), side[some])


def _texels(pixels: int, size: int, stride: int) -> NDArray[np.int64]:
    """What so many pixels along a side read of `size` texels, as `surface_texel` in
    addon/glsl/lib/surface_texel.glsl."""
    return np.minimum(np.arange(pixels) * stride + stride // 2, size - 1)
