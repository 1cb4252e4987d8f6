# SPDX-License-Identifier: GPL-3.0-or-later
"""Which views cameras are placed for, and what weights do."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from tests.synthetic import room_with_box
from tools.placing import SHOT_VIEWS, shot_views, with_weights


def add_camera(scene: Any, name: str, x: float) -> Any:
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.location = (x, 0.0, 5.0)
    scene.collection.objects.link(camera)
    return camera


@pytest.fixture
def scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 36
    scene.camera = add_camera(scene, "Shot", 0.0)
    return scene


def test_a_still_camera_is_looked_through_once(scene: Any) -> None:
    add_camera(scene, "Other", 3.0)
    assert sorted(view.name for view in shot_views(scene)) == ["Other", "Shot"]


def test_a_moving_camera_is_looked_through_along_its_way(scene: Any) -> None:
    scene.camera.keyframe_insert("location", index=0, frame=1)
    scene.camera.location.x = 7.0
    scene.camera.keyframe_insert("location", index=0, frame=36)
    scene.frame_set(1)
    views = shot_views(scene)
    assert len(views) == SHOT_VIEWS
    places = sorted(view.origin[0] for view in views)
    assert (places[0], places[-1]) == pytest.approx((0.0, 7.0))
    assert scene.frame_current == 1


def test_a_camera_on_a_moving_parent_moves(scene: Any) -> None:
    dolly = bpy.data.objects.new("Dolly", None)
    scene.collection.objects.link(dolly)
    scene.camera.parent = dolly
    dolly.keyframe_insert("location", frame=1)
    dolly.location.y = 2.0
    dolly.keyframe_insert("location", frame=36)
    scene.frame_set(1)
    assert len(shot_views(scene)) == SHOT_VIEWS


def test_weights_of_objects_and_materials_multiply() -> None:
    geometry = room_with_box()
    first, second = geometry.object_names[0], geometry.object_names[1]
    found = with_weights(geometry, {first: 0.5})
    expected = np.where(geometry.object_id == 0, 0.25, 1.0)  # object and material share a name
    np.testing.assert_allclose(found.weight, expected)
    with pytest.raises(InputError, match="no object or material 'Absent'"):
        with_weights(geometry, {second: 1.0, "Absent": 1.0})
