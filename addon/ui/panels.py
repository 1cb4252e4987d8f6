# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels in Properties › Render, and what light panels lack for Relume."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from ..caching.material_model import MODEL_NAMES
from ..scene.caching_collection_reader import caching_collection
from . import job
from .cache_folder import SUFFIX
from .cache_state import CacheState, read_cache_state, with_changes
from .camera_changes import camera_changes
from .engine import ENGINE
from .operators import camera_layer
from .panel_text import characters_across, draw_text
from .render_panel import RenderPanel

# The fields that count for each kind of budget, and what they are called beside it.
BUDGET_FIELDS = {
    "CAMERAS": {"primaries": "Primary", "secondaries": "Secondary"},
    "PICTURES": {"max_pictures": "Pictures"},
    "MEMORY": {"max_megabytes": "Megabytes"},
}
# A longer list would push everything else out of the panel.
MOST_LINES = 8


class RELUME_PT_cache(RenderPanel, bpy.types.Panel):
    """Place, Bake, and the state of the cache."""

    bl_label = "Cache"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.relume

        column = layout.column()
        column.prop(settings, "cache_folder", placeholder=f"//<name>{SUFFIX}")
        column.prop(settings, "preset")
        column.prop(settings, "shot")
        column.prop(settings, "box_object", icon="MESH_CUBE")
        _draw_budget(layout, settings)

        running = job.current()
        if running is not None:
            row = layout.row(align=True)
            row.progress(
                factor=running.fraction, text=f"{100 * running.fraction:.0f} % {running.message}"
            )
            row.operator("relume.cancel", text="", icon="CANCEL")
        else:
            row = layout.row(align=True)
            row.operator("relume.place", icon="OUTLINER_OB_CAMERA")
            row.operator("relume.bake", icon="RENDER_STILL")
        _draw_cameras(layout, context)
        characters = characters_across(context)
        state = read_cache_state(context.scene)
        graph = context.view_layer.depsgraph
        if graph is not None:
            cameras = (state.placed, state.cameras)
            changes = camera_changes(graph, context.scene, *cameras, state.largest)
            state = with_changes(state, changes)
        draw_state(layout, state, characters)


def _draw_budget(layout: Any, settings: Any) -> None:
    """The budget's fields that count, and, folded in, what is seldom changed."""
    column = layout.column(align=True)
    column.prop(settings, "budget")
    for name, text in BUDGET_FIELDS[settings.budget].items():
        column.prop(settings, name, text=text)
    header, body = layout.panel("RELUME_PT_cache_advanced", default_closed=True)
    header.label(text="Advanced")
    if body is not None:
        body.prop(settings, "shot_share", slider=True)
        body.prop(settings, "keep_cameras")


def _draw_cameras(layout: Any, context: Any) -> None:
    """How many caching cameras the scene has to be baked, shown or hidden."""
    collection = caching_collection(context.scene)
    layer = camera_layer(context)
    if collection is None or layer is None:
        return
    row = layout.row(align=True)
    number = sum(obj.type == "CAMERA" for obj in collection.all_objects)
    row.label(text=f"{number} caching cameras", icon="OUTLINER_COLLECTION")
    icon = "HIDE_ON" if layer.hide_viewport else "HIDE_OFF"
    row.operator("relume.hide_cameras", text="", icon=icon, emboss=False)
    row.operator("relume.remove_cameras", text="", icon="X", emboss=False)


def draw_state(layout: Any, state: CacheState, characters: int) -> None:
    """Say what the cache holds, in lines of at most so many characters."""
    box = layout.box().column(align=True)
    draw_text(box, state.summary, state.icon, characters)
    for line in state.details:
        draw_text(box, line, "BLANK1", characters)
    _draw_list(box, "Shown approximately:", state.approximations, characters)
    _draw_list(box, "In the viewport:", state.warnings, characters)


def _draw_list(box: Any, heading: str, sentences: Sequence[str], characters: int) -> None:
    """Sentences below a heading, as many as there is room for; nothing where there is none."""
    if not sentences:
        return
    box.label(text=heading, icon="INFO")
    for text in sentences[:MOST_LINES]:
        draw_text(box, text, "DOT", characters)
    more = len(sentences) - MOST_LINES
    if more > 0:
        box.label(text=f"and {more} more", icon="BLANK1")


class RELUME_PT_sampling(RenderPanel, bpy.types.Panel):
    """How many samples a picture has."""

    bl_label = "Sampling"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(align=True)
        column.prop(context.scene.relume, "viewport_samples", text="Viewport")
        column.prop(context.scene.relume, "render_samples", text="Render")
        layout.prop(context.scene.relume, "shadows")


class RELUME_PT_performance(RenderPanel, bpy.types.Panel):
    """What the viewport gives up for its speed."""

    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.relume, "frame_rate", text="Moving View")


class RELUME_PT_film(RenderPanel, bpy.types.Panel):
    """The render settings shared with Cycles."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(context.scene.render, "film_transparent")
        cycles = getattr(context.scene, "cycles", None)
        if cycles is not None:
            layout.prop(cycles, "pixel_filter_type")
            if cycles.pixel_filter_type != "BOX":
                layout.prop(cycles, "filter_width")


class RELUME_PT_light(bpy.types.Panel):
    """What EEVEE's light panel lacks."""

    bl_label = "Relume"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and context.light is not None

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(context.light, "use_shadow", text="Cast Shadow")
        if context.light.type == "AREA":
            layout.prop(context.light, "spread")


class RELUME_PT_camera(bpy.types.Panel):
    """What Blender's camera panels lack for a caching camera."""

    bl_label = "Caching Camera"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: Any) -> bool:
        collection = caching_collection(context.scene)
        return (
            context.engine == ENGINE
            and context.camera is not None
            and collection is not None
            and context.object in collection.all_objects.values()
        )

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(context.camera.relume, "resolution")


class RELUME_PT_material(bpy.types.Panel):
    """What Blender's material panels lack."""

    bl_label = "Relume"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and context.material is not None

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.material.relume
        layout.prop(settings, "model")
        if settings.model == "MINNAERT":
            layout.prop(settings, "limb")
        if settings.model != MODEL_NAMES[0]:
            layout.label(text="Not in Cycles' renders", icon="INFO")


CLASSES = (
    RELUME_PT_cache,
    RELUME_PT_sampling,
    RELUME_PT_performance,
    RELUME_PT_film,
    RELUME_PT_light,
    RELUME_PT_camera,
    RELUME_PT_material,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
