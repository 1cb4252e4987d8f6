# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that Blender's data holds, as text that two moments can be compared by."""

from __future__ import annotations

from typing import Any

import bpy

# Counters and pointers of the running program, not of the file.
_VOLATILE = {"rna_type", "bl_rna", "session_uid", "original", "tag", "preview", "depsgraph"}

_KINDS = (
    "scenes", "objects", "meshes", "materials", "node_groups", "cameras", "lights", "worlds",
    "images", "collections", "actions",
)  # fmt: skip

# Deep enough for a node's socket in a tree, and for a setting in a scene's settings.
_DEPTH = 4

# Large arrays of elements that no bake has a reason to touch, but for the materials' indices.
_ARRAYS = {"vertices", "edges", "loops", "pixels", "attributes", "vertex_normals", "corner_normals"}


def dump() -> dict[str, str]:
    """RNA path -> value, of every data-block of the kinds that a bake has to do with."""
    lines: dict[str, str] = {}
    for kind in _KINDS:
        blocks = getattr(bpy.data, kind)
        lines[f"{kind}.length"] = repr(len(blocks))
        for block in blocks:
            _dump_struct(f"{kind}[{block.name_full}]", block, lines, 0)
    return lines


def _dump_struct(path: str, struct: Any, lines: dict[str, str], depth: int) -> None:
    for definition in struct.bl_rna.properties:
        key = definition.identifier
        if key in _VOLATILE or key in _ARRAYS:
            continue
        where = f"{path}.{key}"
        try:
            value = getattr(struct, key)
        except (AttributeError, RuntimeError, TypeError, ValueError) as error:
            lines[where] = type(error).__name__
            continue
        if definition.type == "COLLECTION":
            _dump_collection(where, value, lines, depth)
        elif definition.type == "POINTER":
            _dump_pointer(where, value, lines, depth)
        elif getattr(definition, "is_array", False):
            lines[where] = repr([item[:] if hasattr(item, "__len__") else item for item in value])
        else:
            lines[where] = repr(value)
    if isinstance(struct, bpy.types.ID):
        lines[f"{path}.keys()"] = repr(sorted(struct.keys()))


def _dump_collection(where: str, value: Any, lines: dict[str, str], depth: int) -> None:
    lines[f"{where}.length"] = repr(len(value))
    for index, item in enumerate(value):
        _dump_pointer(f"{where}[{index}]", item, lines, depth)


def _dump_pointer(where: str, value: Any, lines: dict[str, str], depth: int) -> None:
    if value is None:
        lines[where] = "None"
    elif isinstance(value, bpy.types.ID) and not value.is_embedded_data:
        lines[where] = f"-> {value.name_full}"
    elif depth < _DEPTH and isinstance(value, bpy.types.bpy_struct):
        _dump_struct(where, value, lines, depth + 1)


def differences(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """What differs, one line each."""
    return [
        f"{key}: {before.get(key)} became {after.get(key)}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key) != after.get(key)
    ]
