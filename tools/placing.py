# SPDX-License-Identifier: GPL-3.0-or-later
"""The views that caching cameras are placed for, and the artist's weights."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

from .relit import camera_names, read_views

# An animated camera is looked through at this many frames of the shot, evenly spaced.
SHOT_VIEWS = 8


def shot_views(scene: Any) -> tuple[View, ...]:
    """What the shot sees: every camera at the present frame, and a moving one along its way.

    The scene, a `bpy.types.Scene`, is at its present frame again afterwards.

    Raises:
        InputError: there is no camera.
    """
    views = list(read_views(scene, camera_names(scene)))
    active = scene.camera
    if active is None or not _may_move(active):
        return tuple(views)
    present = scene.frame_current
    frames = np.linspace(scene.frame_start, scene.frame_end, SHOT_VIEWS).round().astype(int)
    try:
        for frame in dict.fromkeys(frames.tolist()):
            scene.frame_set(frame)
            view = read_views(scene, [active.name])[0]
            if not any(_same(view, other) for other in views):
                views.append(view)
    finally:
        scene.frame_set(present)
    return tuple(views)


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


def read_weights(path: Path) -> Mapping[str, float]:
    """Read a weights file: {"name of an object or a material": 0 to 1}.

    Raises:
        InputError: it is missing or not such a file.
    """
    try:
        weights = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path.") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}); correct it.") from None
    if not isinstance(weights, dict):
        raise InputError(f"{path} is not a JSON object of names and weights; correct it.")
    for name, weight in weights.items():
        number = isinstance(weight, int | float) and not isinstance(weight, bool)
        if not number or not 0.0 <= weight <= 1.0:
            raise InputError(f"{path}: the weight of '{name}' is not a number from 0 to 1.")
    return weights


def with_weights(geometry: SceneGeometry, weights: Mapping[str, float]) -> SceneGeometry:
    """The same triangles with the weights of the named objects and materials (their product).

    Raises:
        InputError: a name is neither an object's nor a material's.
    """
    unknown = set(weights) - set(geometry.object_names) - set(geometry.material_names)
    if unknown:
        raise InputError(
            f"There is no object or material '{min(unknown)}' to weight; check the name."
        )
    by_object = np.array([weights.get(name, 1.0) for name in geometry.object_names])
    by_material = np.array([weights.get(name, 1.0) for name in geometry.material_names])
    factor = by_object[geometry.object_id] * by_material[geometry.material_id]
    return replace(geometry, weight=(geometry.weight * factor).astype(np.float32))
