# SPDX-License-Identifier: GPL-3.0-or-later
"""After an edit those cameras are baked again that see it, and no others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.bake import BakeSettings
from addon.caching.store import CacheStore
from addon.errors import InputError

from .material_grid import geometry_of_scene, node_in
from .two_rooms import (
    ALL,
    LEFT,
    LEFT_WALL,
    RIGHT,
    RIGHT_WALL,
    add_box,
    assert_as_fresh,
    bake,
    bake_again,
    paint,
    set_color,
    two_rooms,
)

CHANNEL_NOTE = "need other channels"


@pytest.fixture
def scene() -> Any:
    return two_rooms()


def move_ball() -> None:
    bpy.data.objects["Ball left"].location.x += 0.3


def move_ball_to_the_other_room() -> None:
    bpy.data.objects["Ball left"].location.x = 2.8


def reshape_ball() -> None:
    bpy.data.meshes["Ball right"].vertices[0].co.z -= 0.05


def remove_ball() -> None:
    bpy.data.objects.remove(bpy.data.objects["Ball right"])


def hide_ball() -> None:
    bpy.data.objects["Ball right"].hide_render = True


def add_behind_a_wall() -> None:
    """Between the rooms: no camera sees there."""
    add_box("Hidden", (0.0, 0.0, 0.0), 0.1, bpy.data.materials["Grey"])


def add_in_sight() -> None:
    add_box("New", (2.1, -0.5, -1.0), 0.2, bpy.data.materials["Grey"])


def add_of_another_material() -> None:
    add_box("New", (-2.1, -0.5, -1.0), 0.2, paint("A new one", (0.2, 0.7, 0.2)))


def add_small() -> None:
    """A hundredth of a texel: it may be on no ray through a texel's centre."""
    add_box("Speck", (-2.1, 0.1, -1.5), 0.0005, bpy.data.materials["Grey"])


def recolor_ball() -> None:
    set_color("Paint right", (0.3, 0.9, 0.3))


def recolor_rooms() -> None:
    set_color("Grey", (0.7, 0.6, 0.2))


def color_of_an_object() -> None:
    """Object Info could read it."""
    bpy.data.objects["Ball left"].color = (0.0, 1.0, 0.0, 1.0)


def other_material() -> None:
    bpy.data.meshes["Ball left"].materials[0] = bpy.data.materials["Paint right"]


def rename_only_the_light() -> None:
    bpy.context.scene.collection.objects.link(
        bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    )


BALL_LEFT, BALL_RIGHT = "object 'Ball left'", "object 'Ball right'"


@pytest.mark.parametrize(
    ("change", "again", "changed"),
    [
        (move_ball, {LEFT}, [BALL_LEFT]),
        (move_ball_to_the_other_room, {LEFT, RIGHT}, [BALL_LEFT]),
        (reshape_ball, {RIGHT}, [BALL_RIGHT]),
        (remove_ball, {RIGHT}, [BALL_RIGHT]),
        (hide_ball, {RIGHT}, [BALL_RIGHT]),
        (add_behind_a_wall, set(), ["object 'Hidden'"]),
        (add_in_sight, {RIGHT}, ["object 'New'"]),
        (add_of_another_material, {LEFT}, ["object 'New'"]),
        (add_small, {LEFT}, ["object 'Speck'"]),
        (recolor_ball, {RIGHT}, ["material 'Paint right'"]),
        (recolor_rooms, set(ALL), ["material 'Grey'"]),
        (color_of_an_object, {LEFT}, [BALL_LEFT]),
        (other_material, {LEFT}, [BALL_LEFT]),
        (rename_only_the_light, set(), []),
    ],
)
def test_cameras_that_see_a_change_are_baked_again(
    scene: Any, tmp_path: Path, change: Callable[[], None], again: set[int], changed: list[str]
) -> None:
    bake(scene, tmp_path / "cache")
    change()
    report = bake_again(scene, tmp_path / "cache")
    assert set(report.again) == again
    assert (report.baked, report.kept) == (len(again), len(ALL) - len(again))
    assert list(report.changed) == changed
    assert report.notes == ()
    assert all(set(seen) <= set(changed) and seen for seen in report.again.values())
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")
    # And there is nothing more to do.
    report = bake_again(scene, tmp_path / "cache")
    assert (report.baked, report.kept, report.changed) == (0, len(ALL), ())


def test_several_edits_one_after_the_other(scene: Any, tmp_path: Path) -> None:
    """What kept cameras see is known after a bake that kept them."""
    bake(scene, tmp_path / "cache")
    for change, again in ((move_ball, {LEFT}), (recolor_ball, {RIGHT}), (remove_ball, {RIGHT})):
        change()
        assert set(bake_again(scene, tmp_path / "cache").again) == again
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_a_removed_material_keeps_its_number(scene: Any, tmp_path: Path) -> None:
    bake(scene, tmp_path / "cache")
    names = CacheStore.open(tmp_path / "cache").plan.material_names
    other_material()
    assert set(bake_again(scene, tmp_path / "cache").again) == {LEFT}
    assert CacheStore.open(tmp_path / "cache").plan.material_names == names
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_other_channels_are_told(scene: Any, tmp_path: Path) -> None:
    bake(scene, tmp_path / "cache")
    tree = bpy.data.materials["Paint left"].node_tree
    picture = node_in(tree, "ShaderNodeTexNoise", Scale=3.0)
    glow = node_in(tree, "ShaderNodeEmission", Color=picture.outputs["Color"])
    output = tree.nodes["Material Output"]
    tree.links.new(glow.outputs[0], output.inputs["Surface"])
    report = bake_again(scene, tmp_path / "cache")
    assert (report.baked, report.kept) == (len(ALL), 0)
    (note,) = report.notes
    assert CHANNEL_NOTE in note
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_nodes_that_feel_what_is_near(scene: Any, tmp_path: Path) -> None:
    """A bevel takes its normal from what is about it: a change that is out of sight counts."""
    tree = bpy.data.materials["Paint right"].node_tree
    bevel = node_in(tree, "ShaderNodeBevel", Radius=0.05)
    tree.links.new(bevel.outputs[0], tree.nodes["Diffuse BSDF"].inputs["Normal"])
    bake(scene, tmp_path / "cache")
    add_behind_a_wall()
    assert set(bake_again(scene, tmp_path / "cache").again) == {RIGHT}


