# SPDX-License-Identifier: GPL-3.0-or-later
"""The cinematographer's controls in the light's tab, below what Blender's own panels have."""

from __future__ import annotations

from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..scene.light_controls import MOST_BLOCKERS
from .engine import ENGINE

_OUTLINE = (("width", "height"), ("width_edge", "height_edge"), ("roundness",))


class _LightPanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_parent_id = "RELUME_PT_light"
    bl_options = {"DEFAULT_CLOSED"}
    group = ""
    layout: Any

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and context.light is not None

    def draw_header(self, context: Any) -> None:
        """The checkbox of a control that can be switched off."""
        group = getattr(context.light.relume, self.group, None)
        if group is not None and hasattr(group, "use"):
            self.layout.prop(group, "use", text="")

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        group = getattr(context.light.relume, self.group) if self.group else context.light.relume
        layout.active = getattr(group, "use", True)
        self.draw_group(layout, group, context.light)

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        """The control's settings."""
        raise NotImplementedError


def _props(layout: Any, group: Any, *rows: tuple[str, ...]) -> None:
    """Columns of properties that belong together."""
    for row in rows:
        column = layout.column(align=True)
        for name in row:
            column.prop(group, name)


class RELUME_PT_light_weights(_LightPanel, bpy.types.Panel):
    """How much each kind of surface gets."""

    bl_label = "Weights"

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        _props(layout, group, ("diffuse", "specular", "ambient"))


class RELUME_PT_light_shadow(_LightPanel, bpy.types.Panel):
    """How shadows are cheated."""

    bl_label = "Shadow"
    group = "shadow"

    def draw_group(self, layout: Any, group: Any, light: Any) -> None:
        layout.active = light.use_shadow
        _props(layout, group, ("color", "density"), ("softness",), ("offset",))
        layout.prop(group, "hide_highlights")


class RELUME_PT_light_barn_doors(_LightPanel, bpy.types.Panel):
    """An opening of a shape of its own."""

    bl_label = "Barn Doors"
    group = "barn_doors"

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        _props(layout, group, *_OUTLINE, ("shear",), ("rotation",), ("density", "invert"))


class RELUME_PT_light_distance(_LightPanel, bpy.types.Panel):
    """Where light begins, ends, and how it fades."""

    bl_label = "Distance"
    group = "distance"

    def draw_group(self, layout: Any, group: Any, light: Any) -> None:
        for end in ("near", "far"):
            column = layout.column(align=True, heading=end.capitalize())
            row = column.row(align=True)
            row.prop(group, f"use_{end}", text="")
            sub = row.row(align=True)
            sub.active = getattr(group, f"use_{end}")
            sub.prop(group, end, text="")
            edge = column.row()
            edge.active = getattr(group, f"use_{end}")
            edge.prop(group, f"{end}_edge", text="Edge")
        row = layout.row()
        row.active = group.use_near or group.use_far
        row.prop(group, "along_axis")
        if light.type == "SUN":
            return
        falloff = light.relume.falloff
        column = layout.column(align=True, heading="Falloff")
        row = column.row(align=True)
        row.prop(falloff, "use", text="")
        sub = row.row(align=True)
        sub.active = falloff.use
        sub.prop(falloff, "exponent", text="")
        reference = column.row()
        reference.active = falloff.use
        reference.prop(falloff, "distance", text="Reference")


class RELUME_PT_light_slide(_LightPanel, bpy.types.Panel):
    """A picture in the beam."""

    bl_label = "Slide"
    group = "slide"

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        layout.template_ID(group, "image", new="image.new", open="image.open")
        _props(
            layout, group, ("kind", "density", "invert"), ("scale",), ("offset",),
            ("rotation", "blur"), ("repeat",),
        )  # fmt: skip
        row = layout.row()
        row.active = group.use and not group.repeat
        row.prop(group, "frame")


class RELUME_PT_light_noise(_LightPanel, bpy.types.Panel):
    """Uneven light."""

    bl_label = "Noise"
    group = "noise"

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        _props(
            layout, group, ("amount", "scale"), ("detail", "roughness"), ("offset",), ("projected",)
        )  # fmt: skip


class RELUME_UL_blockers(bpy.types.UIList):
    """One row for each card."""

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
        row.use_property_split = row.use_property_decorate = False
        row.prop(item, "use", text="")
        row.prop(item, "object", text="", emboss=False)
        row.prop(item, "density", text="")


class RELUME_PT_light_blockers(_LightPanel, bpy.types.Panel):
    """Cards in the beam."""

    bl_label = "Blockers"

    def draw_group(self, layout: Any, group: Any, _light: Any) -> None:
        row = layout.row()
        row.template_list(
            "RELUME_UL_blockers", "", group, "blockers", group, "active_blocker", rows=2
        )
        column = row.column(align=True)
        column.operator("relume.add_blocker", text="", icon="ADD")
        column.operator("relume.remove_blocker", text="", icon="REMOVE")
        if group.active_blocker < len(group.blockers):
            blocker = group.blockers[group.active_blocker]
            body = layout.column()
            body.active = blocker.use
            body.prop(blocker, "object")
            _props(body, blocker, *_OUTLINE, ("density", "color"), ("invert",))


class _BlockerOperator:
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        data = getattr(context, "light", None)
        return data is not None and data.is_editable


class RELUME_OT_add_blocker(_BlockerOperator, bpy.types.Operator):
    """Adds a card to the light, and the empty that places it."""

    bl_idname = "relume.add_blocker"
    bl_label = "Add Blocker"
    bl_description = "Put a card before the light: an empty that you move, turn and scale"

    def execute(self, context: Any) -> set[str]:
        group = context.light.relume
        if len(group.blockers) >= MOST_BLOCKERS:
            self.report({"ERROR"}, f"A light has at most {MOST_BLOCKERS} blockers")
            return {"CANCELLED"}
        card = bpy.data.objects.new("Blocker", None)
        # A flat box shows the card's sides.
        card.empty_display_type = "CUBE"
        card.matrix_world = context.object.matrix_world.normalized() @ Matrix.LocRotScale(
            Vector((0.0, 0.0, -1.0)), None, Vector((0.25, 0.25, 0.001))
        )
        context.collection.objects.link(card)
        group.blockers.add().object = card
        group.active_blocker = len(group.blockers) - 1
        return {"FINISHED"}


class RELUME_OT_remove_blocker(_BlockerOperator, bpy.types.Operator):
    """Takes the chosen card from the light."""

    bl_idname = "relume.remove_blocker"
    bl_label = "Remove Blocker"
    bl_description = "Take the chosen card out of this light's beam. Its object stays"

    def execute(self, context: Any) -> set[str]:
        group = context.light.relume
        if group.active_blocker >= len(group.blockers):
            return {"CANCELLED"}
        group.blockers.remove(group.active_blocker)
        group.active_blocker = min(group.active_blocker, max(len(group.blockers) - 1, 0))
        context.light.update_tag()
        return {"FINISHED"}


CLASSES = (
    RELUME_UL_blockers,
    RELUME_OT_add_blocker,
    RELUME_OT_remove_blocker,
    RELUME_PT_light_weights,
    RELUME_PT_light_shadow,
    RELUME_PT_light_barn_doors,
    RELUME_PT_light_distance,
    RELUME_PT_light_slide,
    RELUME_PT_light_noise,
    RELUME_PT_light_blockers,
)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Show the controls. After the panel that they are in."""
    _register_classes()


def unregister() -> None:
    """Take them away again."""
    _unregister_classes()
