# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pass may ask of a triangle's corners by its number: their normals for shading, and how
much each of them counts at a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import row_texture
from ..glsl.shader import Samplers, Texture

CORNER_SAMPLERS: Samplers = (
    ("corner_normals_ab", "FLOAT_2D"),
    ("corner_normal_c", "FLOAT_2D"),
    ("corner_share_b", "FLOAT_2D"),
    ("corner_share_c", "FLOAT_2D"),
)

# What a sampler gives of the largest code.
_LARGEST_CODE = np.float32(65535.0)

# For messages.
_CORNERS = "triangles' corners"


@dataclass(frozen=True)
class CornerNormalTable:
    """Textures with a texel for each triangle, row by row as in `TriangleTable`; 44 bytes each.

    Attributes:
        first: RGBA16, the unit normals of its first two corners, two octahedral codes each.
        last: RG16, that of the third.
        share_b, share_c: RGBA32F, what its second and third corner count at a place p in its plane
            is xyz . p + w, p in metres in the space of the vertices.
    """

    first: Texture
    last: Texture
    share_b: Texture
    share_c: Texture

    @classmethod
    def upload(
        cls,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32],
        normal: NDArray[np.float64],
        codes: NDArray[np.uint16],
    ) -> CornerNormalTable:
        """From (V, 3) vertices, (T, 3) triangles in the order of their numbers, (T, 3) their unit
        normals and (T, 3, 2) `SceneGeometry.corner_normals`."""
        count = len(triangles)
        a, b, c = (vertices[corner] for corner in triangles.T)
        # The gradient of a corner's share stands on the edge across from it, and reaches 1 there.
        to_b, to_c = np.cross(c - a, normal), np.cross(normal, b - a)
        doubled = np.einsum("tx,tx->t", to_b, b - a)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = [np.nan_to_num(toward / doubled, posinf=0.0, neginf=0.0)
                      for toward in (to_b, to_c)]  # fmt: skip
        texels = [
            np.concatenate([share, -np.einsum("tx,tx->t", share, a)[:, None]], axis=1)
            for share in shares
        ]
        normals = (codes.reshape(count, 6) / _LARGEST_CODE).astype(np.float32)
        return cls(
            row_texture(normals[:, :4], "RGBA16", _CORNERS),
            row_texture(normals[:, 4:], "RG16", _CORNERS),
            *(row_texture(texel, "RGBA32F", _CORNERS) for texel in texels),
        )

    def textures(self) -> dict[str, Texture]:
        """By the names in `CORNER_SAMPLERS`."""
        textures = (self.first, self.last, self.share_b, self.share_c)
        return {name: t for (name, _), t in zip(CORNER_SAMPLERS, textures, strict=True)}
