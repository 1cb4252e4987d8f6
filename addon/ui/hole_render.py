# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the holes of a final render before it is drawn."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from ..camplace.hole_cameras import hole_cameras
from ..errors import InputError
from ..progress import Progress
from ..scene.view import View
from . import hole_job
from .lacking_points import label, lacking_points
from .main_thread import MainThread

if TYPE_CHECKING:
    from .scene_session import SceneSession

_TICK_S = 0.1


def fill_for_render(
    scene: Any, opened: SceneSession, view: View, progress: Progress, main: MainThread
) -> str:
    """Have what the cache lacks of a view baked, and read it.

    Args:
        scene: the original `bpy.types.Scene`.
        opened: the render's own session, at this view.
        view: that is rendered.
        progress: is told how far it is, and may raise Cancelled, which ends the work.
        main: does what draws, and what needs Blender's operators.

    Returns:
        Why it could not be done, or not for all of the view, as one sentence; "" where it was, or
        there was nothing to do.
    """
    points = main.do(lambda: lacking_points(scene, opened.session))
    if points is None:
        return ""
    found = hole_cameras(view, points)
    if not found.cameras:
        return ""
    missed = "its holes were not filled" if points.is_soft is None else "it was not sharpened"
    if opened.stale:
        return f"{missed}, since the cache is of the scene as it was: bake again"
    try:
        job = main.do(lambda: hole_job.start(scene, opened.folder, found.cameras))
    except InputError as error:
        return f"{missed}: {error}"
    try:
        while not job.done:
            progress(job.fraction, f"{label(points)}: {job.message}")
            time.sleep(_TICK_S)
            job.advance()
    except BaseException:
        job.stop()
        raise
    if job.error:
        return f"{missed}: {job.error}"
    main.do(opened.follow_filled)
    return found.note
