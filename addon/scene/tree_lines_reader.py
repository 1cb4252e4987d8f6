# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shader node tree computes, written out as text to be hashed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .node_use import used_nodes

# Properties that say how a node looks in the editor, not what it computes.
_LOOKS = {
    "rna_type", "name", "label", "location", "location_absolute", "width", "width_hidden",
    "height", "dimensions", "color", "color_tag", "use_custom_color", "select", "show_options",
    "show_preview", "show_texture", "hide", "parent", "warning_propagation", "is_active_output",
    "debug_lazy_function_graph", "debug_zone_body_lazy_function_graph",
    "debug_zone_lazy_function_graph", "bl_width_default", "bl_width_min", "bl_width_max",
}  # fmt: skip


def tree_lines(tree: Any, seen: set[int] | None = None) -> Iterator[str]:
    """What a `bpy.types.NodeTree` computes, groups and images included.

    Nodes that nothing depends on, and where nodes are drawn, don't count. A group is written
    where it is met first.
    """
    seen = set() if seen is None else seen
    if tree.session_uid in seen:
        return
    seen.add(tree.session_uid)
    nodes = used_nodes(tree)
    for node in nodes:
        yield f"{node.name} {node.bl_idname} {node.mute}\n"
        for key in sorted(node.bl_rna.properties.keys()):
            if key not in _LOOKS:
                yield from _property_lines(node, key)
        for socket in node.inputs:
            if hasattr(socket, "default_value") and not socket.is_linked:
                yield f"{socket.identifier}={_plain(socket.default_value)}\n"
        for socket in node.outputs:
            # The values of Value and Color nodes.
            if node.bl_idname in {"ShaderNodeValue", "ShaderNodeRGB"}:
                yield f"{socket.identifier}={_plain(socket.default_value)}\n"
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            yield from tree_lines(inner, seen)
    names = {node.name for node in nodes}
    yield from sorted(
        f"{link.from_node.name}.{link.from_socket.identifier}>"
        f"{link.to_node.name}.{link.to_socket.identifier} {link.is_muted}\n"
        for link in tree.links
        if link.to_node.name in names
    )


def _property_lines(node: Any, key: str) -> Iterator[str]:
    value = getattr(node, key, None)
    if isinstance(value, bpy.types.Image):
        yield from _image_lines(value)
    elif isinstance(value, bpy.types.ColorRamp):
        stops = [(element.position, tuple(element.color)) for element in value.elements]
        yield f"{key}={value.interpolation} {value.color_mode} {value.hue_interpolation} {stops}\n"
    elif isinstance(value, bpy.types.CurveMapping):
        for curve in value.curves:
            yield f"{key}={[(*point.location, point.handle_type) for point in curve.points]}\n"
    elif isinstance(value, bpy.types.Object):
        # Texture coordinates that are relative to another object.
        yield f"{key}={value.name_full} {[tuple(row) for row in value.matrix_world]}\n"
    elif isinstance(value, bpy.types.ImageUser):
        yield f"{key}={value.frame_current} {value.frame_offset} {value.use_cyclic}\n"
    elif value is not None and node.bl_rna.properties[key].type != "COLLECTION":
        yield f"{key}={_plain(value)}\n"


def _image_lines(image: Any) -> Iterator[str]:
    yield (
        f"image {image.name} {tuple(image.size)} {image.source} {image.alpha_mode} "
        f"{image.colorspace_settings.name}\n"
    )
    if image.source == "GENERATED" or image.is_dirty:
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        yield hashlib.sha256(pixels).hexdigest()
    elif image.packed_file is not None:
        yield hashlib.sha256(image.packed_file.data).hexdigest()
    else:
        # Pictures of tiles and of frames have a pattern in their file's name.
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        pattern = path.name.replace("<UDIM>", "[0-9][0-9][0-9][0-9]")
        for file in sorted(path.parent.glob(pattern) if pattern != path.name else [path]):
            if file.is_file():
                status = file.stat()
                yield _file_hash(file, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=4096)
def _file_hash(file: Path, size: int, mtime_ns: int) -> str:  # noqa: ARG001 - part of the key
    """Of the content: a scene that is copied to another machine has other times."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _plain(value: Any) -> str:
    if isinstance(value, bool | int | float | str):
        return repr(value)
    if isinstance(value, bpy.types.ID):
        return value.name_full
    try:
        return repr(tuple(value))
    except TypeError:
        return ""
