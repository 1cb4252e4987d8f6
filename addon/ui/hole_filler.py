# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the holes of what a viewport shows, and sharpens it, once it stands still.

What the cache lacks is shown with its materials' means meanwhile. Drawing has a GPU context and may
run no operator; a timer is the other way round. So a drawing finds the holes and places cameras, a
timer saves a copy of the file and follows the process, and the next drawing takes what it baked.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..camplace.camera import CachingCamera
from ..camplace.hole_cameras import hole_cameras
from ..errors import InputError
from ..scene.view import View, same_view
from . import hole_job, job
from .camera_watch import redraw
from .event_loop import call_later
from .lacking_points import label, lacking_points
from .scene_changes import SceneChanges

if TYPE_CHECKING:
    from .scene_session import SceneSession

# The view has to stand still for so long, in seconds.
STILL_S = 0.8

_TICK_S = 0.2
_SHOWING = {"VIEW_3D", "PROPERTIES"}


class HoleFiller:
    """Follows one viewport.

    Attributes:
        note: what its view lacks still once that is baked, as one sentence; "" for nothing.

    Args:
        clock: seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._view: View | None = None
        self._since = 0.0
        # Whether what is soft was asked for too; None before anything was asked for a view.
        self._asked: bool | None = None
        self._wanted: tuple[int, Path, tuple[CachingCamera, ...]] | None = None
        self._job: hole_job.HoleJob | None = None
        # Whether a final render, or another viewport's holes, took the place of that job.
        self._gave_way = False
        self._label = self.note = ""
        self._error = ""
        # Blender knows a timer's function by its identity, and a method has a new one each time.
        self._timer = self._tick

    def note_change(self, changes: SceneChanges) -> None:
        """The scene changed: what is being baked may be of no use, and what failed may work."""
        if changes.geometry or changes.materials:
            self._drop()
            self._asked, self._since = None, self._clock()

    def follow(self, scene: Any, opened: SceneSession, view: View, *, is_whole: bool) -> None:
        """To be called at each drawing, after the session's.

        Args:
            scene: a `bpy.types.Scene`, the original one.
            opened: what is drawn.
            view: that is drawn.
            is_whole: whether the session is at this very view, and has a picture of it.
        """
        if self._view is None or not same_view(view, self._view):
            self._drop()
            self._view, self._since = view, self._clock()
            self._asked, self._error, self.note = None, "", ""
        if not scene.relume.fill_holes:
            self._drop()
            self._asked, self.note = None, ""
            return
        if self._asked is not None and scene.relume.sharpen_views != self._asked:
            # What is baked for the holes alone would be too coarse, and with what is soft too long.
            self._drop()
            self._asked = None
        if self._asked is not None or not is_whole or opened.stale:
            return
        if self._clock() - self._since < STILL_S:
            call_later(self._look_again, STILL_S)
            return
        self._asked = scene.relume.sharpen_views
        points = lacking_points(scene, opened.session)
        if points is None:
            return
        found = hole_cameras(view, points)
        if found.cameras:
            self._label, self.note = label(points).lower(), found.note
            self._wanted = (scene.session_uid, opened.folder, found.cameras)
            call_later(self._timer, 0.0)

    @property
    def status(self) -> str:
        """What the status line says of it, as one phrase; "" for nothing."""
        if self._job is not None and not self._job.done:
            return f"{self._label}, {100.0 * self._job.fraction:.0f} %"
        if self._wanted is not None:
            return self._label
        return f"{self._label} failed: {self._error}" if self._error else ""

    def _drop(self) -> None:
        """Forget what was wanted, and end what is under way for it."""
        self._wanted = None
        self._gave_way = False
        if self._job is not None and not self._job.done:
            self._job.stop()
        self._job = None

    @staticmethod
    def _look_again() -> None:
        redraw(_SHOWING)

    def _tick(self) -> float | None:
        if self._wanted is not None and self._job is None:
            if _others_are_at_work():
                return _TICK_S
            if self._gave_way:
                # What it finished, and what was baked in its place, may be of this view: the next
                # drawing asks for what is still open.
                self._drop()
                self._asked = None
                redraw(_SHOWING)
                return None
            self._start(*self._wanted)
        if self._job is None:
            return None
        self._job.advance()
        redraw(_SHOWING)
        if not self._job.done:
            return _TICK_S
        if self._job.is_superseded:
            self._job, self._gave_way = None, True
            return _TICK_S
        self._error = self._job.error
        self._wanted = None
        return None

    def _start(self, uid: int, folder: Path, cameras: tuple[CachingCamera, ...]) -> None:
        scene = next((s for s in bpy.data.scenes if s.session_uid == uid), None)
        if scene is None:
            self._wanted = None
            return
        try:
            self._job = hole_job.start(scene, folder, cameras)
        except InputError as error:
            self._error, self._wanted = str(error), None


def _others_are_at_work() -> bool:
    """Whether something comes first: Place or Bake, after which there may be no holes; another
    viewport's; or a final render, each picture of which may have its own baked."""
    if job.current() is not None or hole_job.current() is not None:
        return True
    return bool(bpy.app.is_job_running("RENDER"))
