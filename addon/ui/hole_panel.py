# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties › Render › Holes: whether they are filled, and what becomes of what was baked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..caching.edited_cameras import PLACEMENT_NAME, own_numbers
from ..caching.store import CacheStore
from ..caching.temporary_store import discard_all, temporary_pictures, temporary_stores
from ..camplace.camera import CachingCamera
from ..camplace.cameras_file import read_cameras, write_cameras
from ..errors import InputError
from ..scene.caching_collection_reader import caching_collection
from . import hole_job, job
from .cache_folder import cache_folder
from .camera_objects import add_camera
from .camera_watch import redraw
from .render_panel import RenderPanel

_SHOWING = {"PROPERTIES", "VIEW_3D"}


def _pictures(scene: Any) -> tuple[int, int]:
    """How many temporary pictures there are beside the scene's cache, and their bytes."""
    try:
        return temporary_pictures(cache_folder(scene))
    except InputError:
        return 0, 0


class RELUME_OT_keep_filled(bpy.types.Operator):
    """Makes the temporary pictures part of the cache."""

    bl_idname = "relume.keep_filled"
    bl_label = "Keep in Cache"
    bl_description = (
        "Keep what was baked for holes: its cameras join the caching cameras, and serve every view"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        if job.current() is not None:
            cls.poll_message_set("Relume is at work: wait for it, or cancel it")
            return False
        return _pictures(context.scene)[0] > 0

    def execute(self, context: Any) -> set[str]:
        scene = context.scene
        count = 0
        try:
            folder = cache_folder(scene)
            for store in temporary_stores(CacheStore.open(folder)):
                kept = store.keep(taken=_numbers(scene, _placed(folder)))
                # At once: whatever happens to the next, these are in the cache.
                _place(scene, folder, kept)
                count += len(kept)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"FINISHED"} if count else {"CANCELLED"}
        plural = "" if count == 1 else "s"
        self.report({"INFO"}, f"The cache has {count} more caching camera{plural}")
        redraw(_SHOWING)
        return {"FINISHED"}


def _placed(folder: Path) -> tuple[CachingCamera, ...]:
    """What Place found last; nothing where a cache was baked otherwise."""
    placement = folder / PLACEMENT_NAME
    return read_cameras(placement) if placement.exists() else ()


def _numbers(scene: Any, placed: Sequence[CachingCamera]) -> set[int]:
    """Of the cameras that the next bake takes."""
    collection = caching_collection(scene)
    own = frozenset() if collection is None else own_numbers(collection)
    return {*own, *(camera.id for camera in placed)}


def _place(scene: Any, folder: Path, kept: Sequence[CachingCamera]) -> None:
    """Put kept cameras among those that the next bake takes, and show them with these."""
    placed = _placed(folder)
    if placed and kept:
        write_cameras(folder / PLACEMENT_NAME, (*placed, *kept))
    for camera in kept:
        add_camera(scene, camera)


class RELUME_OT_discard_filled(bpy.types.Operator):
    """Removes the temporary pictures."""

    bl_idname = "relume.discard_filled"
    bl_label = "Discard"
    bl_description = "Let what was baked for holes go; views that need it have it baked again"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return _pictures(context.scene)[0] > 0

    def execute(self, context: Any) -> set[str]:
        discard_all(cache_folder(context.scene))
        redraw(_SHOWING)
        return {"FINISHED"}


class RELUME_PT_holes(RenderPanel, bpy.types.Panel):
    """What the cache does not show of a view."""

    bl_label = "Holes"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.relume, "fill_holes")
        row = layout.row()
        row.active = context.scene.relume.fill_holes
        row.prop(context.scene.relume, "sharpen_views")
        layout.prop(context.scene.relume, "show_confidence")
        running = hole_job.current()
        if running is not None:
            layout.progress(factor=running.fraction, text=running.message)
        count, size = _pictures(context.scene)
        if count:
            plural = "" if count == 1 else "s"
            layout.label(text=f"{count} temporary picture{plural} ({size / 2**20:.1f} MB)")
            row = layout.row(align=True)
            row.operator("relume.keep_filled", icon="FILE_TICK")
            row.operator("relume.discard_filled", icon="TRASH")


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _end(*_args: Any) -> None:
    """Another file is opened: what was baked for this one's holes goes."""
    hole_job.stop_current(waits=True)
    for folder in hole_job.filled_folders():
        discard_all(folder)


CLASSES = (RELUME_OT_keep_filled, RELUME_OT_discard_filled, RELUME_PT_holes)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(_end)
    if hasattr(bpy.app.handlers, "exit_pre"):
        bpy.app.handlers.exit_pre.append(_end)


def unregister() -> None:
    """A job under way is stopped."""
    hole_job.stop_current(waits=True)
    for name in ("load_pre", "exit_pre"):
        handlers = getattr(bpy.app.handlers, name, [])
        if _end in handlers:  # a script may have cleared the list
            handlers.remove(_end)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
