# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface edits in Properties › Material and Properties › Object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import bpy

from ..caching.surface_edit_reach import out_of_reach
from ..errors import InputError
from ..scene.surface_edit import SurfaceEdit, SurfaceEdits
from ..scene.surface_edit_reader import EDIT_NAME, surface_edit
from .cache_state import read_cache_state
from .engine import ENGINE
from .panel_text import characters_across, draw_text
from .surface_write_back import apply_edit

# Types of objects whose surfaces are shown.
_SHAPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


class RELUME_OT_reset_surface_edit(bpy.types.Operator):
    """Takes an edit off."""

    bl_idname = "relume.reset_surface_edit"
    bl_label = "Reset Surface Edit"
    bl_description = "Take off what is edited about the surfaces of this material or object"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    __annotations__ = {
        "of": bpy.props.EnumProperty(
            items=(("material", "Material", ""), ("object", "Object", "")), options={"HIDDEN"}
        )
    }

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.object is not None or _material_of(context) is not None

    def execute(self, context: Any) -> set[str]:
        block = _material_of(context) if self.of == "material" else context.object
        if block is None:
            return {"CANCELLED"}
        _reset(block)
        return {"FINISHED"}


class RELUME_OT_apply_surface_edit(bpy.types.Operator):
    """Makes a material what its edit shows."""

    bl_idname = "relume.apply_surface_edit"
    bl_label = "Apply to Nodes"
    bl_description = (
        "Change the material's nodes as the edit says, so that Cycles shows it too, and take the "
        "edit off. The material has to be baked again"
    )
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return _material_of(context) is not None

    def execute(self, context: Any) -> set[str]:
        material = _material_of(context)
        try:
            apply_edit(material, surface_edit(material))
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        _reset(material)
        return {"FINISHED"}


def _material_of(context: Any) -> Any:
    """The material that is shown, or else the active object's."""
    shown = getattr(context, "material", None)
    if shown is None and context.object is not None:
        shown = context.object.active_material
    return shown


def _reset(block: Any) -> None:
    for each in fields(SurfaceEdit):
        getattr(block, EDIT_NAME).property_unset(each.name)


class _EditPanel:
    bl_label = "Surface Edit"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    def draw_edit(self, block: Any, of: str, limits: Iterator[str], characters: int) -> None:
        """The properties of a block's edit, and what is to be known of it."""
        layout: Any = self.layout  # type: ignore[attr-defined] # Blender's own
        layout.use_property_split = True
        group = getattr(block, EDIT_NAME)
        column = layout.column(align=True)
        column.prop(group, "gain")
        column.prop(group, "tint")
        column = layout.column(align=True)
        column.prop(group, "roughness")
        column.prop(group, "roughness_offset")
        column = layout.column(align=True)
        column.prop(group, "specular")
        column.prop(group, "specular_tint", text="Tint")
        layout.prop(group, "emission")
        if surface_edit(block).is_neutral:
            return
        row = layout.row(align=True)
        row.operator("relume.reset_surface_edit", text="Reset", icon="LOOP_BACK").of = of
        if of == "material":
            row.operator("relume.apply_surface_edit", icon="NODE_MATERIAL")
        box = layout.box().column(align=True)
        for sentence in ("Shown by Relume alone: Cycles renders the surface without it", *limits):
            draw_text(box, sentence, "INFO", characters)


def _limits(
    context: Any, edits: SurfaceEdits, materials_of: Mapping[str, Sequence[str]] | None = None
) -> Iterator[str]:
    """What the edits of one block do not reach, without its name."""
    plan = read_cache_state(context.scene).plan
    if plan is None:
        return
    for sentence in out_of_reach(plan, edits, materials_of=materials_of):
        for name in (*edits.materials, *edits.objects):
            text = sentence.split(f"'{name}': ", 1)[-1]
            yield text[:1].upper() + text[1:]


class RELUME_PT_material_edit(_EditPanel, bpy.types.Panel):
    """What is changed about a material while it is relit."""

    bl_context = "material"
    bl_parent_id = "RELUME_PT_material"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and context.material is not None

    def draw(self, context: Any) -> None:
        block = context.material
        limits = _limits(context, SurfaceEdits({block.name_full: surface_edit(block)}))
        self.draw_edit(block, "material", limits, characters_across(context))


class RELUME_PT_object_edit(_EditPanel, bpy.types.Panel):
    """What is changed about an object's surfaces while it is relit."""

    bl_label = "Relume Surface Edit"
    bl_context = "object"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return (
            context.engine == ENGINE
            and context.object is not None
            and context.object.type in _SHAPES
        )

    def draw(self, context: Any) -> None:
        block = context.object
        on = {block.name: [s.material.name_full for s in block.material_slots if s.material]}
        limits = _limits(context, SurfaceEdits(objects={block.name: surface_edit(block)}), on)
        self.draw_edit(block, "object", limits, characters_across(context))


CLASSES = (
    RELUME_OT_reset_surface_edit,
    RELUME_OT_apply_surface_edit,
    RELUME_PT_material_edit,
    RELUME_PT_object_edit,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
