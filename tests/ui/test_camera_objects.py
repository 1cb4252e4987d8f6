# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from addon.camplace.camera import CachingCamera
from addon.scene.geometry_reader import read_geometry
from addon.ui.camera_objects import hide_cameras, show_cameras


def camera(number: int) -> CachingCamera:
    world_from_camera = np.eye(4)
    # A turn about Z and a move: a transposed matrix would show.
    world_from_camera[:3] = [[0, -1, 0, 1 + number], [1, 0, 0, 2], [0, 0, 1, 3]]
    return CachingCamera(number, world_from_camera, np.pi / 2, 0.1, 50.0, 512, "CUBE_FACE", 0)


def test_they_stand_where_the_cameras_are(extension: None) -> None:
    scene: Any = bpy.context.scene
    collection = show_cameras(scene, [camera(0), camera(1)])
    assert len(collection.objects) == 2
    for obj, made in zip(collection.objects, [camera(0), camera(1)], strict=True):
        # float32 in Blender; the numbers are small integers
        np.testing.assert_array_equal(np.array(obj.matrix_world), made.world_from_camera)
        corners = np.array([v.co for v in obj.data.vertices])[1:5]
        np.testing.assert_allclose(abs(corners[:, :2]), -corners[:, 2:] * [1, 1], rtol=1e-6)


def test_they_are_in_nobodys_way(extension: None) -> None:
    scene: Any = bpy.context.scene
    before = read_geometry(bpy.context.evaluated_depsgraph_get())
    cameras = [obj for obj in scene.objects if obj.type == "CAMERA"]
    collection = show_cameras(scene, [camera(0)])
    assert [obj for obj in scene.objects if obj.type == "CAMERA"] == cameras
    assert collection.hide_render
    assert collection.hide_select
    bpy.context.view_layer.update()
    after = read_geometry(bpy.context.evaluated_depsgraph_get())
    np.testing.assert_array_equal(after.vertices, before.vertices)
    np.testing.assert_array_equal(after.triangles, before.triangles)


def test_showing_again_replaces_and_hiding_cleans_up(extension: None) -> None:
    scene: Any = bpy.context.scene
    objects, meshes = len(bpy.data.objects), len(bpy.data.meshes)
    collections = len(bpy.data.collections)
    for _ in range(3):
        show_cameras(scene, [camera(0), camera(1)])
        assert len(bpy.data.objects) == objects + 2
        assert len(bpy.data.collections) == collections + 1
    hide_cameras(scene)
    found = (len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.collections))
    assert found == (objects, meshes, collections)
