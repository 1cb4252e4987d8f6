# SPDX-License-Identifier: GPL-3.0-or-later
"""Which triangle each pixel sees, for those who need to know on the processor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture, read_texture
from .triangle_codes import TriangleCodes


@dataclass(frozen=True)
class RayHits:
    """Where the rays of N pixels, row by row, met the triangles.

    Attributes:
        triangle: (N,) int32 which by its number in the geometry, -1 for none.
        place: (3, N) float32 where, local space; anywhere for none.
        shaded: (3, N) float32, unit: the normals there for shading, facing the viewer; None where
            nobody found them.
    """

    triangle: NDArray[np.int32]
    place: NDArray[np.float32]
    shaded: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class SeenTriangles:
    """The triangles of one sample of a view.

    Attributes:
        texture: RG32F, as `VisibleSurface.triangles`.
        codes: what these stand for.
        hits: the same and more, where it was found by rays: then nothing has to be read back.
    """

    texture: Texture
    codes: TriangleCodes
    hits: RayHits | None = None

    def read(self) -> NDArray[np.int64]:
        """(H, W) each pixel's triangle by its number in the geometry, -1 for nothing."""
        if self.hits is not None:
            found = self.hits.triangle.reshape(self.texture.height, self.texture.width)
            return found.astype(np.int64)
        return self.codes.decode(read_texture(self.texture))
