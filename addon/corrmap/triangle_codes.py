# SPDX-License-Identifier: GPL-3.0-or-later
"""How the GPU tells triangles apart: two float32 numbers for each, and 0, 0 for nothing.

Triangle n of those that are there once is 1 + n / 4096 rounded down, and the rest. Triangle t of
the repeated meshes, seen at instance i, is -1 - i and t.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_BITS, ROW_WIDTH


@dataclass(frozen=True)
class TriangleCodes:
    """The codes of a scene's triangles.

    Attributes:
        alone: (F,) int64, the scene's triangle by the number of one that is there once.
        first: (I,) int64, the scene's triangle that is triangle 0 of an instance's mesh.
        mesh_triangle: (M,) int64, by the number t of a mesh's triangle which of its mesh it is.
        meshes: (first instance, instances, first t, triangles) of each mesh.
    """

    alone: NDArray[np.int64]
    first: NDArray[np.int64]
    mesh_triangle: NDArray[np.int64]
    meshes: tuple[tuple[int, int, int, int], ...] = ()

    @classmethod
    def of_all(cls, count: int) -> TriangleCodes:
        """Of triangles that are all there once, in the scene's order."""
        none = np.zeros(0, dtype=np.int64)
        return cls(np.arange(count), none, none)

    def decode(self, codes: NDArray[np.float32]) -> NDArray[np.int64]:
        """(...) the scene's triangles by (..., 2) codes, -1 for nothing."""
        high, low = np.moveaxis(codes.astype(np.int64), -1, 0)
        result = np.full(high.shape, -1, dtype=np.int64)
        alone, instanced = high > 0, high < 0
        result[alone] = self.alone[(high[alone] - 1) * ROW_WIDTH + low[alone]]
        if instanced.any():
            result[instanced] = (
                self.first[-1 - high[instanced]] + self.mesh_triangle[low[instanced]]
            )
        return result

    def encode(self, triangle: NDArray[np.integer]) -> NDArray[np.float32]:
        """(N, 2) the codes of (N,) triangles of the scene; negative ones are nothing."""
        return self._codes.take(np.maximum(triangle, -1), axis=0)

    @cached_property
    def _count(self) -> NDArray[np.int64]:
        """(I,) triangles of each instance."""
        return np.repeat([m[3] for m in self.meshes], [m[1] for m in self.meshes]).astype(np.int64)

    @cached_property
    def _codes(self) -> NDArray[np.float32]:
        """(T + 1, 2) the codes by the scene's triangle, and of nothing."""
        total = len(self.alone) + int(self._count.sum())
        codes = np.zeros((total + 1, 2), dtype=np.float32)
        number = np.arange(len(self.alone))
        codes[self.alone, 0] = (number >> ROW_BITS) + 1
        codes[self.alone, 1] = number & (ROW_WIDTH - 1)
        for first_instance, instances, start, count in self.meshes:
            low = np.empty(count, dtype=np.float32)
            low[self.mesh_triangle[start : start + count]] = np.arange(start, start + count)
            for instance in range(first_instance, first_instance + instances):
                first = self.first[instance]
                codes[first : first + count] = np.stack([np.full(count, -1 - instance), low], 1)
        return codes
