# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pass may ask of a triangle by its number: its plane, material and object.

Held once for each triangle and read once for each pixel, it costs a third of what the same values
cost as attributes of the three corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import empty_rows, upload_rows
from ..glsl.shader import Samplers, Texture
from ..scene.geometry import PART, SceneGeometry

TABLE_SAMPLERS: Samplers = (("triangle_plane", "FLOAT_2D"), ("triangle_ids", "FLOAT_2D"))


@dataclass(frozen=True)
class TriangleTable:
    """Textures with a texel for each triangle, in the rows of `row_texture`.

    Attributes:
        plane: RGBA32F, xyz unit normal by the corners' winding, w its product with any point of
            the plane, metres, both in the space of the vertices.
        ids: RG32F, 1 + material id and 1 + object id (exact below 2^24).
    """

    plane: Texture
    ids: Texture

    @classmethod
    def upload(
        cls, geometry: SceneGeometry, order: NDArray[np.int64], origin: NDArray[np.float64]
    ) -> TriangleTable:
        """The table of a geometry's triangles in an order (T,) of their own, relative to `origin`
        (3,), world space."""
        count = len(order)
        plane, ids = (empty_rows(count, size, "triangles") for size in (4, 2))
        for start in range(0, count, PART):
            end = min(start + PART, count)
            some = order[start:end]
            normal = geometry.normal_of(some)
            corner = geometry.vertices[geometry.triangles[some, 0]] - origin
            plane[start:end, :3] = normal
            plane[start:end, 3] = np.einsum("tx,tx->t", normal, corner)
            ids[start:end, 0] = geometry.material_id[some]
            ids[start:end, 1] = geometry.object_id[some]
        ids += 1.0
        return cls(upload_rows(plane, "RGBA32F"), upload_rows(ids, "RG32F"))

    def textures(self) -> dict[str, Texture]:
        """By the names in `TABLE_SAMPLERS`."""
        return {"triangle_plane": self.plane, "triangle_ids": self.ids}
