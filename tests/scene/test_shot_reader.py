# SPDX-License-Identifier: GPL-3.0-or-later
"""Which cameras are the shot, and where they are looked through."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from addon.scene.caching_collection_reader import CACHING_MARK
from addon.scene.shot import ALL_CAMERAS, ShotChoice, describe_shot
from addon.scene.shot_reader import SHOT_VIEWS, read_shot

FIRST, LAST = 1, 100


@pytest.fixture
def scene() -> Any:
    """Three cameras: A, active and moving along X by its frame; B, moving too; C, which stands."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    scene.frame_start, scene.frame_end = FIRST, LAST
    for name in "ABC":
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        scene.collection.objects.link(camera)
        camera.location.y = "ABC".index(name)
        if name == "C":
            continue
        for frame in (FIRST, LAST):
            camera.location.x = frame
            camera.keyframe_insert("location", index=0, frame=frame)
        for curve in camera.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    scene.camera = bpy.data.objects["A"]
    scene.frame_set(FIRST)
    return scene


def bind(scene: Any, name: str, frame: int) -> None:
    scene.timeline_markers.new(name, frame=frame).camera = bpy.data.objects[name]


def seen(scene: Any, choice: ShotChoice = ALL_CAMERAS) -> dict[str, list[float]]:
    """Of each camera the places along X that it is looked through from, sorted."""
    found: dict[str, list[float]] = {}
    for view in read_shot(scene, choice):
        found.setdefault(view.name, []).append(round(float(view.origin[0]), 3))
    return {name: sorted(places) for name, places in found.items()}


def test_all_cameras_and_the_active_ones_way(scene: Any) -> None:
    places = seen(scene)
    assert list(places) == ["A", "B", "C"]
    assert len(places["A"]) == SHOT_VIEWS
    assert (places["A"][0], places["A"][-1]) == (FIRST, LAST)
    assert (places["B"], places["C"]) == ([FIRST], [0.0])


def test_cameras_by_their_names_each_along_its_way(scene: Any) -> None:
    places = seen(scene, ShotChoice(names=("B", "C", "B")))
    assert set(places) == {"B", "C"}
    assert (len(places["B"]), places["C"]) == (SHOT_VIEWS, [0.0])
    with pytest.raises(InputError, match="no camera 'D'; it has: A, B, C"):
        read_shot(scene, ShotChoice(names=("B", "D")))


def test_the_active_camera_alone(scene: Any) -> None:
    places = seen(scene, ShotChoice(active=True))
    assert set(places) == {"A"}
    assert len(places["A"]) == SHOT_VIEWS


def test_cameras_that_markers_bind_over_their_frames(scene: Any) -> None:
    bind(scene, "B", 41)
    bind(scene, "C", 61)
    bind(scene, "A", LAST + 20)  # beyond the shot
    scene.camera = bpy.data.objects["A"]  # Blender follows the markers at once
    places = seen(scene, ShotChoice(active=True))
    # B counts before its marker too, since there is none; A is active now, and never in a render.
    assert (places["B"][0], places["B"][-1], places["C"]) == (FIRST, 60, [0.0])
    assert places["A"] == [FIRST]
    bind(scene, "A", 1)
    places = seen(scene, ShotChoice(active=True))
    assert (places["A"][0], places["A"][-1]) == (FIRST, 40)
    assert (places["B"][0], places["B"][-1], places["C"]) == (41, 60, [0.0])
    for marker in scene.timeline_markers:
        marker.camera = bpy.data.objects["C"]
    bpy.data.objects["C"].hide_render = True  # then it is not bound
    scene.camera = bpy.data.objects["A"]
    assert set(seen(scene, ShotChoice(active=True))) == {"A"}


def test_frame_and_active_camera_are_put_back(scene: Any) -> None:
    bind(scene, "B", 10)
    scene.frame_set(5)
    scene.camera = bpy.data.objects["C"]
    for choice in (ALL_CAMERAS, ShotChoice(active=True), ShotChoice(names=("A",))):
        read_shot(scene, choice)
        assert (scene.frame_current, scene.camera.name) == (5, "C")


def test_a_lens_that_zooms_is_looked_through_at_several_frames(scene: Any) -> None:
    data = bpy.data.objects["C"].data
    for frame, lens in ((FIRST, 35.0), (LAST, 85.0)):
        data.lens = lens
        data.keyframe_insert("lens", frame=frame)
    scene.camera = bpy.data.objects["C"]
    views = read_shot(scene, ShotChoice(active=True))
    assert len({view.clip_from_camera[0, 0] for view in views}) == SHOT_VIEWS


def test_without_an_active_camera_those_that_there_are_get_named(scene: Any) -> None:
    scene.camera = None
    with pytest.raises(InputError, match="is none; make one of these active: A, B, C"):
        read_shot(scene, ShotChoice(active=True))
    collection = bpy.data.collections.new("Caching")
    collection[CACHING_MARK] = True
    scene.collection.children.link(collection)
    looked_through = bpy.data.objects.new("Caching", bpy.data.cameras.new("Caching"))
    collection.objects.link(looked_through)
    scene.camera = looked_through
    with pytest.raises(InputError, match=r"is 'Caching', none of the shot's; .*: A, B, C$"):
        read_shot(scene, ShotChoice(active=True))
    bind(scene, "B", 1)
    assert set(seen(scene, ShotChoice(active=True))) == {"B"}


def test_a_shot_in_words() -> None:
    assert describe_shot(["A"]) == "1 view of 'A'"
    assert describe_shot(["A", "B", "A"]) == "3 views of 'A', 'B'"
    assert describe_shot(list(np.array(list("ABCDE")))) == "5 views of 5 cameras"
