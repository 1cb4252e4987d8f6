# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights' own nodes as Relume reads them, against Cycles' pictures with those nodes.

The stage is rendered with the nodes and without; the quotient is what the nodes emit, for the
pixels that are lit. The tables have texels of a third of a degree, or a 512th of a cone.
"""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.light import Light
from tests.cycles_stage import CyclesStage
from tests.reference.light_profile import profile

Array = NDArray[np.float64]

# A narrow downlight that is brighter to one side; LM-63's own format.
IES = """IESNA:LM-63-2002
[TEST] Relume
TILT=NONE
1 1000 1 7 5 1 2 0 0 0
1.0 1.0 10
0 15 30 45 60 75 90
0 90 180 270 360
1000 900 700 400 150 50 10
1000 950 800 500 200 60 10
1000 800 500 200 80 20 5
1000 850 600 300 100 30 5
1000 900 700 400 150 50 10
"""


def link(tree: Any, source: Any, target: Any) -> None:
    tree.links.new(source, target)


def ies(tree: Any, emission: Any) -> None:
    import bpy

    text = bpy.data.texts.new("Lamp")
    text.write(IES)
    node = tree.nodes.new("ShaderNodeTexIES")
    node.mode, node.ies = "INTERNAL", text
    node.inputs["Strength"].default_value = 1e-3
    link(tree, node.outputs["Factor"], emission.inputs["Strength"])


def gradient(tree: Any, emission: Any) -> None:
    """The direction as a colour."""
    place = tree.nodes.new("ShaderNodeTexCoord")
    shift = tree.nodes.new("ShaderNodeVectorMath")
    shift.operation = "MULTIPLY_ADD"
    shift.inputs[1].default_value = shift.inputs[2].default_value = (0.5, 0.5, 0.5)
    link(tree, place.outputs["Normal"], shift.inputs[0])
    link(tree, shift.outputs[0], emission.inputs["Color"])


def world_gradient(tree: Any, emission: Any) -> None:
    """The direction in the world."""
    gradient(tree, emission)
    shift = emission.inputs["Color"].links[0].from_node
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    link(tree, geometry.outputs["Incoming"], shift.inputs[0])


def gobo(tree: Any, emission: Any) -> None:
    """A smooth picture thrown by the classic set-up: normal / z to an image."""
    import bpy

    image = bpy.data.images.new("Gobo", 32, 32, float_buffer=True, is_data=True)
    y, x = np.mgrid[0:32, 0:32] / 32.0
    rgba = np.ones((32, 32, 4), dtype=np.float32)
    for channel, wave in enumerate((3, 4, 5)):
        rgba[..., channel] = 0.5 + 0.5 * np.sin(wave * x * 3.0) * np.cos(wave * y * 3.0)
    image.pixels.foreach_set(rgba.ravel())
    place, parts = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
    link(tree, place.outputs["Normal"], parts.inputs[0])
    joined = tree.nodes.new("ShaderNodeCombineXYZ")
    for axis in (0, 1):
        divide, add = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeMath")
        divide.operation, add.operation = "DIVIDE", "ADD"
        link(tree, parts.outputs[axis], divide.inputs[0])
        link(tree, parts.outputs[2], divide.inputs[1])
        link(tree, divide.outputs[0], add.inputs[0])
        link(tree, add.outputs[0], joined.inputs[axis])
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    link(tree, joined.outputs[0], texture.inputs["Vector"])
    link(tree, texture.outputs["Color"], emission.inputs["Color"])


def black_body(tree: Any, emission: Any) -> None:
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = 3200.0
    link(tree, node.outputs[0], emission.inputs["Color"])


def falloff(name: str, smooth: float = 0.0) -> Any:
    def build(tree: Any, emission: Any) -> None:
        node = tree.nodes.new("ShaderNodeLightFalloff")
        node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 0.7, smooth
        link(tree, node.outputs[name], emission.inputs["Strength"])

    return build


def two_shaders(tree: Any, emission: Any) -> None:
    """Emission is added up, in part through a node that is not Emission."""
    gradient(tree, emission)
    other, add = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeAddShader")
    other.inputs["Color"].default_value = (0.2, 0.0, 0.4, 1.0)
    link(tree, emission.outputs[0], add.inputs[0])
    link(tree, other.outputs[0], add.inputs[1])
    link(tree, add.outputs[0], tree.nodes["Light Output"].inputs["Surface"])


CASES = [
    ("POINT", ies),
    ("SPOT", ies),
    ("POINT", gradient),
    ("AREA", world_gradient),
    ("SPOT", gobo),
    ("POINT", black_body),
    ("SUN", gradient),
    ("POINT", falloff("Linear")),
    ("SPOT", falloff("Constant", 0.5)),
    ("POINT", falloff("Quadratic", 2.0)),
    ("POINT", two_shaders),
]


def read(scene: Any) -> Light:
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.light_profile_reader import ensure_measured
    from addon.scene.light_reader import read_lights

    ensure_measured(scene)
    (light,) = with_render_depsgraph(scene, read_lights)
    return light


@pytest.mark.parametrize(("kind", "build"), CASES)
def test_nodes_shine_as_in_cycles(kind: str, build: Any, tmp_path: Path) -> None:
    """40 dB of the brightest pixel; kinks of an IES file and float32 are in that."""
    stage = CyclesStage(kind, tmp_path, 64)
    stage.light.scale = (1.0, 1.5, 0.8)
    if kind == "SPOT":
        stage.light.data.spot_size = 1.2
    if kind == "AREA":
        stage.light.data.size = 0.001
    plain, position, _ = stage.render()
    tree = stage.light.data.node_tree
    build(tree, tree.nodes["Emission"])
    shown = stage.render()[0]
    light = read(stage.scene)
    assert light.warnings == ()
    wanted = plain * light.color
    if light.profile is not None:
        wanted = wanted * profile(light, position, light.position)
    error = np.sqrt(np.mean((shown - wanted) ** 2)) / shown.max()
    assert shown.max() > 0.0
    assert error < 10.0 ** (-40.0 / 20.0) / 4.0
    assert np.abs(shown - plain).max() > 0.05 * plain.max()


def test_constant_trees_become_a_colour(tmp_path: Path) -> None:
    stage = CyclesStage("POINT", tmp_path, 16)
    tree = stage.light.data.node_tree
    black_body(tree, tree.nodes["Emission"])
    light = read(stage.scene)
    assert light.profile is None
    assert light.color[0] > 1.0 > light.color[2]


def test_only_an_edit_of_the_nodes_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.scene import light_profile_reader
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.light_reader import read_lights

    calls = []
    kept = light_profile_reader._measure

    def count(*arguments: Any) -> Any:
        calls.append(arguments)
        return kept(*arguments)

    monkeypatch.setattr(light_profile_reader, "_measure", count)
    stage = CyclesStage("POINT", tmp_path, 16)
    tree = stage.light.data.node_tree
    gradient(tree, tree.nodes["Emission"])
    tree.nodes["Vector Math"].inputs[1].default_value = (0.5, 0.5, 0.125)
    first = read(stage.scene)
    stage.light.location.x += 1.0
    stage.light.rotation_euler.z += 1.0
    stage.light.data.energy, stage.light.data.color = 7.0, (1.0, 0.5, 0.0)
    moved = read(stage.scene)
    assert len(calls) == 1
    assert moved.profile is first.profile is not None
    tree.nodes["Vector Math"].inputs[1].default_value = (0.5, 0.25, 0.125)
    waiting = with_render_depsgraph(stage.scene, read_lights)[0]
    assert waiting.profile is first.profile
    assert "shown as they were" in waiting.warnings[0]
    assert read(stage.scene).profile is not first.profile
    assert len(calls) == 2


def test_the_open_scene_is_not_touched(tmp_path: Path) -> None:
    from addon.scene.light_profile_reader import ensure_measured
    from tests.caching.rna_dump import dump

    stage = CyclesStage("POINT", tmp_path, 16)
    tree = stage.light.data.node_tree
    gradient(tree, tree.nodes["Emission"])
    # Rendering makes an image of the result, which is not the scene's.
    stage.render()
    before = dump()
    ensure_measured(stage.scene)
    after = dump()
    changed = {key for key in before | after if before.get(key) != after.get(key)}
    assert {key for key in changed if "Render Result" not in key} == set()


def test_what_was_written_for_cycles_is_not_measured(tmp_path: Path) -> None:
    from addon.scene.light_controls import BarnDoors, LightControls, Superellipse
    from addon.ui import write_back

    stage = CyclesStage("POINT", tmp_path, 16)
    tree = stage.light.data.node_tree
    gradient(tree, tree.nodes["Emission"])
    first = read(stage.scene)
    doors = LightControls(barn_doors=BarnDoors(Superellipse(0.1, 0.1)))
    write_back.write(stage.light.data, doors)
    written = read(stage.scene)
    assert first.profile is not None
    assert written.profile is not None
    # To the last bits: Cycles takes a picture's samples in another order each time.
    np.testing.assert_allclose(written.profile.pixels, first.profile.pixels, atol=1e-6)


def test_what_is_not_told_is_named(tmp_path: Path) -> None:
    stage = CyclesStage("AREA", tmp_path, 16)
    tree = stage.light.data.node_tree
    noise, geometry = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeNewGeometry")
    link(tree, noise.outputs["Color"], tree.nodes["Emission"].inputs["Color"])
    link(tree, geometry.outputs["Incoming"], tree.nodes["Emission"].inputs["Strength"])
    assert "vary over its area and with" in read(stage.scene).warnings[0]
    stage.light.data.type = "POINT"
    path, sine = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    sine.operation = "SINE"
    link(tree, path.outputs["Ray Length"], sine.inputs[0])
    link(tree, sine.outputs[0], tree.nodes["Emission"].inputs["Strength"])
    assert "depend on the distance" in read(stage.scene).warnings[0]


def test_every_lights_last_state_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    from addon.scene import light_nodes_reader as reader

    monkeypatch.setattr(reader, "_known", OrderedDict())
    monkeypatch.setattr(reader, "_latest", {})
    white = reader.MeasuredNodes(np.ones(3))
    for number in range(100):
        reader.remember(f"first {number}", f"Lamp {number}", white)
    assert all(reader.known(f"first {number}") for number in range(100))
    # Of one light that is edited, past states go first.
    for number in range(100):
        reader.remember(f"edit {number}", "Lamp 0", white)
    assert all(reader.known(f"first {number}") for number in range(1, 100))
    assert reader.known("first 0") is None
    assert reader.measured_before("Lamp 0") is reader.known("edit 99") is white
    assert reader.known("edit 0") is None
