# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras in the scene: shown, edited by the artist, and read back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.edited_cameras import edited_cameras
from addon.camplace.camera import CachingCamera
from addon.camplace.cameras_file import to_json
from addon.errors import InputError
from addon.scene.caching_collection_reader import shot_cameras
from addon.scene.geometry_reader import read_geometry
from addon.scene.shot_reader import read_shot
from addon.ui.camera_changes import camera_changes
from addon.ui.camera_objects import remove_cameras, show_cameras


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def camera(number: int, offset: float = 0.0) -> CachingCamera:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(number)
    matrix[:3, 3] = offset + np.array([1.3 + number, 2.1, 3.7])
    return CachingCamera(number, matrix, 1.1, 0.1, 50.0, 512, "PERSPECTIVE", number)


def cube(source: int, first: int, offset: float = 0.0) -> list[CachingCamera]:
    """Two faces of a cube camera."""
    faces = [camera(first + face, offset) for face in range(2)]
    for face in faces:
        face.world_from_camera[:3, 3] = faces[0].origin
    return [replace(f, kind="CUBE_FACE", source=source, fov=np.pi / 2) for f in faces]


PLACED = (*cube(0, 0), camera(2), camera(3))


def read_back(placed: tuple[CachingCamera, ...] = PLACED) -> tuple[CachingCamera, ...]:
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    cameras = edited_cameras(depsgraph, bpy.context.scene, placed)
    assert cameras is not None
    return cameras


def show(placed: tuple[CachingCamera, ...] = PLACED) -> Any:
    collection = show_cameras(bpy.context.scene, placed)
    bpy.context.view_layer.update()
    return collection


def objects(collection: Any) -> list[Any]:
    return sorted((o for o in collection.objects if o.type == "CAMERA"), key=lambda o: o.name)


@pytest.mark.parametrize("offset", [0.0, 1e4, 1e6])
def test_they_stand_where_the_cameras_are_and_come_back_to_the_bit(
    extension: None, offset: float
) -> None:
    placed = (*cube(0, 0, offset), camera(2, offset))
    collection = show(placed)
    for obj, made in zip(objects(collection), placed, strict=True):
        # float32's spacing at the place, a few times
        tolerance = 4 * np.spacing(np.float32(offset + 4.0))
        matrix = np.array(obj.matrix_world)
        np.testing.assert_allclose(matrix, made.world_from_camera, atol=max(tolerance, 2e-6))
        assert obj.data.angle == pytest.approx(made.fov, rel=1e-6)
    assert to_json(read_back(placed)) == to_json(placed)


@pytest.mark.parametrize("size", [(640, 360), (360, 640)])
def test_they_come_back_whatever_shape_the_render_has(
    extension: None, size: tuple[int, int]
) -> None:
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = size
    show()
    assert to_json(read_back()) == to_json(PLACED)


def test_they_are_in_nobodys_way(extension: None) -> None:
    scene: Any = bpy.context.scene
    before = read_geometry(bpy.context.evaluated_depsgraph_get())
    cameras, active = shot_cameras(scene), scene.camera
    selected, current = list(bpy.context.selected_objects), bpy.context.active_object
    views = len(read_shot(scene))
    collection = show()
    assert shot_cameras(scene) == cameras
    assert scene.camera == active
    assert len(read_shot(scene)) == views
    assert list(bpy.context.selected_objects) == selected
    assert bpy.context.active_object == current
    assert collection.hide_render
    after = read_geometry(bpy.context.evaluated_depsgraph_get())
    np.testing.assert_array_equal(after.vertices, before.vertices)
    np.testing.assert_array_equal(after.triangles, before.triangles)


def test_a_camera_in_both_collections_is_both(extension: None) -> None:
    scene: Any = bpy.context.scene
    collection = show()
    collection.objects.link(scene.camera)
    assert scene.camera in shot_cameras(scene)
    assert len(read_back()) == len(PLACED) + 1


def test_showing_again_replaces_and_removing_cleans_up(extension: None) -> None:
    scene: Any = bpy.context.scene
    counted = (bpy.data.objects, bpy.data.cameras, bpy.data.collections)
    before = [len(block) for block in counted]
    for _ in range(3):
        show()
        # four cameras and the cube's empty
        assert [len(block) for block in counted] == [before[0] + 5, before[1] + 4, before[2] + 1]
    remove_cameras(scene)
    assert [len(block) for block in counted] == before


def test_a_moved_camera_is_read_where_it_is(extension: None) -> None:
    obj = objects(show())[2]
    obj.location.x += 0.5
    obj.data.clip_end = 20.0
    obj.data.angle = 0.9
    obj.data.relume.resolution = "1024"
    read = read_back()
    assert to_json((read[0], read[1], read[3])) == to_json((PLACED[0], PLACED[1], PLACED[3]))
    moved = read[2]
    assert moved.id == 2
    np.testing.assert_allclose(moved.origin, PLACED[2].origin + np.array([0.5, 0, 0]), atol=1e-6)
    assert moved.far == 20.0
    assert moved.resolution == 1024
    assert moved.fov == pytest.approx(0.9, rel=1e-6)


def test_a_moved_cube_moves_all_its_faces(extension: None) -> None:
    collection = show()
    bpy.data.objects["Relume Cube 0"].location.z += 2.0
    read = read_back()
    for face, placed in zip(read[:2], PLACED[:2], strict=True):
        np.testing.assert_allclose(face.origin, placed.origin + np.array([0, 0, 2]), atol=1e-6)
        np.testing.assert_allclose(face.world_from_camera[:3, :3],
                                   placed.world_from_camera[:3, :3], atol=2e-6)  # fmt: skip
    # Without what they hang on, the faces stay where they were placed.
    bpy.data.objects.remove(bpy.data.objects["Relume Cube 0"])
    assert to_json(read_back()) == to_json(PLACED)
    assert len(objects(collection)) == 4


