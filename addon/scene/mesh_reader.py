# SPDX-License-Identifier: GPL-3.0-or-later
"""One evaluated object's triangles, in its own space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .surface_state_reader import mesh_state

# Object types whose evaluated form is, or can be turned into, a mesh.
MESH_TYPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}

# How much the artist cares, 0 to 1: a custom property of objects and materials, a vertex group,
# or a mesh attribute.
WEIGHT_NAME = "relume_weight"


@dataclass(frozen=True)
class MeshArrays:
    """A triangulated mesh.

    Attributes:
        vertices: (V, 3) float64, object space.
        triangles: (T, 3) int32.
        slot: (T,) int32, material slot.
        uv: (T, 3, 2) float32 of each UV map by name.
        active_uv: the map that renders use, "" without one.
        weight: (T,) float32 in [0, 1], the mean over each triangle's corners of the vertex group
            or attribute WEIGHT_NAME; None without one.
        state: digest of what its materials can read of it (`surface_state_reader`).
        corner_normals: (T, 3, 3) float32 unit normals that are interpolated for shading; None
            where every face is flat.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    slot: NDArray[np.int32]
    uv: dict[str, NDArray[np.float32]]
    active_uv: str
    weight: NDArray[np.float32] | None = None
    state: bytes = b""
    corner_normals: NDArray[np.float32] | None = None


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
        corners = triangles.reshape(-1, 3)
        weight = _weight(evaluated, mesh, corners, loops.reshape(-1, 3))
        positions = vertices.reshape(-1, 3).astype(np.float64)
        state = mesh_state(mesh, WEIGHT_NAME)
        normals = _corner_normals(mesh, loops)
        return MeshArrays(positions, corners, slot, uv, active, weight, state, normals)
    finally:
        evaluated.to_mesh_clear()


def _corner_normals(mesh: Any, loops: NDArray[np.int32]) -> NDArray[np.float32] | None:
    """(T, 3, 3) of the triangles' (T * 3,) corners; None where every face is flat."""
    if mesh.normals_domain == "FACE":
        return None
    normals = np.empty(len(mesh.loops) * 3, dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    return normals.reshape(-1, 3)[loops].reshape(-1, 3, 3)


def _weight(
    evaluated: Any, mesh: Any, triangles: NDArray[np.int32], loops: NDArray[np.int32]
) -> NDArray[np.float32] | None:
    """(T,) the artist's weights painted on a mesh; None where there are none."""
    group = evaluated.vertex_groups.get(WEIGHT_NAME)
    if group is not None:
        return _mean(_of_group(mesh, group.index)[triangles])
    attribute = mesh.attributes.get(WEIGHT_NAME)
    if attribute is None or attribute.data_type != "FLOAT":
        return None
    values = np.empty(len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("value", values)
    if attribute.domain == "POINT":
        return _mean(values[triangles])
    if attribute.domain == "CORNER":
        return _mean(values[loops])
    if attribute.domain == "FACE":
        faces = np.empty(len(triangles), dtype=np.int32)
        mesh.loop_triangles.foreach_get("polygon_index", faces)
        return _mean(values[faces][:, None])
    return None


def _of_group(mesh: Any, index: int) -> NDArray[np.float32]:
    """(V,) each vertex's weight in a group; 0 outside of it, as Blender paints it.

    Groups are the one thing of a mesh that Blender gives out vertex by vertex only (about 3 us
    each), so only meshes with this group pay for it, and once for all their instances.
    """
    weight = np.zeros(len(mesh.vertices), dtype=np.float32)
    for number, vertex in enumerate(mesh.vertices):
        for element in vertex.groups:
            if element.group == index:
                weight[number] = element.weight
    return weight


def _mean(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """(T,) in [0, 1] from (T, C); what is not a number counts as 1, as where nothing is set."""
    weight = np.nan_to_num(corners, nan=1.0, posinf=1.0, neginf=0.0)
    return np.asarray(np.clip(weight, 0.0, 1.0).mean(axis=1), dtype=np.float32)
