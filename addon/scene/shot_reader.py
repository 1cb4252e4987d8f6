# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what a shot sees: the views that caching cameras are placed for."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from .caching_collection_reader import shot_cameras
from .depsgraph_reader import with_render_depsgraph
from .view import View
from .view_reader import read_view

# An animated camera is looked through at this many frames of the shot, evenly spaced.
SHOT_VIEWS = 8


def read_shot(scene: Any) -> tuple[View, ...]:
    """Every camera's view at the present frame, and a moving active camera's along its way;
    without the caching cameras.

    The scene, a `bpy.types.Scene`, is at its present frame again afterwards. Only for
    background use, as `with_render_depsgraph`.

    Raises:
        InputError: there is no camera, or Relume cannot show one's kind.
    """
    cameras = shot_cameras(scene)
    if not cameras:
        raise InputError(f"scene '{scene.name}' has no camera; add one")
    views = [_view(scene, camera) for camera in cameras]
    active = scene.camera
    if active not in cameras or not _may_move(active):
        return tuple(views)
    present = scene.frame_current
    frames = np.linspace(scene.frame_start, scene.frame_end, SHOT_VIEWS).round().astype(int)
    try:
        for frame in dict.fromkeys(frames.tolist()):
            scene.frame_set(frame)
            view = _view(scene, active)
            if not any(_same(view, other) for other in views):
                views.append(view)
    finally:
        scene.frame_set(present)
    return tuple(views)


def _view(scene: Any, camera: Any) -> View:
    return with_render_depsgraph(scene, lambda depsgraph: read_view(depsgraph, camera))


def _may_move(obj: Any) -> bool:
    """Whether an object, or what it hangs on, is animated or constrained."""
    while obj is not None:
        if obj.animation_data is not None or obj.constraints:
            return True
        obj = obj.parent
    return False


def _same(a: View, b: View) -> bool:
    return bool(
        np.array_equal(a.world_from_camera, b.world_from_camera)
        and np.array_equal(a.clip_from_camera, b.clip_from_camera)
    )
