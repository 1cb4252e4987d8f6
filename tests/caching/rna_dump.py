# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that Blender's data holds, as text that two moments can be compared by."""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

# Windows and what is drawn in them, and what is listed elsewhere.
_NOT_OF_THE_FILE = {"window_managers", "screens", "workspaces", "all_ids"}

# Pointers of RNA to itself, to what is evaluated, and to pictures that are drawn by need.
_VOLATILE = {"rna_type", "bl_rna", "original", "depsgraph", "preview", "asset_data"}

# Read as one array each, and told by their sums.
_PIXELS = {"pixels"}


def dump() -> dict[str, str]:
    """RNA path -> value, of every data-block in every detail.

    Every property of every struct that an ID holds, however deep: nodes, curves, keyframes,
    drivers, modifiers, layers, mesh elements, custom properties; who uses what; the pixels of
    images that are loaded; the selection, which RNA has as functions; and what is shown.
    """
    lines: dict[str, str] = {}
    for mesh in bpy.data.meshes:
        # The first look at what has one value in all of a mesh makes it an array, for good.
        _Block({}).dump_struct("", mesh)
    kinds = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
    for kind in kinds:
        if kind in _NOT_OF_THE_FILE:
            continue
        blocks = getattr(bpy.data, kind)
        lines[f"{kind}.names"] = repr([block.name_full for block in blocks])
        for block in blocks:
            _Block(lines).dump_struct(f"{kind}[{block.name_full}]", block)
    users = bpy.data.user_map()
    for block, names in users.items():
        lines[f"users of {block.id_type} {block.name_full}"] = repr(
            sorted((user.id_type, user.name_full) for user in names)
        )
    _dump_layers(lines)
    _dump_context(lines)
    return lines


class _Block:
    """One data-block's structs. Each is written once, where it is met first: links lead in
    circles."""

    def __init__(self, lines: dict[str, str]) -> None:
        self._lines = lines
        self._met: dict[tuple[int, str], str] = {}

    def dump_struct(self, path: str, struct: Any) -> None:
        key = (struct.as_pointer(), struct.bl_rna.identifier)
        if key in self._met:
            self._lines[path] = f"see {self._met[key]}"
            return
        self._met[key] = path
        for definition in struct.bl_rna.properties:
            name = definition.identifier
            if name not in _VOLATILE:
                self._dump_property(f"{path}.{name}", struct, definition)
        self._dump_custom(path, struct)

    def _dump_property(self, where: str, struct: Any, definition: Any) -> None:
        if definition.identifier in _PIXELS and isinstance(struct, bpy.types.Image):
            # Reading them would load the image.
            self._lines[where] = _pixels(struct) if struct.has_data else "not loaded"
            return
        try:
            value = getattr(struct, definition.identifier)
        except (AttributeError, RuntimeError, TypeError, ValueError) as error:
            self._lines[where] = type(error).__name__
            return
        if definition.type == "COLLECTION":
            self._lines[f"{where}.length"] = repr(len(value))
            for index, item in enumerate(value):
                self._dump_pointer(f"{where}[{index}]", item)
        elif definition.type == "POINTER":
            self._dump_pointer(where, value)
        elif getattr(definition, "is_array", False):
            self._lines[where] = repr([v[:] if hasattr(v, "__len__") else v for v in value])
        else:
            self._lines[where] = repr(value)

    def _dump_pointer(self, where: str, value: Any) -> None:
        if value is None:
            self._lines[where] = "None"
        elif isinstance(value, bpy.types.ID) and not value.is_embedded_data:
            self._lines[where] = f"-> {value.name_full}"
        elif isinstance(value, bpy.types.bpy_struct):
            self.dump_struct(where, value)

    def _dump_custom(self, path: str, struct: Any) -> None:
        try:
            keys = list(struct.keys())
        except TypeError:  # has no custom properties
            return
        for key in keys:
            self._lines[f"{path}[{key!r}]"] = _plain(struct[key])


def _plain(value: Any) -> str:
    if isinstance(value, bpy.types.ID):
        return f"-> {value.name_full}"
    if hasattr(value, "items"):
        return repr({key: _plain(item) for key, item in value.items()})
    return repr(value.to_list() if hasattr(value, "to_list") else value)


def _pixels(image: Any) -> str:
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return f"{image.size[:]} {hashlib.sha256(pixels.tobytes()).hexdigest()}"


def _dump_layers(lines: dict[str, str]) -> None:
    for scene in bpy.data.scenes:
        for layer in scene.view_layers:
            for obj in layer.objects:
                states = [
                    getattr(obj, name)(view_layer=layer)
                    for name in ("select_get", "hide_get", "visible_get", "holdout_get")
                ]
                lines[f"{scene.name_full}/{layer.name}/{obj.name_full}"] = repr(states)


def _dump_context(lines: dict[str, str]) -> None:
    for name in ("scene", "view_layer", "object", "mode"):
        lines[f"context.{name}"] = repr(getattr(bpy.context, name, None))
    for index, window in enumerate(bpy.context.window_manager.windows):
        lines[f"windows[{index}]"] = repr((window.scene, window.view_layer, window.workspace))
    lines["filepath"] = repr((bpy.data.filepath, bpy.data.is_saved))


def differences(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """What differs, one line each."""
    return [
        f"{key}: {before.get(key)} became {after.get(key)}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key) != after.get(key)
    ]
