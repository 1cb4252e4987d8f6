# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that stand in a scene many times, for those who keep each of them once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# A smaller mesh is not worth a draw call of its own for each place where it stands, nor the tests
# of each place against the picture.
LEAST_TRIANGLES = 256

# Nor is one of which so few triangles need not be kept again.
LEAST_SPARED_OF_MESH = 1 << 14

# Of all meshes together: 230 megabytes of the GPU's memory. With less at stake, triangles of their
# own are drawn and read a little faster.
LEAST_SPARED = 1 << 21

# Directions of a mesh's axes that come nearer together than this cosine lose digits when what is
# given along them is added up in float32; and so do sizes beyond these.
_MOST_SHEAR = 0.5
_SIZES = (1e-9, 1e9)


@dataclass(frozen=True)
class MeshCopies:
    """One mesh and where it stands.

    The triangles of a `SceneGeometry` hold all copies too: triangle t of copy n is triangle
    `first[n] + t` of these, its corners the other way round where the copy is mirrored.

    Attributes:
        vertices: (V, 3) float32, metres, mesh space: just as Blender has them.
        triangles: (T, 3) int32, indices into `vertices`.
        material_id: (T,) int32, index into `SceneGeometry.material_names`.
        camera_visible, shadow_visible: as of a `SceneGeometry`, of all its triangles.
        world_from_mesh: (N, 4, 4) float64.
        first: (N,) int64, ascending: the first triangle of each copy in the scene.
        object_id: (N,) int32, index into `SceneGeometry.object_names`.
        uv: (T, 3, 2) float32, if the scene has them.
        corner_normals: (T, 3, 2) uint16 codes of unit normals, mesh space, if the scene has them.
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    material_id: NDArray[np.int32]
    camera_visible: bool
    shadow_visible: bool
    world_from_mesh: NDArray[np.float64]
    first: NDArray[np.int64]
    object_id: NDArray[np.int32]
    uv: NDArray[np.float32] | None = None
    corner_normals: NDArray[np.uint16] | None = None

    def __len__(self) -> int:
        return len(self.first)

    @property
    def spared(self) -> int:
        """Triangles that need not be kept again."""
        return (len(self) - 1) * len(self.triangles)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """(T, 3, 3) mesh space."""
        return self.vertices[self.triangles].astype(np.float64)

    @cached_property
    def normal(self) -> NDArray[np.float64]:
        """(T, 3) unit, mesh space, by the corners' winding."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        cross = np.cross(b - a, c - a)
        return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))


def keeps_digits(world_from_mesh: NDArray[np.float64]) -> bool:
    """Whether what is kept in mesh space loses no digits on its way to world space in float32."""
    axes = world_from_mesh[:3, :3]
    size = np.linalg.norm(axes, axis=0)
    if (
        not np.isfinite(world_from_mesh).all()
        or not ((size > _SIZES[0]) & (size < _SIZES[1])).all()
    ):
        return False
    cosines = (axes / size).T @ (axes / size) - np.eye(3)
    return bool(np.abs(cosines).max() < _MOST_SHEAR)
