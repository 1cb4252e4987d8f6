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
        row: (N,) in the layer.
        column: (N,) likewise.
        number: (N,) which receivers of the view's sample they are.
        way: (N, 3) as of `ReachPass.draw`.
        side: (N,) the side that is lit: 1 the viewer's, -1 the other.
    """

    row: NDArray[np.int64]
    column: NDArray[np.int64]
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
    surface = seen.surface
    row, column = np.nonzero(reach[..., 3])
    number = seen.number[_texel(row, stride, surface.height), _texel(column, stride, surface.width)]
    way = reach[row, column]
    lit = LitPixels(row, column, number, way[:, :3], np.sign(way[:, 3]))
    if not by_normals:
        return lit
    side = seen.smooth.side(number, lit.way)
    # What does not stand in its own light is lit whatever side its facets say.
    wanted = (side > 0.0) | (np.abs(way[:, 3]) > 1.0)
    if surface.layout.has("HAS_TRANSLUCENT"):
        wanted |= side < 0.0
    some = np.flatnonzero(wanted)
    return LitPixels(row[some], column[some], number[some], lit.way[some], side[some])


def _texel(pixel: NDArray[np.int64], stride: int, size: int) -> NDArray[np.int64]:
    """As `surface_texel` in addon/glsl/lib/surface_texel.glsl, along one side."""
    return np.minimum(pixel * stride + stride // 2, size - 1)
