# SPDX-License-Identifier: GPL-3.0-or-later
"""One evaluated object's triangles, in its own space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Object types whose evaluated form is, or can be turned into, a mesh.
MESH_TYPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


@dataclass(frozen=True)
class MeshArrays:
    """A triangulated mesh.

    Attributes:
        vertices: (V, 3) float64, object space.
        triangles: (T, 3) int32.
        slot: (T,) int32, material slot.
        uv: (T, 3, 2) float32 of each UV map by name.
        active_uv: the map that renders use, "" without one.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    slot: NDArray[np.int32]
    uv: dict[str, NDArray[np.float32]]
    active_uv: str


def read_mesh(evaluated: Any) -> MeshArrays | None:
    """The triangles of an evaluated object; None when it has none."""
    mesh = evaluated.to_mesh()
    if mesh is None:
        return None
    try:
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        if not count:
            return None
        vertices = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertices.foreach_get("co", vertices)
        triangles = np.empty(count * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        slot = np.empty(count, dtype=np.int32)
        mesh.loop_triangles.foreach_get("material_index", slot)
        loops = np.empty(count * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        uv: dict[str, NDArray[np.float32]] = {}
        active = ""
        for layer in mesh.uv_layers:
            values = np.empty(len(mesh.loops) * 2, dtype=np.float32)
            layer.uv.foreach_get("vector", values)
            uv[layer.name] = values.reshape(-1, 2)[loops].reshape(count, 3, 2)
            if layer.active_render:
                active = layer.name
        return MeshArrays(
            vertices.reshape(-1, 3).astype(np.float64), triangles.reshape(-1, 3), slot, uv, active
        )
    finally:
        evaluated.to_mesh_clear()
