# SPDX-License-Identifier: GPL-3.0-or-later
"""A fingerprint of everything that a cache depends on: surfaces and their materials.

Lights, cameras and the world's colour don't count: they may change without a new bake.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from ..scene.geometry import SceneGeometry

# Properties that say how a node looks in the editor, not what it computes.
_LOOKS = {
    "rna_type", "name", "label", "location", "location_absolute", "width", "width_hidden",
    "height", "dimensions", "color", "color_tag", "use_custom_color", "select", "show_options",
    "show_preview", "show_texture", "hide", "parent", "warning_propagation", "debug_lazy_function_graph",
    "debug_zone_body_lazy_function_graph", "debug_zone_lazy_function_graph", "is_active_output",
}  # fmt: skip


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
        digest.update(np.ascontiguousarray(array).tobytes())
    for name in geometry.material_names:
        digest.update(f"material {name}\n".encode())
        material = bpy.data.materials.get(name)
        if material is not None and material.node_tree is not None:
            for line in _tree_lines(material.node_tree, set()):
                digest.update(line.encode())
        elif material is not None:
            digest.update(repr(tuple(material.diffuse_color)).encode())
    return digest.hexdigest()


def _tree_lines(tree: Any, seen: set[int]) -> Iterator[str]:
    """What a node tree computes, as text."""
    if tree.session_uid in seen:
        return
    seen.add(tree.session_uid)
    for node in tree.nodes:
        yield f"{node.name} {node.bl_idname} {node.mute}\n"
        for key in sorted(node.bl_rna.properties.keys()):
            if key not in _LOOKS:
                yield from _property_lines(node, key)
        for socket in node.inputs:
            if hasattr(socket, "default_value") and not socket.is_linked:
                yield f"{socket.identifier}={_plain(socket.default_value)}\n"
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            yield from _tree_lines(inner, seen)
    for link in tree.links:
        yield (
            f"{link.from_node.name}.{link.from_socket.identifier}>"
            f"{link.to_node.name}.{link.to_socket.identifier} {link.is_muted}\n"
        )


def _property_lines(node: Any, key: str) -> Iterator[str]:
    value = getattr(node, key, None)
    if isinstance(value, bpy.types.Image):
        yield from _image_lines(value)
    elif isinstance(value, bpy.types.ColorRamp):
        stops = [(element.position, tuple(element.color)) for element in value.elements]
        yield f"{key}={value.interpolation} {value.color_mode} {stops}\n"
    elif isinstance(value, bpy.types.CurveMapping):
        for curve in value.curves:
            yield f"{key}={[tuple(point.location) for point in curve.points]}\n"
    elif isinstance(value, bool | int | float | str):
        yield f"{key}={value!r}\n"


def _image_lines(image: Any) -> Iterator[str]:
    yield (
        f"image {image.name} {tuple(image.size)} {image.source} {image.alpha_mode} "
        f"{image.colorspace_settings.name}\n"
    )
    if image.packed_file is not None:
        yield hashlib.sha256(image.packed_file.data).hexdigest()
    elif image.source == "FILE":
        path = bpy.path.abspath(image.filepath, library=image.library)
        if os.path.isfile(path):
            status = os.stat(path)
            yield f"{status.st_size} {status.st_mtime_ns}\n"
    elif image.source == "GENERATED":
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        yield hashlib.sha256(pixels.tobytes()).hexdigest()


def _plain(value: Any) -> str:
    if isinstance(value, bool | int | float | str):
        return repr(value)
    try:
        return repr(tuple(value))
    except TypeError:
        return getattr(value, "name", "")
