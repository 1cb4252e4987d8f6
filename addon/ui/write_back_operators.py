# SPDX-License-Identifier: GPL-3.0-or-later
"""Write to Cycles, Remove from Cycles, and their panel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..errors import InputError
from ..scene.light_controls import LightControls
from ..scene.light_controls_reader import read_controls
from ..scene.not_in_cycles import not_in_cycles
from . import write_back
from .engine import ENGINE
from .light_objects import objects_beyond_cycles
from .panel_text import characters_across, draw_text
from .write_back_objects import (
    are_objects_current,
    are_objects_written,
    remove_objects,
    require_objects_writable,
    write_objects,
)

_ALL_LIGHTS: Any = bpy.props.BoolProperty(
    name="All Lights", description="Do it to every light of the scene", default=False
)


def _controls(light: Any, depsgraph: Any) -> LightControls:
    """What Relume shows of a `bpy.types.Light`; it names problems itself."""
    return read_controls(depsgraph, light.evaluated_get(depsgraph), [])


class _LightOperator:
    """What both have in common."""

    bl_options = {"REGISTER", "UNDO"}
    all_lights: Any
    report: Callable[[set[str], str], None]

    def _lights(self, context: Any) -> list[Any]:
        """The `bpy.types.Light`s that it is about, each once."""
        if self.all_lights:
            lights = {o.data.name_full: o.data for o in context.scene.objects if o.type == "LIGHT"}
            return list(lights.values())
        light = getattr(context, "light", None)
        if light is None and context.object is not None and context.object.type == "LIGHT":
            light = context.object.data
        return [] if light is None else [light]

    def _each(self, context: Any, work: Callable[[Any], None], done: str) -> set[str]:
        """Do it to each; what fails is reported, and the others are done."""
        lights = self._lights(context)
        if not lights:
            self.report({"ERROR"}, "There is no light; select one, or take all lights")
            return {"CANCELLED"}
        count = 0
        for light in lights:
            try:
                work(light)
                count += 1
            except InputError as error:
                self.report({"ERROR"}, str(error))
        if not count:
            return {"CANCELLED"}
        self.report({"INFO"}, f"{done} {count} {'light' if count == 1 else 'lights'}")
        return {"FINISHED"}


class RELUME_OT_write_back(_LightOperator, bpy.types.Operator):
    """Writes lights' controls for Cycles."""

    bl_idname = "relume.write_back"
    bl_label = "Write to Cycles"
    bl_description = (
        "Add nodes to the light that show its controls in Cycles' renders too, in place of those "
        "that were added before"
    )

    all_lights: _ALL_LIGHTS

    def execute(self, context: Any) -> set[str]:
        depsgraph = context.evaluated_depsgraph_get()
        # Writing changes the evaluated lights.
        read = {light: _controls(light, depsgraph) for light in self._lights(context)}

        def work(light: Any) -> None:
            # A light is written as a whole, or left with what it has.
            write_back.require_writable(light, read[light])
            require_objects_writable(light)
            write_back.write(light, read[light])
            write_objects(light)

        return self._each(context, work, "Wrote")


class RELUME_OT_remove_write_back(_LightOperator, bpy.types.Operator):
    """Takes what was written out of lights."""

    bl_idname = "relume.remove_write_back"
    bl_label = "Remove from Cycles"
    bl_description = "Take the controls' nodes out of the light; nothing else of it changes"

    all_lights: _ALL_LIGHTS

    def execute(self, context: Any) -> set[str]:
        def work(light: Any) -> None:
            write_back.remove(light)
            remove_objects(light)

        return self._each(context, work, "Removed what was written from")


class RELUME_PT_write_back(bpy.types.Panel):
    """What a Cycles render shows of the light's controls."""

    bl_label = "In Cycles"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_parent_id = "RELUME_PT_light"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and context.light is not None

    def draw(self, context: Any) -> None:
        light, layout = context.light, self.layout
        controls = _controls(light, context.view_layer.depsgraph)
        characters = characters_across(context)
        column = layout.column(align=True)
        draw_text(column, *_state(light, controls), characters)
        lacking = not_in_cycles(light.type, controls)
        lacking += tuple(
            f"animation of: {name}" for name in write_back.standing_still(light, controls)
        )
        lacking += objects_beyond_cycles(context.object)
        if lacking:
            column.label(text="Not in Cycles' renders:", icon="INFO")
            for phrase in lacking:
                draw_text(column, phrase, "DOT", characters)
        for all_lights, text in ((False, "Write to Cycles"), (True, "Write All Lights")):
            row = layout.row(align=True)
            operator = row.operator("relume.write_back", text=text, icon="NODETREE")
            operator.all_lights = all_lights
            operator = row.operator("relume.remove_write_back", text="", icon="X")
            operator.all_lights = all_lights


def _state(light: Any, controls: LightControls) -> tuple[str, str]:
    """A sentence, and its icon."""
    written = write_back.is_written(light) or are_objects_written(light)
    if write_back.is_current(light, controls) and are_objects_current(light):
        if written:
            return "The controls are in the light's nodes", "CHECKMARK"
        return "No control needs nodes", "BLANK1"
    if written:
        return "The controls changed since they were written; write them again", "ERROR"
    return "Cycles does not show the controls yet", "INFO"


CLASSES = (RELUME_OT_write_back, RELUME_OT_remove_write_back, RELUME_PT_write_back)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
