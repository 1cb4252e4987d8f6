# SPDX-License-Identifier: GPL-3.0-or-later
"""Place, Bake and Cancel."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..caching.edited_cameras import (
    PLACEMENT_NAME,
    edited_cameras,
    forget_own,
    number_own,
    own_numbers,
)
from ..camplace.camera import CachingCamera
from ..camplace.cameras_file import read_cameras, to_json, write_cameras
from ..errors import InputError
from ..scene.caching_collection_reader import caching_collection, caching_objects, shot_cameras
from ..scene.shot import describe_shot
from ..whole_file import write_errors
from . import job
from .cache_folder import cache_folder
from .cache_state import read_cache_state
from .camera_objects import remove_cameras, show_cameras
from .camera_watch import redraw

TIMER_S = 0.2
# Where the progress and the picture show.
_SHOWING = {"PROPERTIES", "VIEW_3D"}
# Objects and materials that a message names; one line has no room for more.
MOST_NAMED = 3


def _why_not(context: Any) -> str:
    """What is missing before caching cameras can be placed, as one phrase; "" for nothing."""
    scene = context.scene
    if job.current() is not None:
        return "Relume is at work: wait for it, or cancel it"
    if not shot_cameras(scene):
        return "the scene has no camera: add one"
    try:
        cache_folder(scene)
    except InputError as error:
        return str(error)
    return ""


class _JobOperator:
    """What Place and Bake have in common: from a button they are modal, from a script they
    return when the work is done."""

    _timer: Any = None
    _job: job.Job

    @classmethod
    def poll(cls, context: Any) -> bool:
        reason = _why_not(context)
        if reason:
            cls.poll_message_set(reason)  # type: ignore[attr-defined]
        return not reason

    def start(self, scene: Any) -> job.Job:
        """Begin the work; raises InputError."""
        raise NotImplementedError

    def finish(self, scene: Any) -> str:
        """Take over the result; returns what to tell the artist. Raises InputError."""
        raise NotImplementedError

    def execute(self, context: Any) -> set[str]:
        try:
            self._job = self.start(context.scene)
        except InputError as error:
            return self._fail(str(error))
        while not self._job.done:
            self._job.advance()
            time.sleep(TIMER_S)
        return self._end()

    def invoke(self, context: Any, event: Any) -> set[str]:  # noqa: ARG002
        try:
            self._job = self.start(context.scene)
        except InputError as error:
            return self._fail(str(error))
        manager = context.window_manager
        self._timer = manager.event_timer_add(TIMER_S, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0.0, 1.0)
        _show_status(f"Relume: {self._job.label}    Esc: Cancel")
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self._job.stop()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        self._job.advance()
        context.window_manager.progress_update(self._job.fraction)
        redraw(_SHOWING)
        if not self._job.done:
            return {"PASS_THROUGH"}
        self._release(context)
        return self._end()

    def cancel(self, context: Any) -> None:
        """Blender ends the operator itself, for instance to open another file."""
        self._job.stop()
        self._release(context)

    def _release(self, context: Any) -> None:
        manager = context.window_manager
        manager.progress_end()
        if self._timer is not None:
            manager.event_timer_remove(self._timer)
            self._timer = None
        _show_status(None)
        redraw(_SHOWING)

    def _end(self) -> set[str]:
        scene = next((s for s in bpy.data.scenes if s.session_uid == self._job.scene_uid), None)
        if self._job.error == "stopped":
            self.report({"WARNING"}, f"{self._job.label}: stopped")  # type: ignore[attr-defined]
            return {"CANCELLED"}
        if self._job.error or scene is None:
            return self._fail(self._job.error or "the scene is gone")
        try:
            message = self.finish(scene)
        except InputError as error:
            return self._fail(str(error))
        self.report({"INFO"}, message)  # type: ignore[attr-defined]
        redraw(_SHOWING)
        return {"FINISHED"}

    def _fail(self, message: str) -> set[str]:
        self.report({"ERROR"}, message)  # type: ignore[attr-defined]
        return {"CANCELLED"}


def _place_step(scene: Any) -> job.Step:
    settings = scene.relume
    arguments = ["--out", str(cache_folder(scene) / PLACEMENT_NAME)]
    if settings.budget == "PICTURES":
        arguments += ["--max-pictures", str(settings.max_pictures)]
    elif settings.budget == "MEMORY":
        arguments += ["--max-megabytes", str(settings.max_megabytes)]
    else:
        arguments += ["--primaries", str(settings.primaries)]
        arguments += ["--secondaries", str(settings.secondaries)]
    arguments += ["--preset", settings.preset]
    # Blender keeps a float32: to its own digits it is what the artist set.
    arguments += ["--view-share", f"{settings.shot_share:.6g}"]
    if settings.shot == "ACTIVE":
        arguments.append("--active-camera")
    placement = cache_folder(scene) / PLACEMENT_NAME
    if settings.keep_cameras and placement.exists():
        arguments += ["--keep-from", str(placement)]
    if settings.box_object is not None:
        arguments += ["--box-object", settings.box_object.name]
    return "place", arguments


def _write_edits(scene: Any, placement: Path) -> None:
    """Put what the artist did to the cameras in the scene into the file that Bake reads."""
    collection = caching_collection(scene)
    if collection is None:
        return
    placed = read_cameras(placement) if placement.exists() else ()
    number_own(collection, placed)
    state = read_cache_state(scene)
    graph = bpy.context.evaluated_depsgraph_get()
    edited = edited_cameras(graph, scene, placed, state.largest, state.cameras)
    if edited is None or to_json(edited) == to_json(placed):
        return
    with write_errors(placement.parent, "choose another folder"):
        placement.parent.mkdir(parents=True, exist_ok=True)
    write_cameras(placement, edited)


class RELUME_OT_place(_JobOperator, bpy.types.Operator):
    """Starts camera placement, and shows its result."""

    bl_idname = "relume.place"
    bl_label = "Place"
    bl_description = (
        "Find places for the caching cameras, within the budget, and show them in the scene. The "
        "message says how much they see of what the shot's views see, and views moved by up to a "
        "tenth of their viewing distance"
    )
    bl_options = {"REGISTER", "UNDO"}

    def start(self, scene: Any) -> job.Job:
        placement = cache_folder(scene) / PLACEMENT_NAME
        if caching_objects(scene):
            # What the artist did is where the new placement starts from.
            _write_edits(scene, placement)
        self._before = read_cameras(placement) if placement.exists() else ()
        steps = [_place_step(scene)]
        return job.start("Placing caching cameras", scene, cache_folder(scene), steps)

    def finish(self, scene: Any) -> str:
        cameras = read_cameras(cache_folder(scene) / PLACEMENT_NAME)
        self._show(scene, cameras)
        result = self._job.result
        message = f"Placed {len(cameras)} caching cameras"
        if result.get("shot"):
            message += f" for {describe_shot(result['shot'])}"
        if result.get("kept"):
            message += f", {result['kept']} of them kept"
        seen = result.get("seen", {}).get("by_view", float("nan"))
        if not np.isnan(seen):
            message += f"; they see {100.0 * seen:.1f} % of what these, and views near them, see"
        return message

    def _show(self, scene: Any, cameras: Sequence[CachingCamera]) -> None:
        """The artist's own cameras stay, whether they were kept or not, and are shown once."""
        collection = caching_collection(scene)
        own = frozenset() if collection is None else own_numbers(collection)
        before = {camera.id: camera.world_from_camera for camera in self._before}
        kept = {
            camera.id
            for camera in cameras
            if camera.id in own & before.keys()
            and np.array_equal(camera.world_from_camera, before[camera.id])
        }
        collection = show_cameras(scene, [c for c in cameras if c.id not in kept])
        forget_own(collection, own - kept)


