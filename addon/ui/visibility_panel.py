# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray visibility in Properties › Object › Visibility: Blender has it for its own engines only."""

from __future__ import annotations

from typing import Any

import bpy

from .engine import ENGINE

# What Relume follows of each type of object; instances follow their instancer's too.
_OF_SHAPES = (("visible_camera", "Camera"), ("visible_shadow", "Shadow"))
_OF_LIGHTS = (("visible_diffuse", "Diffuse"), ("visible_glossy", "Glossy"))
_SHAPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


def followed(obj: Any) -> tuple[tuple[str, str], ...]:
    """The visibilities of a `bpy.types.Object` that Relume follows: attributes and labels."""
    if obj.type == "LIGHT":
        return _OF_LIGHTS
    instances = obj.type == "EMPTY" and obj.instance_type == "COLLECTION"
    return _OF_SHAPES if instances or obj.type in _SHAPES else ()


def _draw(panel: Any, context: Any) -> None:
    obj = context.object
    if context.engine != ENGINE or obj is None:
        return
    shown = followed(obj)
    if shown:
        panel.layout.separator()
        column = panel.layout.column(heading="Ray Visibility")
        for name, label in shown:
            column.prop(obj, name, text=label, toggle=False)


def register() -> None:
    """Add the rows to Blender's panel."""
    bpy.types.OBJECT_PT_visibility.append(_draw)


def unregister() -> None:
    """Take them out of it."""
    bpy.types.OBJECT_PT_visibility.remove(_draw)
