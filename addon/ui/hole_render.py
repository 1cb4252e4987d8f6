# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the holes of a final render before it is drawn."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import bpy

from ..camplace.hole_cameras import hole_cameras
from ..errors import InputError
from ..progress import Progress
from ..scene.view import View
from . import hole_job
from .hole_filler import LEAST_OPEN

if TYPE_CHECKING:
    from .scene_session import SceneSession

_TICK_S = 0.1
# The interface answers within a moment, unless a script keeps it busy.
_PATIENCE_S = 20.0


def fill_for_render(scene: Any, opened: SceneSession, view: View, progress: Progress) -> str:
    """Have what the cache lacks of a view baked, and read it.

    Args:
        scene: the original `bpy.types.Scene`.
        opened: the render's own session, at this view.
        view: that is rendered.
        progress: is told how far it is, and may raise Cancelled, which ends the work.

    Returns:
        Why it could not be done, as one sentence; "" where it was, or there was nothing to do.
    """
    if opened.session.coverage.open_fraction < LEAST_OPEN:
        return ""
    if opened.stale:
        return "its holes were not filled, since the cache is of the scene as it was: bake again"
    cameras = hole_cameras(view, opened.session.hole_points())
    try:
        job = _started(lambda: hole_job.start(scene, opened.folder, cameras))
    except InputError as error:
        return f"its holes were not filled: {error}"
    try:
        while not job.done:
            progress(job.fraction, f"Filling holes: {job.message}")
            time.sleep(_TICK_S)
            job.advance()
    except BaseException:
        job.stop()
        raise
    if job.error:
        return f"its holes were not filled: {job.error}"
    opened.follow_filled()
    return ""


def _started(start: Any) -> hole_job.HoleJob:
    """Start a job from the thread that may save a copy of the file, and wait for that: renders of
    the interface run in another one. Raises InputError."""
    if threading.current_thread() is threading.main_thread():
        started: hole_job.HoleJob = start()
        return started
    answer: list[hole_job.HoleJob | InputError] = []
    ready = threading.Event()

    given_up = threading.Event()

    def run() -> None:
        if given_up.is_set():
            return
        try:
            answer.append(start())
        except InputError as error:
            answer.append(error)
        ready.set()
        # Nobody follows it any more.
        if given_up.is_set() and isinstance(answer[0], hole_job.HoleJob):
            answer[0].stop()

    bpy.app.timers.register(run)
    if not ready.wait(_PATIENCE_S):
        given_up.set()
    if not ready.is_set():
        raise InputError("Blender's interface did not answer; render again")
    if isinstance(answer[0], InputError):
        raise answer[0]
    return answer[0]