class RELUME_OT_bake(_JobOperator, bpy.types.Operator):
    """Starts the bake."""

    bl_idname = "relume.bake"
    bl_label = "Bake"
    bl_description = (
        "Have Cycles bake the caching cameras that Place put, in the background; without any they "
        "are placed first. Cameras that are baked already, and see nothing that changed since, are "
        "kept"
    )
    bl_options = {"REGISTER"}

    def start(self, scene: Any) -> job.Job:
        folder = cache_folder(scene)
        placement = folder / PLACEMENT_NAME
        _write_edits(scene, placement)
        steps = [] if placement.exists() else [_place_step(scene)]
        # The artist's own folder: what an older state of the scene left there is replaced.
        arguments = ["--cache", str(folder), "--placement", str(placement)]
        arguments += ["--preset", scene.relume.preset, "--resume", "--overwrite"]
        return job.start("Baking", scene, folder, [*steps, ("bake", arguments)])

    def finish(self, scene: Any) -> str:
        result = self._job.result
        message = f"Baked {result.get('baked', 0)} cameras into {cache_folder(scene)}"
        if result.get("kept"):
            message += f", kept {result['kept']}"
        if changed := result.get("changed"):
            more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
            message += f"; changed: {', '.join(changed[:MOST_NAMED])}{more}"
        if result.get("approximations"):
            message += f"; {len(result['approximations'])} approximations, listed in the panel"
        return message


class RELUME_OT_cancel(bpy.types.Operator):
    """Stops the job under way."""

    bl_idname = "relume.cancel"
    bl_label = "Cancel"
    bl_description = "Stop the work. Cameras that are finished stay in the cache"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: Any) -> bool:  # noqa: ARG003
        return job.current() is not None

    def execute(self, context: Any) -> set[str]:  # noqa: ARG002
        job.stop_current()
        redraw(_SHOWING)
        return {"FINISHED"}


class RELUME_OT_hide_cameras(bpy.types.Operator):
    """Switches the eye of the caching cameras' collection."""

    bl_idname = "relume.hide_cameras"
    bl_label = "Hide or Show Caching Cameras"
    bl_description = "Hide the caching cameras in the viewports, or show them again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return camera_layer(context) is not None

    def execute(self, context: Any) -> set[str]:
        layer = camera_layer(context)
        if layer is None:
            return {"CANCELLED"}
        layer.hide_viewport = not layer.hide_viewport
        return {"FINISHED"}


class RELUME_OT_remove_cameras(bpy.types.Operator):
    """Removes what Place shows."""

    bl_idname = "relume.remove_cameras"
    bl_label = "Remove Caching Cameras"
    bl_description = (
        "Take the caching cameras, and those added to them, out of the scene. "
        "The cache keeps what is baked"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return caching_collection(context.scene) is not None

    def execute(self, context: Any) -> set[str]:
        remove_cameras(context.scene)
        return {"FINISHED"}


def camera_layer(context: Any) -> Any | None:
    """The caching cameras' collection as the view layer has it; None without one."""
    collection = caching_collection(context.scene)
    layers = [context.view_layer.layer_collection]
    while layers:
        layer = layers.pop()
        if layer.collection == collection:
            return layer
        layers.extend(layer.children)
    return None


def _show_status(text: str | None) -> None:
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(text)


CLASSES = (
    RELUME_OT_place,
    RELUME_OT_bake,
    RELUME_OT_cancel,
    RELUME_OT_hide_cameras,
    RELUME_OT_remove_cameras,
)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    _register_classes()


def unregister() -> None:
    """A job under way is stopped."""
    job.stop_current()
    _unregister_classes()
