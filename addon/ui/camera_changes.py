# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells what became of the caching cameras in the scene since a cache was baked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ..caching.edited_cameras import edited_cameras
from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..scene.caching_collection_reader import caching_objects


def camera_changes(
    depsgraph: Any,
    scene: Any,
    placed: Sequence[CachingCamera],
    baked: Sequence[CachingCamera],
    largest: int,
) -> str:
    """One sentence about the scene's caching cameras that are not as baked; "" where all are.

    Panels ask for it at every drawing: it compares numbers, and evaluates nothing.

    Args:
        depsgraph: the scene's, as it was evaluated last.
        scene: a `bpy.types.Scene`.
        placed: those of the placement's file, from which the next bake numbers and reads them.
        baked: the cache's cameras.
        largest: the resolution that the cache's preset allows.
    """
    if not baked or not caching_objects(scene):
        return ""
    try:
        cameras = edited_cameras(depsgraph, scene, placed, largest, baked) or ()
    except InputError as error:
        return str(error)
    known = {camera.id: camera.to_json() for camera in baked}
    fitted = [replace(c, resolution=min(c.resolution, largest)).to_json() for c in cameras]
    changed = sum(camera != known.get(camera["id"]) for camera in fitted)
    deleted = len(known.keys() - {camera.id for camera in cameras})
    plural = "" if deleted == 1 else "s"
    said = []
    if changed:
        said.append(f"{changed} of {len(cameras)} caching cameras changed")
    if deleted:
        said.append(
            f"{deleted} deleted" if changed else f"{deleted} caching camera{plural} deleted"
        )
    return f"{' and '.join(said)} since the bake: Bake again" if said else ""
