# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the surface edits that a .blend keeps: `relume_edit` of its materials and objects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any

import bpy

from .surface_edit import SurfaceEdit, SurfaceEdits

# The property group's name on a `bpy.types.Material` and a `bpy.types.Object`.
EDIT_NAME = "relume_edit"


def read_surface_edits(depsgraph: Any) -> SurfaceEdits:
    """The edits that change anything, as an evaluated scene has them: animated ones too."""
    materials = (block for block in bpy.data.materials if _may_have_edit(block))
    objects = (obj for obj in bpy.data.objects if obj.type != "LIGHT" and _may_have_edit(obj))
    return SurfaceEdits(
        {block.name_full: edit for block, edit in _evaluated(materials, depsgraph)},
        {obj.name: edit for obj, edit in _evaluated(objects, depsgraph)},
    )


def _may_have_edit(block: Any) -> bool:
    """Whether a block keeps an edit, or a driver might make one: scenes have many that do not."""
    kept = block.bl_system_properties_get()
    return block.animation_data is not None or (kept is not None and EDIT_NAME in kept)


def _evaluated(blocks: Iterable[Any], depsgraph: Any) -> Iterator[tuple[Any, SurfaceEdit]]:
    for block in blocks:
        edit = surface_edit(block.evaluated_get(depsgraph))
        if not edit.is_neutral:
            yield block, edit


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
