# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows caching cameras in the scene, for the artist to look at.

They are wire meshes, not camera objects: the shot's own cameras stay the only ones that the
artist, the command line and a farm find in the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import mathutils

from ..camplace.camera import CachingCamera

COLLECTION = "Relume Cameras"
# Marks what was made here, whatever it is renamed to.
MARK = "relume_caching_camera"
# The drawn pyramid's height, as a share of the distance that the camera sees to.
DRAWN_SHARE = 0.04

_EDGES = ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1), (3, 5), (4, 5))


def show_cameras(scene: Any, cameras: Sequence[CachingCamera]) -> Any:
    """Put one wire object for each caching camera into a collection of their own.

    Those shown before are replaced. They are neither rendered nor selectable. Returns the
    collection.
    """
    hide_cameras(scene)
    collection = bpy.data.collections.new(COLLECTION)
    collection[MARK] = True
    collection.hide_render = True
    collection.hide_select = True
    scene.collection.children.link(collection)
    for camera in cameras:
        collection.objects.link(_wire_object(camera))
    return collection


def hide_cameras(scene: Any) -> None:
    """Remove what show_cameras() made in this scene."""
    for collection in [child for child in scene.collection.children if MARK in child]:
        for obj in list(collection.objects):
            mesh = obj.data
            bpy.data.objects.remove(obj)
            if mesh is not None and mesh.users == 0:
                bpy.data.meshes.remove(mesh)
        bpy.data.collections.remove(collection)


def _wire_object(camera: CachingCamera) -> Any:
    kind = "Cube" if camera.kind == "CUBE_FACE" else "View"
    name = f"Relume {camera.id:04d} {kind} {camera.source}"
    mesh = bpy.data.meshes.new(name)
    depth = DRAWN_SHARE * camera.far
    side = depth * camera.half_extent
    corners = [(-side, -side, -depth), (side, -side, -depth), (side, side, -depth),
               (-side, side, -depth)]  # fmt: skip
    roof = (0.0, 1.5 * side, -depth)  # which way is up, as on Blender's own cameras
    mesh.from_pydata([(0.0, 0.0, 0.0), *corners, roof], _EDGES, [])
    obj = bpy.data.objects.new(name, mesh)
    obj.matrix_world = mathutils.Matrix(camera.world_from_camera.tolist())
    obj.display_type = "WIRE"
    obj.hide_render = True
    obj.hide_select = True
    obj[MARK] = camera.id
    return obj
