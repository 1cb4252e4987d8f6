# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints of what a cache depends on.

The scene's is of its surfaces and their materials. Lights and cameras don't count: they may
change without a new bake. The world has a fingerprint of its own, as only its picture depends
on it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from ..scene.geometry import SceneGeometry
from ..scene.tree_lines_reader import tree_lines

# Attribute type -> property of its elements, numbers in each, and their type.
_ELEMENTS: dict[str, tuple[str, int, type[np.generic]]] = {
    "FLOAT": ("value", 1, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "INT16_2D": ("value", 2, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
}


def scene_fingerprint(geometry: SceneGeometry) -> str:
    """64 hexadecimal digits for the open file's geometry and the materials that it uses."""
    digest = hashlib.sha256()
    for array in (
        geometry.vertices,
        geometry.triangles,
        geometry.object_id,
        geometry.material_id,
        geometry.camera_visible,
    ):
        digest.update(np.ascontiguousarray(array))
    for part in _mesh_parts(set(geometry.object_names)):
        digest.update(part)
    materials = {material.name_full: material for material in bpy.data.materials}
    for name in geometry.material_names:
        digest.update(f"material {name}\n".encode())
        material = materials.get(name)
        if material is not None:
            for line in _material_lines(material):
                digest.update(line.encode())
    return digest.hexdigest()


def _material_lines(material: Any) -> Iterator[str]:
    yield f"{material.pass_index} {tuple(material.diffuse_color)}\n"
    if material.node_tree is not None:
        yield from tree_lines(material.node_tree)


def _mesh_parts(names: set[str]) -> Iterator[bytes]:
    """UV maps, colours, smoothness and normals of the shown objects, as their meshes have them.

    Positions are left to the evaluated geometry; names with a dot are the editor's selection.
    """
    seen: set[int] = set()
    for obj in sorted(bpy.data.objects, key=lambda obj: obj.name_full):
        if obj.name not in names:
            continue
        yield f"{tuple(obj.color)} {obj.pass_index}\n".encode()
        mesh = obj.data
        if not isinstance(mesh, bpy.types.Mesh) or mesh.session_uid in seen:
            continue
        seen.add(mesh.session_uid)
        rendered_maps = [layer.name for layer in mesh.uv_layers if layer.active_render]
        yield f"{rendered_maps}\n".encode()
        for attribute in mesh.attributes:
            if attribute.name.startswith(".") or attribute.name == "position":
                continue
            yield f"{attribute.name} {attribute.domain} {attribute.data_type}\n".encode()
            if attribute.data_type in _ELEMENTS:
                yield _values(attribute)


def _values(attribute: Any) -> bytes:
    key, count, dtype = _ELEMENTS[attribute.data_type]
    values = np.empty(len(attribute.data) * count, dtype=dtype)
    attribute.data.foreach_get(key, values)
    return values.tobytes()
