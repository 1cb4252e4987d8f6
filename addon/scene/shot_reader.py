# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what a shot sees: the views that caching cameras are placed for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .caching_collection_reader import shot_cameras
from .depsgraph_reader import with_render_depsgraph
from .shot import ALL_CAMERAS, ShotChoice
from .view import View
from .view_reader import find_camera, read_view

# A camera that moves is looked through at this many of its frames of the shot, evenly spaced.
SHOT_VIEWS = 8

Frames = NDArray[np.int64]
_NONE: Frames = np.empty(0, dtype=np.int64)


def read_shot(scene: Any, choice: ShotChoice = ALL_CAMERAS) -> tuple[View, ...]:
    """The views of the shot's cameras, never of the caching cameras.

    * All cameras: each at the present frame, and the active one along its way.
    * Cameras by their names: each at the present frame and along its way.
    * The active camera: at the present frame, and along its way; with those that timeline markers
      bind, each over the frames of the shot at which a render would look through it.

    The scene, a `bpy.types.Scene`, has its present frame and active camera again afterwards. Only
    for background use, as `with_render_depsgraph`.

    Raises:
        InputError: there is no such camera, or Relume cannot show one's kind.
    """
    if not shot_cameras(scene):
        raise InputError(f"scene '{scene.name}' has no camera; add one")
    chosen = _chosen(scene, choice)
    with _kept_frame(scene):
        views = [_view(scene, camera) for camera, now, frames in chosen if now or not len(frames)]
        for camera, _now, frames in chosen:
            for frame in _some(frames):
                scene.frame_set(frame)
                view = _view(scene, camera)
                if not any(_same(view, other) for other in views):
                    views.append(view)
    return tuple(views)


def _chosen(scene: Any, choice: ShotChoice) -> list[tuple[Any, bool, Frames]]:
    """Cameras, whether each is looked through now, and at which frames it may stand elsewhere."""
    whole = _frames(scene)
    if choice.names:
        cameras = [find_camera(scene, name) for name in dict.fromkeys(choice.names)]
        wanted = [(camera, True, whole) for camera in cameras]
    elif choice.active:
        wanted = _active(scene, whole)
    else:
        active = scene.camera
        wanted = [(c, True, whole if c == active else _NONE) for c in shot_cameras(scene)]
    return [(c, now, frames if _may_move(c) else _NONE) for c, now, frames in wanted]


def _active(scene: Any, whole: Frames) -> list[tuple[Any, bool, Frames]]:
    """The active camera, and those that markers make active."""
    cameras = shot_cameras(scene)
    bound = _bound(scene, whole)
    found = [(c, c == scene.camera, frames) for c, frames in bound if c in cameras]
    if scene.camera in cameras and not any(now for _, now, _ in found):
        found.insert(0, (scene.camera, True, _NONE if bound else whole))
    if not found:
        name = "none" if scene.camera is None else f"'{scene.camera.name}', none of the shot's"
        raise InputError(
            f"the active camera of scene '{scene.name}' is {name}; make one of these active: "
            + ", ".join(camera.name for camera in cameras)
        )
    return found


def _bound(scene: Any, whole: Frames) -> list[tuple[Any, Frames]]:
    """The cameras that markers bind within the frames, each with its own of them.

    As in Blender: a marker counts until the next one, and the first one before itself too.
    """
    markers = [
        (marker.frame, marker.camera)
        for marker in scene.timeline_markers
        if marker.camera is not None and not marker.camera.hide_render
    ]
    if not markers:
        return []
    markers.sort(key=lambda marker: int(marker[0]))
    last = np.searchsorted([frame for frame, _ in markers], whole, side="right") - 1
    last = np.maximum(last, 0)
    frames: dict[Any, list[Frames]] = {}
    for number, (_, camera) in enumerate(markers):
        if (last == number).any():
            frames.setdefault(camera, []).append(whole[last == number])
    return [(camera, np.concatenate(parts)) for camera, parts in frames.items()]


def _frames(scene: Any) -> Frames:
    return np.arange(scene.frame_start, scene.frame_end + 1, dtype=np.int64)


def _some(frames: Frames) -> list[int]:
    """At most SHOT_VIEWS of them, with the first and the last."""
    if not len(frames):
        return []
    which = np.linspace(0, len(frames) - 1, SHOT_VIEWS).round().astype(int)
    return [int(frame) for frame in frames[np.unique(which)]]


@contextmanager
def _kept_frame(scene: Any) -> Iterator[None]:
    """Put the frame back, and the active camera: markers change it at every render."""
    frame, active = scene.frame_current, scene.camera
    try:
        yield
    finally:
        if scene.frame_current != frame:
            scene.frame_set(frame)
        if scene.camera != active:
            scene.camera = active


def _view(scene: Any, camera: Any) -> View:
    return with_render_depsgraph(scene, lambda depsgraph: read_view(depsgraph, camera))


def _may_move(camera: Any) -> bool:
    """Whether a camera, its lens, or what it hangs on, is animated or constrained."""
    if camera.data.animation_data is not None:
        return True
    obj = camera
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
