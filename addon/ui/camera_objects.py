# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras as camera objects, which the artist may move, change, add and delete.

They lie in a collection of their own that is not rendered. `scene.caching_collection_reader`
tells them from the shot's cameras, which stay the only ones that are lit for. The six faces of a
cube camera hang on an empty, and move with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import mathutils

from ..caching.edited_cameras import drawn_resolution
from ..camplace.camera import CachingCamera
from ..scene.caching_collection_reader import CACHING_MARK, caching_collection

COLLECTION = "Relume Cameras"
# The drawn pyramid's height, as a share of the distance that the camera sees to.
DRAWN_SHARE = 0.04


def show_cameras(scene: Any, cameras: Sequence[CachingCamera]) -> Any:
    """Put one camera object for each caching camera into the collection; returns it.

    Those that were put there before are replaced; what the artist added stays. Nothing is
    selected, and the scene's active camera stays the one that it is.
    """
    collection = caching_collection(scene) or _new_collection(scene)
    _remove([obj for obj in collection.all_objects if CACHING_MARK in obj])
    pivots: dict[int, Any] = {}
    for camera in cameras:
        obj = _camera_object(camera)
        collection.objects.link(obj)
        if camera.kind == "CUBE_FACE":
            if camera.source not in pivots:
                pivots[camera.source] = _pivot(camera)
                collection.objects.link(pivots[camera.source])
            _hang(obj, camera, pivots[camera.source])
    return collection


def add_camera(scene: Any, camera: CachingCamera) -> None:
    """Put one more camera object into the collection, if there is one; the others stay."""
    collection = caching_collection(scene)
    if collection is not None:
        collection.objects.link(_camera_object(camera))


def remove_cameras(scene: Any) -> None:
    """Take the collection and all that is in it alone out of the file."""
    collection = caching_collection(scene)
    if collection is None:
        return
    inside = {collection, *collection.children_recursive}
    _remove([obj for obj in collection.all_objects if inside.issuperset(obj.users_collection)])
    for inner in inside:
        bpy.data.collections.remove(inner)


def _new_collection(scene: Any) -> Any:
    collection = bpy.data.collections.new(COLLECTION)
    collection[CACHING_MARK] = True
    collection.hide_render = True
    collection.color_tag = "COLOR_05"
    scene.collection.children.link(collection)
    return collection


def _remove(objects: Sequence[Any]) -> None:
    for obj in objects:
        data = obj.data
        bpy.data.objects.remove(obj)
        if isinstance(data, bpy.types.Camera) and data.users == 0:
            bpy.data.cameras.remove(data)


def _drawn_depth(camera: CachingCamera) -> float:
    return DRAWN_SHARE * camera.far


def _camera_object(camera: CachingCamera) -> Any:
    kind = "Cube" if camera.kind == "CUBE_FACE" else "View"
    name = f"Relume {camera.id:04d} {kind} {camera.source}"
    data = bpy.data.cameras.new(name)
    # Blender fits a picture's longer side to the angle, so the square holds the drawn frame.
    data.sensor_fit = "AUTO"
    data.angle = camera.fov
    data.clip_start, data.clip_end = camera.near, camera.far
    data.display_size = 2.0 * _drawn_depth(camera) * camera.half_extent
    data.relume.resolution = str(drawn_resolution(camera.resolution))
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = mathutils.Matrix(camera.world_from_camera.tolist())
    obj.hide_render = True
    obj.show_in_front = True  # most stand inside rooms
    obj.lock_scale = (True, True, True)
    obj[CACHING_MARK] = camera.id
    return obj


def _pivot(camera: CachingCamera) -> Any:
    """What the faces of a cube camera hang on."""
    obj = bpy.data.objects.new(f"Relume Cube {camera.source}", None)
    obj.empty_display_type = "CUBE"
    obj.empty_display_size = 0.5 * _drawn_depth(camera)
    obj.location = camera.origin.tolist()
    obj.hide_render = True
    obj.show_in_front = True  # most stand inside rooms
    obj.lock_scale = (True, True, True)
    obj[CACHING_MARK] = "cube"
    return obj


def _hang(face: Any, camera: CachingCamera, pivot: Any) -> None:
    """A face keeps its transform in world space as its own, so it stays when the empty goes."""
    face.parent = pivot
    face.matrix_parent_inverse = mathutils.Matrix.Translation(camera.origin.tolist()).inverted()
    face.lock_location = face.lock_rotation = (True, True, True)
