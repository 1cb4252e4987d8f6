# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a light objects get: the list in Properties › Data of a light."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.light_linking import beyond_cycles
from ..scene.light_linking_reader import SELECTION_NAME, read_selection
from .engine import ENGINE

# What of a light an object may get: tenfold, as uberlights have it.
_MOST = 10.0


def _edited(group: Any, _context: Any) -> None:
    """Tells Blender that a light changed, also where a script sets the property."""
    if not group.id_data.is_evaluated:
        group.id_data.update_tag()


class RELUME_PG_light_object(bpy.types.PropertyGroup):
    """What of a light an object, or each object of a collection, gets."""

    __annotations__ = {
        "object": bpy.props.PointerProperty(
            name="Object",
            description="What gets another share of this light. An object that instances others "
            "stands for all of them",
            type=bpy.types.Object,
            update=_edited,
        ),
        "collection": bpy.props.PointerProperty(
            name="Collection",
            description="Each object in this collection gets another share of this light",
            type=bpy.types.Collection,
            update=_edited,
        ),
        "weight": bpy.props.FloatProperty(
            name="Weight",
            description="How much of this light it gets. 0 is none, 1 as much as without",
            default=1.0,
            min=0.0,
            max=_MOST,
            soft_max=2.0,
            update=_edited,
        ),
        "use_diffuse": bpy.props.BoolProperty(
            name="Diffuse",
            description="The weight is of its diffuse light",
            default=True,
            update=_edited,
        ),
        "use_specular": bpy.props.BoolProperty(
            name="Specular",
            description="The weight is of its highlights",
            default=True,
            update=_edited,
        ),
    }


class RELUME_PG_light_objects(bpy.types.PropertyGroup):
    """The objects that get more or less of a light than others."""

    __annotations__ = {
        "entries": bpy.props.CollectionProperty(type=RELUME_PG_light_object),
        "active": bpy.props.IntProperty(),
        "others": bpy.props.FloatProperty(
            name="All Others",
            description="How much of this light objects get that are not listed",
            default=1.0,
            min=0.0,
            max=_MOST,
            soft_max=2.0,
            update=_edited,
        ),
    }


class RELUME_UL_light_objects(bpy.types.UIList):
    """One row for each entry."""

    def draw_item(  # noqa: PLR0917 - Blender's signature
        self,
        context: Any,  # noqa: ARG002
        layout: Any,
        data: Any,  # noqa: ARG002
        item: Any,
        icon: int,  # noqa: ARG002
        active_data: Any,  # noqa: ARG002
        active_property: str,  # noqa: ARG002
        index: int = 0,  # noqa: ARG002
        flt_flag: int = 0,  # noqa: ARG002
    ) -> None:
        row = layout.row(align=True)
        shown = item.collection or item.object
        kind = "OUTLINER_COLLECTION" if item.collection is not None else "OBJECT_DATA"
        name = shown.name if shown is not None else "(none)"
        row.label(text=name, icon=kind)
        row.prop(item, "weight", text="")
        row.prop(item, "use_diffuse", text="", icon="SHADING_SOLID")
        row.prop(item, "use_specular", text="", icon="SHADING_RENDERED")


class _OfLight:
    """What acts on the active object's list."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        obj = context.object
        return obj is not None and obj.type == "LIGHT" and obj.is_editable


class RELUME_OT_add_light_objects(_OfLight, bpy.types.Operator):
    """Adds to the list: the objects that are selected, or else an empty row."""

    bl_idname = "relume.add_light_objects"
    bl_label = "Add Objects"
    bl_description = (
        "Give objects another share of this light: those that are selected and not listed yet, or "
        "else one to choose"
    )

    def execute(self, context: Any) -> set[str]:
        settings = getattr(context.object, SELECTION_NAME)
        listed = {entry.object for entry in settings.entries}
        chosen = [
            obj
            for obj in context.selected_objects
            if obj.type not in {"LIGHT", "CAMERA"} and obj not in listed
        ]
        for obj in chosen or [None]:
            settings.entries.add().object = obj
        settings.active = len(settings.entries) - 1
        return {"FINISHED"}


class RELUME_OT_remove_light_object(_OfLight, bpy.types.Operator):
    """Takes the active row away."""

    bl_idname = "relume.remove_light_object"
    bl_label = "Remove Object"
    bl_description = "Take the active row off the list"

    def execute(self, context: Any) -> set[str]:
        settings = getattr(context.object, SELECTION_NAME)
        if not 0 <= settings.active < len(settings.entries):
            return {"CANCELLED"}
        settings.entries.remove(settings.active)
        context.object.update_tag()
        settings.active = max(min(settings.active, len(settings.entries) - 1), 0)
        return {"FINISHED"}


class RELUME_PT_light_objects(bpy.types.Panel):
    """The list. What of it Cycles does not show stands where it is written to Cycles."""

    bl_label = "Objects"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_parent_id = "RELUME_PT_light"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        obj = context.object
        return context.engine == ENGINE and obj is not None and obj.type == "LIGHT"

    def draw(self, context: Any) -> None:
        layout, obj = self.layout, context.object
        settings = getattr(obj, SELECTION_NAME)
        row = layout.row()
        row.template_list(
            "RELUME_UL_light_objects", "", settings, "entries", settings, "active", rows=3
        )
        buttons = row.column(align=True)
        buttons.operator("relume.add_light_objects", text="", icon="ADD")
        buttons.operator("relume.remove_light_object", text="", icon="REMOVE")
        column = layout.column()
        column.use_property_split = True
        if 0 <= settings.active < len(settings.entries):
            entry = settings.entries[settings.active]
            column.prop(entry, "object")
            column.prop(entry, "collection")
            column.prop(entry, "weight")
        column.prop(settings, "others")


def objects_beyond_cycles(obj: Any) -> tuple[str, ...]:
    """What of a light object's list Cycles cannot show; nothing of an object without one."""
    selection = None if obj is None else read_selection(obj)
    return () if selection is None else beyond_cycles(selection)


CLASSES = (
    RELUME_UL_light_objects,
    RELUME_OT_add_light_objects,
    RELUME_OT_remove_light_object,
    RELUME_PT_light_objects,
)
_GROUPS = (RELUME_PG_light_object, RELUME_PG_light_objects)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)
_register_groups, _unregister_groups = bpy.utils.register_classes_factory(_GROUPS)


def register() -> None:
    """Give objects their lists, and show the panel."""
    _register_groups()
    pointer = bpy.props.PointerProperty(type=RELUME_PG_light_objects)
    setattr(bpy.types.Object, SELECTION_NAME, pointer)
    _register_classes()


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    _unregister_classes()
    delattr(bpy.types.Object, SELECTION_NAME)
    _unregister_groups()
