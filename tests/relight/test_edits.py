# SPDX-License-Identifier: GPL-3.0-or-later
"""EDITS.json: applied to Blender's lights, taken back, and refused when it can't be."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.errors import InputError
from addon.relight.edits.edits_file import applied_edits, read_edits


@pytest.fixture
def scene() -> Iterator[Any]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = bpy.context.scene
    for name, kind in (("Key", "AREA"), ("Rim", "SPOT"), ("Sun", "SUN")):
        made.collection.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, kind)))
    yield made
    bpy.ops.wm.read_factory_settings(use_empty=True)


def state(scene: Any) -> dict[tuple[str, str], Any]:
    result: dict[tuple[str, str], Any] = {}
    for obj in scene.objects:
        for block in (obj, obj.data):
            for attribute in (
                "location", "rotation_euler", "scale", "hide_render", "energy", "color", "shape",
                "size", "use_shadow", "temperature", "rotation_mode", "spot_size", "exposure",
            ):  # fmt: skip
                if hasattr(block, attribute):
                    value = getattr(block, attribute)
                    plain = isinstance(value, bool | int | float | str)
                    result[obj.name, attribute] = value if plain else tuple(value)
        result[obj.name, "data"] = obj.data.name
    return result


def test_applied_and_taken_back(scene: Any) -> None:
    before = state(scene)
    edits = {
        "Key": {
            "energy": 300, "location": [1, 2, 3], "color": [1, 0.8, 0.6], "shape": "DISK",
            "use_shadow": False, "rotation_euler": [0.1, 0.2, 0.3],
        },
        "Rim": None,
        "Sun": {"exposure": -1.5},
    }  # fmt: skip
    with applied_edits(scene, edits):
        key = scene.objects["Key"]
        assert key.data.energy == 300.0
        assert tuple(key.location) == (1.0, 2.0, 3.0)
        np.testing.assert_allclose(key.data.color, (1.0, 0.8, 0.6))
        assert key.data.shape == "DISK"
        assert not key.data.use_shadow
        assert scene.objects["Rim"].hide_render
        assert scene.objects["Sun"].data.exposure == -1.5
    assert state(scene) == before


def test_taken_back_after_an_error(scene: Any) -> None:
    before = state(scene)
    with pytest.raises(RuntimeError, match="stop"), applied_edits(scene, {"Key": {"energy": 1}}):
        raise RuntimeError("stop")
    assert state(scene) == before


def test_shared_data_is_edited_for_one_light_alone(scene: Any) -> None:
    import bpy

    key = scene.objects["Key"]
    twin = bpy.data.objects.new("Twin", key.data)
    scene.collection.objects.link(twin)
    with applied_edits(scene, {"Key": {"energy": 7.0}}):
        assert key.data.energy == 7.0
        assert twin.data.energy != 7.0
    assert key.data == twin.data


@pytest.mark.parametrize("mode", ["QUATERNION", "AXIS_ANGLE"])
def test_other_rotation_modes_are_taken_back(scene: Any, mode: str) -> None:
    import bpy

    key = scene.objects["Key"]
    key.rotation_mode = mode
    if mode == "QUATERNION":
        key.rotation_quaternion = (0.5, 0.5, 0.5, 0.5)
    else:
        key.rotation_axis_angle = (2.0, 0.0, 0.6, 0.8)
    bpy.context.view_layer.update()
    before = key.matrix_world.copy()
    with applied_edits(scene, {"Key": {"rotation_euler": [1.0, 0.0, 0.0]}}):
        bpy.context.view_layer.update()
        np.testing.assert_allclose(key.matrix_world.to_euler(), (1.0, 0.0, 0.0), atol=1e-6)
    bpy.context.view_layer.update()
    assert key.rotation_mode == mode
    assert key.matrix_world == before


def test_animated_attributes_stand_still(scene: Any) -> None:
    import bpy

    key = scene.objects["Key"]
    for frame, x in ((1, 0.0), (11, 10.0)):
        key.location = (x, 0.0, 0.0)
        key.keyframe_insert("location", frame=frame)
        key.data.energy = 10.0 * x
        key.data.keyframe_insert("energy", frame=frame)
    scene.frame_set(6)
    with applied_edits(scene, {"Key": {"location": [7, 8, 9], "energy": 3.0}}):
        scene.frame_set(8)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        seen: Any = key.evaluated_get(depsgraph)
        assert tuple(seen.matrix_world.translation) == (7.0, 8.0, 9.0)
        assert seen.data.energy == 3.0
    scene.frame_set(6)
    assert key.location[0] == pytest.approx(5.0)
    assert key.data.energy == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        ({"Lamp": None}, ("'Lamp'", "Key", "Rim", "Sun")),
        ({"Key": {"enrgy": 1.0}}, ("'enrgy'", "'Key'", "energy")),
        ({"Key": {"spot_size": 1.0}}, ("'spot_size'", "is an area light")),
        ({"Key": {"energy": "much"}}, ("'energy'", "'Key'", '"much"')),
        ({"Key": {"energy": True}}, ("'energy'", "true")),
        ({"Key": {"energy": float("nan")}}, ("'energy'", "finite")),
        ({"Key": {"energy": 10**400}}, ("'energy'", "finite")),
        ({"Key": {"color": [1, 1]}}, ("'color'", "3 numbers")),
        ({"Key": {"color": [1, 1, -1]}}, ("'color'", "between")),
        ({"Key": {"location": 3.0}}, ("'location'", "3 numbers")),
        ({"Key": {"shape": "STAR"}}, ("'shape'", "ELLIPSE", "STAR")),
        ({"Key": {"use_shadow": 1}}, ("'use_shadow'", "true or false")),
        ({"Rim": {"spot_size": 9.0}}, ("'spot_size'", "between")),
        ({"Key": {"energy": 5.0}, "Rim": {"angle": 1.0}}, ("'Rim'", "'angle'")),
    ],
)
def test_refused_and_nothing_changed(
    scene: Any, edits: dict[str, Any], words: tuple[str, ...]
) -> None:
    before = state(scene)
    with pytest.raises(InputError) as caught, applied_edits(scene, edits):
        pytest.fail("the edit was accepted")
    assert all(word in str(caught.value) for word in words), str(caught.value)
    assert "\n" not in str(caught.value)
    assert state(scene) == before


def test_blenders_own_limits_are_accepted(scene: Any) -> None:
    with applied_edits(scene, {"Rim": {"spot_size": float(np.pi), "spot_blend": 1.0}}):
        assert scene.objects["Rim"].data.spot_size == pytest.approx(np.pi)


def test_read(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    path.write_text(json.dumps({"Key": {"energy": 1}, "Rim": None}), encoding="utf-8")
    assert read_edits(path) == {"Key": {"energy": 1}, "Rim": None}
    digits = '{"Key": {"energy": ' + 9999 * "1" + "}}"
    for text in (digits, "", "{", "[]", '{"Key": 3}', "3", '{"Key": [1]}', "\xff"):
        path.write_bytes(text.encode("latin-1"))
        with pytest.raises(InputError, match=r"edits\.json"):
            read_edits(path)
    with pytest.raises(InputError, match="nowhere"):
        read_edits(tmp_path / "nowhere.json")


@pytest.fixture
def controls(scene: Any) -> Iterator[Any]:
    """The scene's key light with Relume's controls, and a blocker."""
    import bpy

    from addon.ui import light_properties

    light_properties.register()
    key = scene.objects["Key"]
    flag = bpy.data.objects.new("Flag.001", None)
    scene.collection.objects.link(flag)
    key.data.relume.blockers.add().object = flag
    yield key
    light_properties.unregister()


def test_controls_are_applied_and_taken_back(scene: Any, controls: Any) -> None:
    import bpy

    image = bpy.data.images.new("Leaves", 2, 2)
    edits = {
        "Key": {
            "barn_doors.use": True, "barn_doors.width": 0.25, "barn_doors.shear": [0.5, 0.0],
            "slide.image": "Leaves", "slide.kind": "SLIDE", "shadow.color": [0, 0, 0.5],
            "blockers.Flag.001.density": 0.5, "blockers.Flag.001.object": None, "ambient": 0.125,
        }
    }  # fmt: skip
    with applied_edits(scene, edits):
        c = controls.data.relume
        assert (c.barn_doors.use, c.barn_doors.width) == (True, 0.25)
        assert tuple(c.barn_doors.shear) == (0.5, 0.0)
        assert (c.slide.image, c.slide.kind) == (image, "SLIDE")
        assert tuple(c.shadow.color) == (0.0, 0.0, 0.5)
        assert (c.blockers[0].density, c.blockers[0].object) == (0.5, None)
        assert c.ambient == 0.125
    c = controls.data.relume
    assert (c.barn_doors.use, c.barn_doors.width) == (False, 0.5)
    assert (c.slide.image, c.slide.kind) == (None, "COOKIE")
    assert tuple(c.shadow.color) == (0.0, 0.0, 0.0)
    assert (c.blockers[0].density, c.blockers[0].object.name) == (1.0, "Flag.001")
    assert c.ambient == 0.0


def test_an_animated_control_stands_still(scene: Any, controls: Any) -> None:
    import bpy

    noise = controls.data.relume.noise
    for frame, amount in ((1, 0.0), (11, 1.0)):
        noise.amount = amount
        controls.data.keyframe_insert("relume.noise.amount", frame=frame)
    with applied_edits(scene, {"Key": {"noise.amount": 4.0}}):
        scene.frame_set(6)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        assert controls.evaluated_get(depsgraph).data.relume.noise.amount == 4.0
    scene.frame_set(6)
    assert controls.data.relume.noise.amount == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        ({"barn_doors.widht": 1.0}, ("'barn_doors.widht'", "barn_doors.width", "ambient")),
        ({"barn_door.width": 1.0}, ("'barn_door.width'",)),
        ({"barn_doors": 1.0}, ("'barn_doors'",)),
        ({"active_blocker": 1}, ("'active_blocker'",)),
        ({"barn_doors.density": 2.0}, ("between 0 and 1",)),
        ({"barn_doors.use": 1}, ("true or false",)),
        ({"slide.kind": "GOBO"}, ("COOKIE", "SLIDE")),
        ({"slide.image": "Clouds"}, ("'slide.image'", "image", "Clouds")),
        ({"blockers.Flag.density": 0.5}, ("'blockers.Flag.density'", "blockers.Flag.001.density")),
        ({"shadow.color": 3.0}, ("3 numbers",)),
    ],
)
def test_odd_controls_are_refused(
    scene: Any, controls: Any, edits: dict[str, Any], words: tuple[str, ...]
) -> None:
    with pytest.raises(InputError) as caught, applied_edits(scene, {"Key": edits}):
        pytest.fail("the edit was accepted")
    assert all(word in str(caught.value) for word in words), str(caught.value)
