# SPDX-License-Identifier: GPL-3.0-or-later
"""Where cut-out materials are there and where they are cut away."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry

# Triangles looked at together: few enough that what is known of them stays in a processor's cache.
PART = 16384
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")


class Mask:
    """The alpha masks of a geometry's materials, side by side in one array.

    One look-up then serves rays that met any mixture of materials. What light passes through in
    part is there where at most half of it passes, or all over if it is not `with_sheer`.
    """

    def __init__(self, geometry: SceneGeometry, *, with_sheer: bool = True) -> None:
        self._geometry = geometry
        cutouts = geometry.cutouts if geometry.uv is not None else ()
        if with_sheer and geometry.uv is not None:
            cutouts = (*cutouts, *(sheer.at_half for sheer in geometry.sheers))
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

    @cached_property
    def uniform(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(T,), (T,) which masked triangles are surely there, and surely cut away, all over.

        Rays then need not ask where they met one. Counted are the texels of the rectangle about
        the triangle's uv and one more on each side, which is far more than rounding can move a
        point; where that rectangle is not within the picture, nothing is sure.
        """
        there = np.zeros(len(self._geometry), dtype=np.bool_)
        away = there.copy()
        masked = np.flatnonzero(self.masked)
        slot = self._slot[self._geometry.material_id[masked]]
        for number in range(len(self._size)):
            triangle = masked[slot == number]
            for start in range(0, len(triangle), PART):
                some = triangle[start : start + PART]
                there[some], away[some] = self._uniform_in(number, some)
        return there, away

    def _uniform_in(
        self, number: int, triangle: NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """`uniform` for some triangles (N,) of the cut-out `number`."""
        assert self._geometry.uv is not None
        uv = self._geometry.uv[triangle].astype(np.float64)
        low, high = uv.min(axis=1), uv.max(axis=1)
        if self._extension[number] == EXTENSIONS.index("REPEAT"):
            tile = np.floor(low)
            low, high = low - tile, high - tile
        sure = ((low >= 0.0) & (high < 1.0)).all(axis=-1)
        size = self._size[number]
        first = np.clip(np.where(sure[:, None], low, 0.0) * size - 1.0, 0, size - 1)
        last = np.clip(np.where(sure[:, None], high, 0.0) * size + 1.0, 0, size - 1)
        left, bottom = first.astype(np.int64).T
        right, top = last.astype(np.int64).T + 1
        total = self._totals[number]
        there = total[top, right] - total[bottom, right] - total[top, left] + total[bottom, left]
        return (
            sure & (there == (right - left) * (top - bottom)),
            sure & (there == 0),
        )

    @cached_property
    def _totals(self) -> list[NDArray[np.int32]]:
        """For each cut-out (H + 1, W + 1): texels that are there below and left of each corner."""
        totals = []
        for (width, height), start in zip(self._size.tolist(), self._start.tolist(), strict=False):
            total = np.zeros((height + 1, width + 1), dtype=np.int32)
            there = self._there[start : start + width * height].reshape(height, width)
            np.cumsum(there, axis=0, out=total[1:, 1:])
            np.cumsum(total[1:, 1:], axis=1, out=total[1:, 1:])
            totals.append(total)
        return totals

    def there(self, point: NDArray[np.float64], triangle: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) whether there is surface at points (N, 3) of triangles (N,), masked or not."""
        result = np.ones(len(triangle), dtype=np.bool_)
        masked = np.flatnonzero(self._slot[self._geometry.material_id[triangle]] >= 0)
        if not masked.size:
            return result
        triangle = triangle[masked]
        corners = self._geometry.vertices[self._geometry.triangles[triangle]]
        u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        offset = point[masked] - corners[:, 0]
        uu, uv, vv = (np.einsum("nx,nx->n", *pair) for pair in ((u, u), (u, v), (v, v)))
        along_u, along_v = np.einsum("nx,nx->n", offset, u), np.einsum("nx,nx->n", offset, v)
        squared = np.maximum(uu * vv - uv * uv, np.finfo(np.float64).tiny)
        weights = np.stack([vv * along_u - uv * along_v, uu * along_v - uv * along_u], axis=-1)
        result[masked] = self.opaque_at(triangle, weights / squared[:, None])
        return result

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
