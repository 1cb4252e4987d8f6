# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a white sky measures ambient occlusion, the scene's lights are off, and nothing else."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.caching import bake_cameras
from addon.caching.lights_off import lights_off

from .material_grid import add_plane, bake, camera_above, empty_material, empty_scene, node_in
from .plain_cycles import emission_of

CAMERA = camera_above((0, 0, 0), 4.0)


def add_light(scene: Any, name: str, kind: str) -> Any:
    light = bpy.data.lights.new(name, kind)
    light.energy = 50.0
    obj = bpy.data.objects.new(name, light)
    obj.location = (0.0, 0.0, 2.0)
    scene.collection.objects.link(obj)
    return light


@pytest.fixture
def scene() -> Any:
    scene = empty_scene()
    add_plane(scene, "ground", (0.0, 0.0, 0.0), bpy.data.materials.new("plain"), size=20.0)
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        add_light(scene, kind, kind)
    nodes = add_light(scene, "with nodes", "POINT")
    nodes.use_nodes = True
    emission = next(n for n in nodes.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 7.0
    return scene


def test_no_light_shines(scene: Any, tmp_path: Path) -> None:
    assert emission_of(scene, CAMERA, tmp_path).min() > 0.1
    with lights_off():
        assert emission_of(scene, CAMERA, tmp_path).max() == 0.0
    assert emission_of(scene, CAMERA, tmp_path).min() > 0.1


@pytest.mark.parametrize(
    ("light", "path", "value"),
    [
        ("POINT", "energy", 50.0),
        ("with nodes", 'node_tree.nodes["Emission"].inputs["Strength"].default_value', 7.0),
    ],
)
def test_what_reads_a_light_reads_it_still(
    scene: Any, tmp_path: Path, light: str, path: str, value: float
) -> None:
    """A lamp's shade that glows as its light does."""
    material, surface = empty_material("shade")
    glow = node_in(material.node_tree, "ShaderNodeEmission")
    material.node_tree.links.new(glow.outputs[0], surface)
    driver = glow.inputs["Strength"].driver_add("default_value").driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id_type, target.id, target.data_path = "LIGHT", bpy.data.lights[light], path
    add_plane(scene, "shade", (0.0, 0.0, 1.0), material, size=20.0)
    with lights_off():
        assert emission_of(scene, CAMERA, tmp_path) == pytest.approx(value)
    assert emission_of(scene, CAMERA, tmp_path) == pytest.approx(value)
    assert driver.is_valid


def test_a_bake_is_the_same(scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As with its lights on, to the last bit; they take only time."""
    scene.world = bpy.data.worlds.new("sky")
    material, surface = empty_material("mask")
    tree = material.node_tree
    mixed = node_in(
        tree, "ShaderNodeMixShader", Fac=node_in(tree, "ShaderNodeTexChecker").outputs[1]
    )
    for number, kind in ((1, "ShaderNodeBsdfTransparent"), (2, "ShaderNodeBsdfDiffuse")):
        tree.links.new(node_in(tree, kind).outputs[0], mixed.inputs[number])
    tree.links.new(mixed.outputs[0], surface)
    add_plane(scene, "mask", (0.3, 0.2, 0.5), material, size=2.0)
    found, asked = [], []
    for block in (lights_off, nullcontext):

        def spy(block: Any = block) -> Any:
            asked.append(block)
            return block()

        monkeypatch.setattr(bake_cameras, "lights_off", spy)
        store, _ = bake(scene, [CAMERA], tmp_path / str(len(asked)))
        found.append(store.read_camera(0).channels)
    assert asked == [lights_off, nullcontext]
    off, on = found
    assert 0.1 < off["ambient_occlusion"].mean() < 1.0
    for name, values in off.items():
        assert (values == on[name]).all(), name
