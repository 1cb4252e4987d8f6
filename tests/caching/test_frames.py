# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of an animation: each bakes the cameras that see what moved, and shows what is there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.caching.bake import BakeReport, BakeSettings, bake_scene
from addon.caching.fingerprint import scene_fingerprint
from addon.caching.frame_state import frame_ranges
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.progress import Cancelled

from .material_grid import geometry_of_scene
from .rna_dump import differences, dump
from .two_rooms import ALL, LEFT, RIGHT, assert_same, bake, cameras, two_rooms

FRAMES = tuple(range(1, 7))


@pytest.fixture
def scene() -> Any:
    scene = two_rooms()
    scene.frame_set(1)
    return scene


def keyed(owner: Any, path: str, values: dict[int, Any]) -> None:
    """Key a property, and hold its value between the keys."""
    for frame, value in values.items():
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    action = owner.id_data.animation_data.action
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                for curve in bag.fcurves:
                    for point in curve.keyframe_points:
                        point.interpolation = "CONSTANT"
    bpy.context.scene.frame_set(1)


def move_the_ball() -> None:
    """In the left room from frame 3 on, and in the right one from frame 5 on."""
    keyed(bpy.data.objects["Ball left"], "location",
          {1: (-2.1, 0.5, -1.0), 3: (-1.8, 0.5, -1.0), 5: (2.8, 0.5, -1.0)})  # fmt: skip


