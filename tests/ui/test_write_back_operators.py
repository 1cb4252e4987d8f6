# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist presses: Write to Cycles and Remove, on the controls of light.relume."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from addon.scene.light_controls import LightControls
from addon.scene.light_controls_reader import read_controls
from addon.scene.written_light import is_written_node
from addon.ui import write_back


@pytest.fixture
def light(extension: None) -> Any:
    """The factory file's light, with barn doors, selected."""
    obj: Any = bpy.data.objects["Light"]
    obj.data.relume.barn_doors.use = True
    bpy.context.view_layer.objects.active = obj
    return obj


def shown(light: Any) -> LightControls:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_controls(depsgraph, light.data.evaluated_get(depsgraph), [])


def current(light: Any) -> bool:
    return write_back.is_current(light.data, shown(light))


def group_of(data: Any) -> Any:
    return next(n.node_tree for n in data.node_tree.nodes if is_written_node(n))


def test_write_and_remove(light: Any) -> None:
    count = len(light.data.node_tree.nodes)
    assert bpy.ops.relume.write_back() == {"FINISHED"}
    assert current(light)
    light.data.relume.barn_doors.width = 0.25
    assert not current(light)
    bpy.ops.relume.write_back()
    assert current(light)
    assert bpy.ops.relume.remove_write_back() == {"FINISHED"}
    assert len(light.data.node_tree.nodes) == count
    assert not write_back.is_written(light.data)


def test_all_lights_at_once(light: Any) -> None:
    other: Any = bpy.data.objects.new("Other", bpy.data.lights.new("Other", "SPOT"))
    bpy.context.collection.objects.link(other)
    other.data.relume.falloff.use = True
    other.data.relume.falloff.exponent = 0.0
    bpy.ops.relume.write_back(all_lights=True)
    assert current(light)
    assert current(other)
    bpy.ops.relume.remove_write_back(all_lights=True)
    assert not write_back.is_written(light.data)
    assert not write_back.is_written(other.data)


def test_a_light_whose_objects_are_refused_keeps_its_nodes(
    light: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.ops.relume.write_back()
    written = group_of(light.data)
    light.data.relume.barn_doors.width = 0.25

    def refuse(_data: Any) -> None:
        raise InputError("linked from another file")

    monkeypatch.setattr("addon.ui.write_back_operators.require_objects_writable", refuse)
    with pytest.raises(RuntimeError, match="linked from another file"):
        bpy.ops.relume.write_back()
    assert group_of(light.data) == written


def test_without_a_light_it_says_so(light: Any) -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    with pytest.raises(RuntimeError, match="select one"):
        bpy.ops.relume.write_back()


def test_animated_controls_move_in_cycles(light: Any) -> None:
    group = light.data.relume
    group.noise.use = group.slide.use = True
    group.slide.image = bpy.data.images.new("Leaves", 4, 4)
    for frame, value in ((1, 0.5), (11, 1.5)):
        group.noise.offset[1] = group.barn_doors.width = group.slide.blur = value / 10.0
        group.noise.keyframe_insert("offset", index=1, frame=frame)
        group.barn_doors.keyframe_insert("width", frame=frame)
        group.slide.keyframe_insert("blur", frame=frame)
    scene = bpy.context.scene
    scene.frame_set(1)
    bpy.ops.relume.write_back()
    driven = group_of(light.data)
    for frame, value in ((1, 0.05), (6, 0.1), (11, 0.15)):
        scene.frame_set(frame)
        tree = driven.evaluated_get(bpy.context.evaluated_depsgraph_get())
        values = [
            n.outputs[0].default_value for n in tree.nodes if n.bl_idname == "ShaderNodeValue"
        ]
        np.testing.assert_allclose(values, [value] * 2, rtol=1e-6)
        # The blur is drawn into the picture.
        assert current(light) == (frame == 1)
    assert write_back.standing_still(light.data, shown(light)) == ("slide, blur",)


def test_what_moves_looks_the_same_in_cycles(tmp_path: Any, extension: None) -> None:
    """Every number that can move, moved: the nodes that compute with it against the twin."""
    from addon.scene.light import Light
    from tests.cycles_stage import CyclesStage
    from tests.reference.light_filters import light_filters

    stage = CyclesStage("POINT", tmp_path, 48)
    data = stage.light.data
    group = data.relume
    group.barn_doors.use = group.distance.use_near = group.distance.use_far = True
    group.falloff.use = group.noise.use = group.slide.use = True
    group.slide.image = bpy.data.images.new("Leaves", 8, 8, float_buffer=True, is_data=True)
    pixels = np.random.default_rng(4).random(256).astype(np.float32)
    group.slide.image.pixels.foreach_set(pixels)
    moved: dict[str, dict[str, Any]] = {
        "barn_doors": {
            "width": 0.6, "height": 0.5, "width_edge": 0.3, "height_edge": 0.2, "roundness": 0.5,
            "shear": (0.1, 0.05), "rotation": 0.4, "density": 0.9,
        },
        "distance": {"near": 1.4, "near_edge": 0.3, "far": 2.3, "far_edge": 0.5},
        "falloff": {"exponent": 1.0, "distance": 2.0},
        "slide": {"scale": (1.2, 0.9), "offset": (0.1, 0.0), "rotation": 0.2},
        "noise": {
            "amount": 0.7, "scale": 3.0, "detail": 2.5, "roughness": 0.6, "offset": (1.0, 2.0, 3.0),
        },
    }  # fmt: skip
    stage.scene.frame_set(1)
    for part, values in moved.items():
        for name, value in values.items():
            owner = getattr(group, part)
            owner.keyframe_insert(name, frame=1)
            setattr(owner, name, value)
            owner.keyframe_insert(name, frame=11)
    stage.scene.frame_set(1)
    unwritten = stage.render()
    bpy.context.view_layer.objects.active = stage.light
    bpy.ops.relume.write_back()
    stage.scene.frame_set(11)
    controls = shown(stage.light)
    assert controls.barn_doors is not None
    assert controls.barn_doors.outline.width == pytest.approx(0.6)
    matrix = np.array(stage.light.matrix_world, dtype=np.float64)
    light = Light("Key", "POINT", matrix, 1.0, np.ones(3), controls=controls)
    wanted = unwritten[0] * light_filters(light, unwritten[1])
    error = np.abs(stage.render()[0] - wanted).max(axis=-1) / wanted.max()
    # The places are known to 0.005 pixels, and the slide's border and texels are sharp.
    assert np.count_nonzero(error > 1e-2) <= 8
    assert np.sqrt(np.mean(np.where(error > 1e-2, 0.0, error) ** 2)) < 1e-3


def test_the_panel_says_what_cycles_lacks(light: Any) -> None:
    from addon.scene.not_in_cycles import not_in_cycles

    light.data.relume.shadow.softness = 2.0
    assert not_in_cycles("POINT", shown(light)) == ("shadow softness",)


def test_references_show_the_controls(light: Any) -> None:
    """What `relume evaluate` compares with; edits of controls are followed."""
    from tools.reference import write_controls

    plain: Any = bpy.data.objects.new("Plain", bpy.data.lights.new("Plain", "POINT"))
    bpy.context.collection.objects.link(plain)
    for width in (0.2, 0.3):
        light.data.relume.barn_doors.width = width
        write_controls(bpy.context.scene)
        assert current(light)
    assert not write_back.is_written(plain.data)
    light.data.relume.barn_doors.use = False
    write_controls(bpy.context.scene)
    assert not write_back.is_written(light.data)