def test_cameras_deleted_and_added(extension: None) -> None:
    collection = show()
    bpy.data.objects.remove(objects(collection)[2])
    own = bpy.data.objects.new("Corner", bpy.data.cameras.new("Corner"))
    own.location = (5.0, 6.0, 7.0)
    own.scale = (2.0, 2.0, 2.0)  # cameras ignore it
    own.data.sensor_fit, own.data.lens = "VERTICAL", 18.0
    collection.objects.link(own)
    copied = objects(collection)[-1].copy()
    copied.data = copied.data.copy()
    copied.location.x += 1.0
    collection.objects.link(copied)
    read = read_back()
    assert [c.id for c in read] == [0, 1, 3, 4, 5]
    assert to_json(read[:3]) == to_json((*PLACED[:2], PLACED[3]))
    corner = next(c for c in read if np.allclose(c.origin, [5, 6, 7]))
    np.testing.assert_allclose(corner.world_from_camera[:3, :3], np.eye(3), atol=1e-6)
    # 24 mm high, and 16:9 wide: the square is as wide as what the artist sees.
    assert np.tan(corner.fov / 2) == pytest.approx(12.0 / 18.0 * 16.0 / 9.0, rel=1e-5)


def test_excluded_from_the_view_layer_they_still_stand_there(
    extension: None, tmp_path: Any
) -> None:
    show()
    layer = bpy.context.view_layer.layer_collection.children["Relume Cameras"]
    layer.exclude = True
    path = str(tmp_path / "excluded.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert to_json(read_back()) == to_json(PLACED)


def test_without_a_collection_there_is_nothing_to_read(extension: None) -> None:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert edited_cameras(depsgraph, bpy.context.scene, PLACED) is None


def changes(largest: int = 2048, baked: tuple[CachingCamera, ...] = PLACED) -> str:
    bpy.context.view_layer.update()
    depsgraph, scene = bpy.context.view_layer.depsgraph, bpy.context.scene
    return camera_changes(depsgraph, scene, PLACED, baked, largest)


def test_what_differs_from_the_bake_is_said(extension: None) -> None:
    assert changes() == ""  # nothing is shown
    collection = show()
    assert changes() == ""
    objects(collection)[2].location.x += 0.001
    assert changes() == "1 of 4 caching cameras changed since the bake: Bake again"
    objects(collection)[2].location.x = PLACED[2].origin[0]
    assert changes() == ""
    bpy.data.objects["Relume Cube 0"].location.x += 0.1
    objects(collection)[3].data.angle = 1.0
    assert changes() == "3 of 4 caching cameras changed since the bake: Bake again"
    bpy.data.objects.remove(objects(collection)[3])
    assert changes() == "2 of 3 caching cameras changed and 1 deleted since the bake: Bake again"
    bpy.data.objects["Relume Cube 0"].location.x = PLACED[0].origin[0]
    assert changes() == "1 caching camera deleted since the bake: Bake again"
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    collection.objects.link(own)
    assert changes().startswith("1 of 4 caching cameras changed and 1 deleted")
    own.data.type = "ORTHO"
    assert "'Own' is ortho" in changes()
    assert changes(baked=()) == ""  # nothing is baked


def test_an_own_camera_that_was_baked_by_others_is_no_change(extension: None) -> None:
    """On a farm the file is not saved, so that the camera has no number of its own in it."""
    collection = show()
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    collection.objects.link(own)
    baked = tuple(replace(camera, resolution=512) for camera in read_back())
    assert len(baked) == 5
    assert changes(512, baked) == ""
    own.location.y = 1.0
    assert changes(512, baked) == "1 of 5 caching cameras changed since the bake: Bake again"


def test_a_presets_smaller_pictures_are_no_change(extension: None) -> None:
    collection = show()
    baked = tuple(replace(camera, resolution=256) for camera in PLACED)
    assert changes(256, baked) == ""
    assert changes(512, baked).startswith("4 of 4")
    objects(collection)[0].data.relume.resolution = "2048"
    assert changes(256, baked) == ""


@pytest.mark.parametrize("fault", ["ORTHO", "wide", "clips", "scale", "empty"])
def test_what_cannot_be_baked_is_named(extension: None, fault: str) -> None:
    collection = show()
    obj = objects(collection)[3]
    if fault == "ORTHO":
        obj.data.type = "ORTHO"
    elif fault == "wide":
        obj.data.angle = 2.5
    elif fault == "clips":
        obj.data.clip_start, obj.data.clip_end = 10.0, 5.0
    elif fault == "scale":
        obj.scale = (0.0, 0.0, 0.0)
    else:
        for other in list(collection.objects):
            bpy.data.objects.remove(other)
    with pytest.raises(InputError, match="Relume 0003" if fault != "empty" else "holds no camera"):
        read_back()


def test_the_eye_and_the_cross_of_the_panel(extension: None) -> None:
    assert not bpy.ops.relume.hide_cameras.poll()
    show()
    layer = bpy.context.view_layer.layer_collection.children["Relume Cameras"]
    bpy.ops.relume.hide_cameras()
    assert layer.hide_viewport
    assert to_json(read_back()) == to_json(PLACED)
    bpy.ops.relume.hide_cameras()
    assert not layer.hide_viewport
    bpy.ops.relume.remove_cameras()
    assert "Relume Cameras" not in bpy.data.collections
    assert not bpy.ops.relume.remove_cameras.poll()