def recolor() -> None:
    """The right ball, from frame 4 on."""
    socket = bpy.data.materials["Paint right"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    keyed(socket, "default_value", {1: (0.1, 0.1, 0.8, 1.0), 4: (0.8, 0.8, 0.1, 1.0)})


def drive() -> None:
    """The left ball's green by the frame, from frame 2 on another one at each."""
    socket = bpy.data.materials["Paint left"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    socket.driver_add("default_value", 1).driver.expression = "max(frame - 1, 1) / 10"
    bpy.context.scene.frame_set(1)


def appear() -> None:
    """The right ball is there from frame 3 to 4 only."""
    keyed(bpy.data.objects["Ball right"], "hide_render", {1: True, 3: False, 5: True})


def nothing() -> None:
    pass


def bake_frames(
    scene: Any, folder: Path, frames: Sequence[int] = FRAMES, **settings: Any
) -> BakeReport:
    chosen = BakeSettings("draft", frames=tuple(frames), **settings)
    return bake_scene(scene, geometry_of_scene(scene), cameras(), folder, chosen)


def assert_frames_as_fresh(scene: Any, folder: Path, fresh: Path) -> None:
    """At each frame the cache shows what a bake at that frame shows."""
    store = CacheStore.open(folder)
    for frame in FRAMES:
        scene.frame_set(frame)
        fingerprint = scene_fingerprint(geometry_of_scene(scene))
        bake(scene, fresh / str(frame))
        assert_same(store.showing(fingerprint, frame), CacheStore.open(fresh / str(frame)))
    scene.frame_set(1)


@pytest.mark.parametrize(
    ("animate", "baked"),
    [
        (nothing, {2: [], 3: [], 4: [], 5: [], 6: []}),
        (move_the_ball, {2: [], 3: [LEFT], 4: [], 5: [LEFT, RIGHT], 6: []}),
        (recolor, {2: [], 3: [], 4: [RIGHT], 5: [], 6: []}),
        # At frame 2 it has the colour of frame 1.
        (drive, {2: [], 3: [LEFT], 4: [LEFT], 5: [LEFT], 6: [LEFT]}),
        (appear, {2: [], 3: [RIGHT], 4: [], 5: [RIGHT], 6: []}),
    ],
)
def test_frames_bake_what_changes(
    scene: Any, tmp_path: Path, animate: Any, baked: dict[int, list[int]]
) -> None:
    animate()
    geometry = geometry_of_scene(scene)
    before = dump()
    chosen = BakeSettings("draft", frames=FRAMES)
    report = bake_scene(scene, geometry, cameras(), tmp_path / "cache", chosen)
    assert differences(before, dump()) == []
    assert dict(report.frames) == baked
    assert report.baked == len(ALL)
    files = {p.relative_to(tmp_path / "cache") for p in (tmp_path / "cache").rglob("*.exr")}
    own = [Path(f"frames/{frame:04d}/{n:04d}") for frame, ids in baked.items() for n in ids]
    assert len(files) == len(ALL) + len(own)
    named = {path.with_name(path.name[:4]) for path in files}
    assert set(own) <= named
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_resuming_keeps_frames(scene: Any, tmp_path: Path) -> None:
    move_the_ball()
    bake_frames(scene, tmp_path / "cache")
    report = bake_frames(scene, tmp_path / "cache", resume=True)
    assert report.baked == 0
    assert not any(report.frames.values())
    # A lost file is baked again, and serves the frames that share it.
    (lost,) = (tmp_path / "cache" / "frames" / "0003").iterdir()
    lost.unlink()
    report = bake_frames(scene, tmp_path / "cache", resume=True)
    assert {frame: ids for frame, ids in report.frames.items() if ids} == {3: [LEFT]}
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_more_frames_are_added(scene: Any, tmp_path: Path) -> None:
    """As on a farm: a part of the frames in each process, against the first frame."""
    move_the_ball()
    bake_frames(scene, tmp_path / "cache", (1, 2, 3))
    report = bake_frames(scene, tmp_path / "cache", (4, 5, 6), resume=True)
    assert report.baked == 0
    assert dict(report.frames) == {4: [LEFT], 5: [LEFT, RIGHT], 6: []}
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_parts_of_the_cameras(scene: Any, tmp_path: Path) -> None:
    move_the_ball()
    bake_frames(scene, tmp_path / "cache", only=frozenset({0, 1}))
    bake_frames(scene, tmp_path / "cache", only=frozenset({2, 3}))
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_an_edit_at_one_frame_alone(scene: Any, tmp_path: Path) -> None:
    """The first frame is as it was; of the others, those that differ are baked again."""
    move_the_ball()
    bake_frames(scene, tmp_path / "cache")
    keyed(bpy.data.objects["Ball left"], "location", {3: (-2.4, 0.5, -1.0)})
    report = bake_frames(scene, tmp_path / "cache", resume=True)
    assert (report.baked, report.changed) == (0, ())
    assert {frame: ids for frame, ids in report.frames.items() if ids} == {3: [LEFT]}
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_an_edit_of_the_first_frame_drops_the_others(scene: Any, tmp_path: Path) -> None:
    move_the_ball()
    bake_frames(scene, tmp_path / "cache")
    bpy.data.objects["Ball right"].location.x += 0.2
    report = bake_frames(scene, tmp_path / "cache", resume=True)
    assert set(report.again) == {RIGHT}
    assert any("other frames" in note for note in report.notes)
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_other_channels_at_a_frame(scene: Any, tmp_path: Path) -> None:
    """A material that is another one from frame 4 on: its channels may be others too."""
    tree = bpy.data.materials["Paint left"].node_tree
    mix, glow = (tree.nodes.new(f"Shader{kind}") for kind in ("NodeMixShader", "NodeEmission"))
    tree.links.new(tree.nodes["Diffuse BSDF"].outputs[0], mix.inputs[1])
    tree.links.new(glow.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    keyed(mix.inputs[0], "default_value", {1: 0.0, 4: 0.5})
    report = bake_frames(scene, tmp_path / "cache")
    assert {frame for frame, ids in report.frames.items() if ids} == {4}
    assert LEFT in report.frames[4]
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_a_frame_that_was_not_baked_is_named(scene: Any, tmp_path: Path) -> None:
    move_the_ball()
    bake_frames(scene, tmp_path / "cache", (1, 2, 3))
    store = CacheStore.open(tmp_path / "cache")
    scene.frame_set(5)
    with pytest.raises(InputError, match=r"frame 5, .* holds the frames 1-3; .*--frames 5"):
        store.showing(scene_fingerprint(geometry_of_scene(scene)), 5)
    # One that is as a baked one is shown.
    scene.frame_set(4)
    at_four = store.showing(scene_fingerprint(geometry_of_scene(scene)), 4)
    assert at_four.camera_path(LEFT).parent.name == "0003"
    # One that is no longer as it was baked is not.
    scene.frame_set(3)
    bpy.data.objects["Ball right"].location.x += 0.2
    with pytest.raises(InputError, match="changed"):
        store.showing(scene_fingerprint(geometry_of_scene(scene)), 3)


def test_a_stopped_bake_goes_on(scene: Any, tmp_path: Path) -> None:
    move_the_ball()

    def stop(fraction: float, message: str) -> None:
        if "Frame 5: Baking camera 2" in message:
            raise Cancelled

    chosen = BakeSettings("draft", frames=FRAMES)
    with pytest.raises(Cancelled):
        bake_scene(scene, geometry_of_scene(scene), cameras(), tmp_path / "cache", chosen, stop)
    assert scene.frame_current == 1
    report = bake_frames(scene, tmp_path / "cache", resume=True)
    assert {frame: ids for frame, ids in report.frames.items() if ids} == {5: [RIGHT]}
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_a_bake_of_the_first_frame_again_keeps_the_others(scene: Any, tmp_path: Path) -> None:
    move_the_ball()
    bake_frames(scene, tmp_path / "cache")
    bake(scene, tmp_path / "cache")
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_picture_sequences_count_by_their_picture(tmp_path: Path, scene: Any) -> None:
    for number in (1, 2, 3):
        image = bpy.data.images.new("drawn", 4, 4)
        image.pixels.foreach_set([number / 4.0] * 64)
        image.save(filepath=str(tmp_path / f"picture_{number}.png"))
        bpy.data.images.remove(image)
    tree = bpy.data.materials["Paint left"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(tmp_path / "picture_1.png"))
    node.image.source = "SEQUENCE"
    node.image_user.frame_duration = 3
    node.image_user.use_auto_refresh = True
    tree.links.new(node.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    report = bake_frames(scene, tmp_path / "cache")
    assert dict(report.frames) == {2: [LEFT], 3: [LEFT], 4: [], 5: [], 6: []}
    assert_frames_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_frames_as_they_are_told() -> None:
    assert frame_ranges([5, 1, 2, 3, 9, 10]) == "1-3, 5, 9-10"
    assert frame_ranges([-2, -1, 4]) == "-2--1, 4"
