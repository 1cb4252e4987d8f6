# SPDX-License-Identifier: GPL-3.0-or-later
"""Which triangle each pixel sees, for those who need to know on the processor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture, read_texture
from .triangle_table import TABLE_WIDTH


@dataclass(frozen=True)
class SeenTriangles:
    """The triangles of one sample of a view.

    Attributes:
        texture: RG32F, as `VisibleSurface.triangles`.
        scene_triangle: (T,) the geometry's own number by that of the `GeometryBuffer`.
    """

    texture: Texture
    scene_triangle: NDArray[np.int64]

    def read(self) -> NDArray[np.int64]:
        """(H, W) each pixel's triangle by its number in the geometry, -1 for nothing."""
        number = triangle_numbers(self.texture)
        return np.where(number >= 0, self.scene_triangle[number], -1)


def triangle_numbers(texture: Texture) -> NDArray[np.int64]:
    """(H, W) what is drawn as `VisibleSurface.triangles`: numbers in the `GeometryBuffer`, -1 for
    nothing."""
    high, low = np.moveaxis(read_texture(texture).astype(np.int64), -1, 0)
    return np.asarray(np.where(high > 0, (high - 1) * TABLE_WIDTH + low, -1))
