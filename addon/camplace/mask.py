# SPDX-License-Identifier: GPL-3.0-or-later
"""Where cut-out materials are there and where they are cut away."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry

EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")


class Mask:
    """The alpha masks of a geometry's materials, side by side in one array.

    One look-up then serves rays that met any mixture of materials.
    """

    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        cutouts = geometry.cutouts if geometry.uv is not None else ()
        materials = int(geometry.material_id.max(initial=0)) + 1
        self._slot = np.full(materials, -1, dtype=np.int64)
        for slot, cutout in enumerate(cutouts):
            if cutout.material_id < materials:
                self._slot[cutout.material_id] = slot
        self._size = np.array([cutout.alpha.shape[::-1] for cutout in cutouts]).reshape(-1, 2)
        self._start = np.cumsum([0, *(cutout.alpha.size for cutout in cutouts)])
        self._extension = np.array([EXTENSIONS.index(c.extension) for c in cutouts], np.int64)
        self._there = np.concatenate(
            [np.zeros(0, np.bool_), *(cutout.alpha.ravel() >= 0.5 for cutout in cutouts)]
        )

    @property
    def masked(self) -> NDArray[np.bool_]:
        """(T,) which triangles have a mask."""
        return np.asarray(self._slot[self._geometry.material_id] >= 0)

    def opaque_at(
        self, triangle: NDArray[np.int64], barycentric: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(R,) whether the surface is there, by the nearest texel.

        Args:
            triangle: (R,) masked triangles.
            barycentric: (R, 2), the weights of corners 1 and 2.
        """
        assert self._geometry.uv is not None
        corner = self._geometry.uv[triangle].astype(np.float64)
        u, v = barycentric[:, :1], barycentric[:, 1:]
        uv = (1.0 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
        slot = self._slot[self._geometry.material_id[triangle]]
        way = self._extension[slot][:, None]
        clipped = (way == EXTENSIONS.index("CLIP")) & ((uv < 0.0) | (uv >= 1.0))
        uv = np.where(way == EXTENSIONS.index("REPEAT"), uv - np.floor(uv), uv)
        mirrored = 1.0 - np.abs(np.mod(uv, 2.0) - 1.0)
        uv = np.where(way == EXTENSIONS.index("MIRROR"), mirrored, uv)
        size = self._size[slot]
        column, row = np.clip(np.floor(uv * size).astype(np.int64), 0, size - 1).T
        there = self._there[self._start[slot] + row * size[:, 0] + column]
        return np.asarray(there & ~clipped.any(axis=-1))
