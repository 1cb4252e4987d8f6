# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's motion blur settings and what moves while the shutter is open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .exposure import Exposure
from .geometry import SceneGeometry
from .render_region import RenderRegion
from .view import View
from .view_reader import read_view

# Evaluates the scene at a frame and a part of one, and reads from that.
ReadAt = Callable[[float, Callable[[Any], Any]], Any]

# As Blender's own limit for a camera or object is seven, which would be 129 readings of the scene.
_MOST_STEPS = 3

# Points of the shutter's curve: Cycles' own table has as many.
_CURVE_POINTS = 256

# Modifiers that bend a shape from frame to frame.
_DEFORMING = {"ARMATURE", "CLOTH", "CURVE", "HOOK", "LATTICE", "MESH_CACHE", "MESH_DEFORM",
              "MESH_SEQUENCE_CACHE", "OCEAN", "SHRINKWRAP", "SOFT_BODY", "WAVE"}  # fmt: skip

_Key = tuple[str, str, int]


def read_exposure(
    scene: Any,
    camera: Any,
    view: View,
    geometry: SceneGeometry,
    read_at: ReadAt,
    *,
    region: RenderRegion | None = None,
) -> Exposure | None:
    """What moves while the shutter is open at the scene's frame; None without motion blur.

    Args:
        scene: whose render settings say how long the shutter is open.
        camera: the camera object.
        view: of that camera at the frame.
        geometry: read at the frame.
        read_at: called for each step; it leaves the scene at that frame, and the caller puts it
            back.
        region: what `view` is of the camera's picture; None for all.
    """
    render = scene.render
    if not render.use_motion_blur:
        return None
    frame, shutter = float(scene.frame_current_final), float(render.motion_blur_shutter)
    # Where the middle of the exposure lies, as Cycles has it.
    middle = (
        scene.frame_current_final
        + {"START": 0.5, "CENTER": 0.0, "END": -0.5}[render.motion_blur_position] * shutter
    )
    warnings = _unblurred(scene)
    count = 2 ** _steps(scene) + 1
    views, poses = [], []
    place = partial(_place, camera=camera, view=view, region=region)
    for step in middle + shutter * np.linspace(-0.5, 0.5, count):
        at = read_at(float(step), lambda graph: (place(graph), _matrices(graph)))
        views.append(at[0])
        poses.append(at[1])
    frame_poses = read_at(frame, _matrices)
    objects, matrices, reference = _moving(geometry, frame_poses, poses)
    still = all(
        np.array_equal(other.world_from_camera, view.world_from_camera)
        and np.array_equal(other.clip_from_camera, view.clip_from_camera)
        for other in views
    )
    return Exposure(
        (view,) if still else tuple(views),
        objects,
        matrices,
        reference,
        _open_share(render.motion_blur_shutter_curve),
        tuple(warnings),
    )


def _place(depsgraph: Any, camera: Any, view: View, region: RenderRegion | None) -> View:
    if region is None:
        return read_view(depsgraph, camera, view.width, view.height)
    return region.of(read_view(depsgraph, camera, region.width, region.height))


def _matrices(depsgraph: Any) -> dict[_Key, NDArray[np.float64]]:
    """The matrix of each instance, by its instancer's and its own name and a number.

    Those whose motion is not to be blurred are left out.
    """
    seen: Counter[tuple[str, str]] = Counter()
    result = {}
    for instance in depsgraph.object_instances:
        if not instance.show_self:
            continue
        original = instance.object.original
        parent = instance.parent.original.name_full if instance.is_instance else ""
        names = (parent, original.name_full)
        number = seen[names]
        seen[names] += 1
        if getattr(getattr(original, "cycles", None), "use_motion_blur", True):
            result[*names, number] = np.array(instance.matrix_world, dtype=np.float64)
    return result


def _moving(
    geometry: SceneGeometry,
    reference: dict[_Key, NDArray[np.float64]],
    steps: list[dict[_Key, NDArray[np.float64]]],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Which of the geometry's objects move, where they are at the steps and in the frame."""
    seen: Counter[tuple[str, str]] = Counter()
    moving, matrices, references = [], [], []
    for index, names in enumerate(geometry.full_names):
        key = (*names, seen[names])
        seen[names] += 1
        there = [pose[key] for pose in steps if key in pose]
        at_frame = reference.get(key)
        if at_frame is None or len(there) < len(steps):
            continue
        if all(np.array_equal(matrix, at_frame) for matrix in there):
            continue
        # Without a size it has no triangles either.
        if np.linalg.det(at_frame[:3, :3]) == 0.0:
            continue
        moving.append(index)
        matrices.append(there)
        references.append(at_frame)
    shape = (len(moving), len(steps), 4, 4)
    return (
        np.array(moving, dtype=np.int64),
        np.array(matrices, dtype=np.float64).reshape(shape).swapaxes(0, 1),
        np.array(references, dtype=np.float64).reshape(-1, 4, 4),
    )


def _steps(scene: Any) -> int:
    """Blender's "steps" of what has most of them: 2^steps stretches of time."""
    found = [int(getattr(getattr(obj, "cycles", None), "motion_steps", 1)) for obj in scene.objects]
    return min(max(found, default=1), _MOST_STEPS)


def _open_share(curve: Any) -> NDArray[np.float64]:
    """(T,) how much of the light has come in at even times, from 0 to 1."""
    curve.initialize()
    times = (np.arange(_CURVE_POINTS) + 0.5) / _CURVE_POINTS
    opened = np.array([max(curve.evaluate(curve.curves[0], float(time)), 0.0) for time in times])
    if not opened.any():
        opened[:] = 1.0
    return np.concatenate([[0.0], np.cumsum(opened)]) / opened.sum()


def _unblurred(scene: Any) -> list[str]:
    """A sentence for each thing that moves and is shown as in the frame."""
    warnings = []
    rolling = getattr(getattr(scene, "cycles", None), "rolling_shutter_type", "NONE")
    if rolling != "NONE":
        warnings.append("rolling shutter is not shown: all rows of the picture are exposed at once")
    bent = sorted(obj.name for obj in scene.objects if _deforms(obj))
    if bent:
        names = ", ".join(f"'{name}'" for name in bent[:5]) + (" …" if len(bent) > 5 else "")
        warnings.append(
            f"motion blur of shapes that deform is not shown; they move as a whole: {names}"
        )
    return warnings


def _deforms(obj: Any) -> bool:
    cycles = getattr(obj, "cycles", None)
    if cycles is not None and not (cycles.use_motion_blur and cycles.use_deform_motion):
        return False
    keys = getattr(obj.data, "shape_keys", None)
    if keys is not None and keys.animation_data is not None:
        return True
    return any(modifier.type in _DEFORMING and modifier.show_render for modifier in obj.modifiers)
