# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the surface edits that a .blend keeps: `relume_edit` of its materials and objects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

import bpy

from .surface_edit import SurfaceEdit, SurfaceEdits

# The property group's name on a `bpy.types.Material` and a `bpy.types.Object`.
EDIT_NAME = "relume_edit"


def read_surface_edits(depsgraph: Any) -> SurfaceEdits:
    """The edits that change anything, as an evaluated scene has them: animated ones too."""
    return SurfaceEdits(
        materials=_edits((material.name_full, material) for material in _evaluated(depsgraph)),
        objects=_edits(
            (obj.name, obj.evaluated_get(depsgraph))
            for obj in bpy.data.objects
            if obj.type != "LIGHT"
        ),
    )


def _evaluated(depsgraph: Any) -> Iterable[Any]:
    return [material.evaluated_get(depsgraph) for material in bpy.data.materials]


def _edits(blocks: Iterable[tuple[str, Any]]) -> dict[str, SurfaceEdit]:
    found = {name: surface_edit(block) for name, block in blocks}
    return {name: edit for name, edit in found.items() if not edit.is_neutral}


def surface_edit(block: Any) -> SurfaceEdit:
    """The edit of a `bpy.types.Material` or `bpy.types.Object`.

    Also where the extension's properties are not registered, as on the command line.
    """
    if hasattr(block, EDIT_NAME):
        group = getattr(block, EDIT_NAME)
        values = {each.name: getattr(group, each.name) for each in fields(SurfaceEdit)}
    else:
        kept = block.bl_system_properties_get()
        group = None if kept is None else kept.get(EDIT_NAME)
        if group is None:
            return SurfaceEdit()
        names = [each.name for each in fields(SurfaceEdit) if each.name in group]
        values = {name: group[name] for name in names}
    return SurfaceEdit(**{name: _plain(value) for name, value in values.items()})


def _plain(value: Any) -> Any:
    """A property's value as Python's own numbers."""
    return float(value) if isinstance(value, int | float) else tuple(float(x) for x in value)