def sky() -> None:
    world = bpy.data.worlds.new("Sky")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    bpy.context.scene.world = world


def open_air() -> Any:
    """The left room without its upper half: a sky is seen from the floor."""
    scene = two_rooms()
    room = bpy.data.objects["Room left"].data
    room.clear_geometry()
    room.from_pydata([(-2, -2, -2), (2, -2, -2), (2, 2, -2), (-2, 2, -2)], [], [(0, 1, 2, 3)])
    return scene


@pytest.mark.parametrize(
    ("size", "distance", "counts"),
    # A ball of radius r takes up to (r / d)^2: 0.87^2 / 2^2 of it are far more than 1/256, and
    # 0.087^2 / 6^2 far less.
    [(1.0, 2.0, True), (0.1, 6.0, False)],
)
def test_occlusion_reaches_out_of_sight(
    tmp_path: Path, size: float, distance: float, counts: bool
) -> None:
    scene = open_air()
    sky()
    bake(scene, tmp_path / "cache")
    assert "ambient_occlusion" in CacheStore.open(tmp_path / "cache").plan.stored
    # Above the camera, which looks down.
    add_box("Above", (-2.1, 0.5, -2.0 + distance + size), size, bpy.data.materials["Grey"])
    report = bake_again(scene, tmp_path / "cache")
    assert (LEFT in report.again) == counts
    # The other room is closed.
    assert RIGHT not in report.again
    assert RIGHT_WALL not in report.again


def test_an_edit_needs_resume_or_overwrite(scene: Any, tmp_path: Path) -> None:
    bake(scene, tmp_path / "cache")
    move_ball()
    with pytest.raises(InputError, match="--resume"):
        bake(scene, tmp_path / "cache")
    store = CacheStore.open(tmp_path / "cache")
    assert len(store.cameras) == len(ALL)
    with pytest.raises(InputError, match="changed"):
        store.check_fingerprint("0" * 64)


def test_another_scene_is_not_resumed_upon(scene: Any, tmp_path: Path) -> None:
    bake(scene, tmp_path / "cache")
    for obj in list(bpy.data.objects):
        obj.name = f"Other {obj.name}"
        obj.location.z += 0.25
    with pytest.raises(InputError, match="another scene"):
        bake_again(scene, tmp_path / "cache")


def test_a_part_of_the_cameras_after_an_edit(scene: Any, tmp_path: Path) -> None:
    """The others that see the change are left to do, and never read as if they were good."""
    bake(scene, tmp_path / "cache")
    recolor_rooms()
    settings = BakeSettings("draft", only=frozenset({LEFT}), resume=True)
    report = bake(scene, tmp_path / "cache", settings)
    assert report.baked == 1
    assert [c.id for c in CacheStore.open(tmp_path / "cache").cameras] == [LEFT]
    report = bake_again(scene, tmp_path / "cache")
    assert (report.baked, report.kept) == (3, 1)
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_a_damaged_picture_is_baked_again(scene: Any, tmp_path: Path) -> None:
    bake(scene, tmp_path / "cache")
    path = CacheStore.open(tmp_path / "cache").camera_path(LEFT_WALL)
    path.write_bytes(path.read_bytes()[:-1])
    move_ball()
    report = bake_again(scene, tmp_path / "cache")
    assert set(report.again) == {LEFT}
    assert (report.baked, report.kept) == (2, 2)
    assert_as_fresh(scene, tmp_path / "cache", tmp_path / "fresh")


def test_what_is_seen_is_exact(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    bake(scene, tmp_path / "cache")
    manifest = CacheStore.open(tmp_path / "cache").manifest
    named = {
        number: {manifest.surfaces.objects[digest].name for digest in seen.objects}
        for number, seen in manifest.seen.items()
    }
    assert named == {
        LEFT: {"Room left", "Ball left"},
        LEFT_WALL: {"Room left"},
        RIGHT: {"Room right", "Ball right"},
        RIGHT_WALL: {"Room right"},
    }
    assert manifest.seen[LEFT].materials == {"Grey", "Paint left"}
    assert manifest.seen[RIGHT_WALL].materials == {"Grey"}
    assert all(seen.is_complete for seen in manifest.seen.values())
    boxes = {state.name: state for state in manifest.surfaces.objects.values()}
    some = geometry.object_id == geometry.object_names.index("Ball left")
    corners = geometry.vertices[geometry.triangles[some]].reshape(-1, 3)
    np.testing.assert_array_equal(boxes["Ball left"].low, corners.min(axis=0))
