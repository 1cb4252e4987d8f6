# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's triangles for rays: in the space of what is rasterized, in trees of embree."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camplace.embree_mesh import EmbreeMesh
from ..camplace.mask import Mask
from ..camplace.parallel import in_parts
from ..scene.coincident import Coincident
from ..scene.geometry import PART, SceneGeometry

# Above a rounding to float32.
_ROUNDED_UP = 1.0 + 1e-6


@dataclass(frozen=True)
class TrianglePlanes:
    """The planes of triangles, in the space of their vertices.

    Attributes:
        normal: (T, 3) float32, unit; zero of a triangle that has none.
        offset: (T,) float64, metres: its product with any point of the plane.
        extent: (T,) float32, metres: the largest component of its edges, or a little more.
    """

    normal: NDArray[np.float32]
    offset: NDArray[np.float64]
    extent: NDArray[np.float32]

    @classmethod
    def of(cls, geometry: SceneGeometry) -> TrianglePlanes:
        """Of all triangles."""
        count = len(geometry)
        normal = np.empty((count, 3), dtype=np.float32)
        offset, extent = np.empty(count), np.empty(count, dtype=np.float32)

        def work(part: slice) -> None:
            normal[part] = geometry.normal_of(part)
            a, b, c = (geometry.vertices[geometry.triangles[part, k]] for k in range(3))
            # Of the normal as it is kept, so that its rounding counts from this corner only.
            offset[part] = np.einsum("tx,tx->t", normal[part].astype(np.float64), a)
            longest = np.maximum(np.maximum(np.abs(b - a), np.abs(c - b)), np.abs(a - c))
            extent[part] = longest.max(axis=1) * _ROUNDED_UP

        in_parts(work, count, PART)
        return cls(normal, offset, extent)


class LocalScene:
    """A scene's triangles in a local space, and embree's trees of some of them.

    The triangles' corners are made relative to `origin` in float64 and then rounded to float32,
    as for the GPU, so that what is rasterized and what is traced is the same surface, and a scene
    far from the world's origin keeps its precision.

    Attributes:
        geometry: in local space.
        origin: (3,) float64, world space: where local space has its origin.
        made: what others made of it, by names of theirs; it goes with the scene.
    """

    made: dict[Hashable, Any]

    def __init__(self, geometry: SceneGeometry, origin: NDArray[np.float64]) -> None:
        local = (geometry.vertices - origin).astype(np.float32).astype(np.float64)
        self.geometry = replace(geometry, vertices=local, copies=())
        self.origin = origin
        self._world = geometry
        self._meshes: dict[bytes, EmbreeMesh] = {}
        self.made = {}

    def mesh(self, chosen: NDArray[np.bool_]) -> EmbreeMesh:
        """The tree of some triangles (T,), built when it is first asked for."""
        key = digest(chosen)
        if key not in self._meshes:
            self._meshes[key] = EmbreeMesh(self.geometry, chosen)
        return self._meshes[key]

    @cached_property
    def planes(self) -> TrianglePlanes:
        """Of the triangles; made when they are first asked for."""
        return TrianglePlanes.of(self.geometry)

    @property
    def coincident(self) -> Coincident:
        """Of the triangles where they stand in the world, whose roundings are others than here;
        found once."""
        return self._world.coincident

    def has_mesh(self, chosen: NDArray[np.bool_]) -> bool:
        """Whether the tree of some triangles (T,) is there already."""
        return digest(chosen) in self._meshes

    @cached_property
    def cut(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(T,), (T,) which triangles are cut away all over, and which in parts or perhaps."""
        mask = Mask(self.geometry, with_sheer=False)
        there, away = mask.uniform
        return away, mask.masked & ~there & ~away


def digest(chosen: NDArray[np.bool_]) -> bytes:
    """Tells sets of triangles (T,) apart."""
    return hashlib.blake2b(np.packbits(chosen).tobytes(), digest_size=16).digest()
