# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of the scene's lights: what each adds to the picture, with mute and solo."""

from __future__ import annotations

from typing import Any

import bpy

from .render_panel import RenderPanel

_MUTE = "Leave this light out of Relume's pictures. It is still drawn by other render engines"
_SOLO = "Show only this light, and others with solo, in Relume's pictures"


def _changed(group: Any, _context: Any) -> None:
    """Tells Blender of an edit, also where a script makes it."""
    group.id_data.update_tag()


class RELUME_PG_object(bpy.types.PropertyGroup):
    """What an object has that Blender's objects lack."""

    __annotations__ = {
        "mute": bpy.props.BoolProperty(name="Mute", description=_MUTE, update=_changed),
        "solo": bpy.props.BoolProperty(name="Solo", description=_SOLO, update=_changed),
    }


class RELUME_UL_lights(bpy.types.UIList):
    """One row for each light object of the scene."""

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
        row.active = not item.hide_render
        # As channels of the Video Sequencer and tracks of the NLA Editor have them.
        mute = "CHECKBOX_DEHLT" if item.relume.mute else "CHECKBOX_HLT"
        solo = "SOLO_ON" if item.relume.solo else "SOLO_OFF"
        row.prop(item.relume, "mute", text="", icon=mute, emboss=False)
        row.prop(item.relume, "solo", text="", icon=solo, emboss=False)
        split = row.split(factor=0.5, align=True)
        split.prop(item, "name", text="", emboss=False, icon=f"LIGHT_{item.data.type}")
        look = split.split(factor=0.3, align=True)
        look.prop(item.data, "color", text="")
        look.prop(item.data, "energy", text="")

    def filter_items(
        self, context: Any, data: Any, prop: str  # noqa: ARG002
    ) -> tuple[list[int], list[int]]:  # fmt: skip
        """Only lights, by the name that is typed."""
        objects = list(getattr(data, prop))
        wanted = self.filter_name.lower()
        flags = [
            self.bitflag_filter_item
            if obj.type == "LIGHT" and wanted in obj.name.lower()
            else 0
            for obj in objects
        ]  # fmt: skip
        return flags, []


class RELUME_PT_lights(RenderPanel, bpy.types.Panel):
    """All lights of the scene in one place."""

    bl_label = "Lights"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        scene = context.scene
        layout.template_list(
            "RELUME_UL_lights", "", scene, "objects", scene.relume, "active_light", rows=4
        )
        row = layout.row(align=True)
        row.prop(scene.relume, "mute_world", text="World", invert_checkbox=True)
        row.prop(scene.relume, "mute_emission", text="Emission", invert_checkbox=True)
        layout.prop(scene.relume, "light_passes")


CLASSES = (RELUME_UL_lights, RELUME_PT_lights)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Give objects their settings, and show the panel."""
    bpy.utils.register_class(RELUME_PG_object)
    bpy.types.Object.relume = bpy.props.PointerProperty(type=RELUME_PG_object)
    _register_classes()


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    _unregister_classes()
    del bpy.types.Object.relume
    bpy.utils.unregister_class(RELUME_PG_object)
