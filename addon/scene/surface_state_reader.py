# SPDX-License-Identifier: GPL-3.0-or-later
"""Hashes what a material can read of a surface beside where it is.

Positions, materials of faces and visibility are in `SceneGeometry`; these are the rest: what a
mesh's attributes, an object and an instance give to the nodes of a material.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

# Which kinds of rays meet an object: its ambient occlusion of others, and Raycast nodes, ask.
_VISIBILITIES = (
    "visible_diffuse", "visible_glossy", "visible_transmission", "visible_shadow",
)  # fmt: skip

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


def mesh_state(mesh: Any, ignored: str) -> bytes:
    """A digest of an evaluated `bpy.types.Mesh`'s UV maps, colours, smoothness, custom normals
    and other attributes, and of its texture space.

    Left out are attributes whose name begins with a dot, such as the editor's selection, and the
    one named `ignored`.
    """
    digest = hashlib.sha256()
    rendered_maps = [layer.name for layer in mesh.uv_layers if layer.active_render]
    space = tuple(mesh.texspace_location), tuple(mesh.texspace_size)
    digest.update(f"{rendered_maps} {space}\n".encode())
    for attribute in mesh.attributes:
        name = attribute.name
        if name.startswith(".") or name in {"position", ignored}:
            continue
        digest.update(f"{name} {attribute.domain} {attribute.data_type}\n".encode())
        if attribute.data_type in _ELEMENTS:
            key, count, dtype = _ELEMENTS[attribute.data_type]
            values = np.empty(len(attribute.data) * count, dtype=dtype)
            attribute.data.foreach_get(key, values)
            digest.update(values)
    return digest.digest()


def instance_state(instance: Any, evaluated: Any, instancer: Any, ignored: str) -> bytes:
    """A digest of what a `bpy.types.DepsgraphObjectInstance`, its object and the object that
    instances it (the same one, if nothing does) give to the nodes of a material; the custom
    property `ignored` is left out."""
    numbers = (
        *(tuple(row) for row in instance.matrix_world),
        int(instance.random_id),
        tuple(instance.orco),
        tuple(instance.uv),
    )
    digest = hashlib.sha256(repr(numbers).encode())
    for obj in (evaluated, instancer):
        visible = [getattr(obj, name) for name in _VISIBILITIES]
        digest.update(f"{obj.name_full} {tuple(obj.color)} {obj.pass_index} {visible}\n".encode())
        for key in sorted(obj.keys()):
            if key != ignored:
                digest.update(f"{key}={_plain(obj[key])}\n".encode())
    return digest.digest()


def _plain(value: Any) -> str:
    """A custom property's value, where a material can read it: numbers, words and their lists."""
    if isinstance(value, bool | int | float | str):
        return repr(value)
    to_list = getattr(value, "to_list", None)
    return "" if to_list is None else repr(to_list())
