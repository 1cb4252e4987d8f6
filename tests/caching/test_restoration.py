# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's file is the same after a bake as before it, however the bake ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.progress import Cancelled

from .material_grid import (
    add_plane,
    camera_above,
    empty_material,
    empty_scene,
    geometry_of_scene,
    node_in,
)
from .rna_dump import differences, dump
from .test_materials import fresnel_mix, mixed, nested_groups, principled


@pytest.fixture
def scene() -> Any:
    """Settings unlike the bake's own, users of materials of many kinds, AOVs, two layers."""
    scene = empty_scene()
    for x, maker in enumerate((principled, mixed, nested_groups, fresnel_mix)):
        add_plane(scene, maker.__name__, (x - 2.0, 0.0, 0.0), maker())
    materials = bpy.data.materials
    materials["mixed"].use_fake_user = True
    instance = bpy.data.objects.new("same mesh", bpy.data.objects["mixed"].data)
    instance.material_slots  # noqa: B018 - makes the slots
    scene.collection.objects.link(instance)
    instance.location = (0.0, 2.0, 0.0)
    instance.material_slots[0].link = "OBJECT"
    instance.material_slots[0].material = materials["principled"]
    add_plane(scene, "bare", (2.0, 2.0, 0.0), None)
    slots = add_plane(scene, "slots", (-2.0, 2.0, 0.0), materials["mixed"])
    slots.data.materials.append(None)
    slots.data.materials.append(materials["principled"])
    slots.active_material_index = 2
    # Not shown by anything.
    empty_material("spare")

    light = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "AREA"))
    scene.collection.objects.link(light)
    camera = bpy.data.objects.new("Shot", bpy.data.cameras.new("Shot"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Sky")
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.filepath = "//frames/shot_"
    scene.render.resolution_percentage = 37
    scene.render.use_border = True
    scene.render.image_settings.file_format = "JPEG"
    scene.cycles.samples = 77
    scene.cycles.pixel_filter_type = "GAUSSIAN"
    scene.frame_set(12)
    layer = scene.view_layers[0]
    layer.aovs.add().name = "mine"
    layer.pass_alpha_threshold = 0.25
    layer.use_pass_mist = True
    scene.view_layers.new("second")
    return scene


def test_after_a_bake(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()
    bake_scene(scene, geometry, [camera_above((0, 0, 0), 5.0)], tmp_path)
    assert differences(before, dump()) == []
    assert bpy.context.scene == scene


def test_a_dump_sees_a_change(scene: Any) -> None:
    before = dump()
    scene.cycles.samples = 78
    bpy.data.objects["mixed"].data.materials[0] = bpy.data.materials["spare"]
    changed = "\n".join(differences(before, dump()))
    assert "cycles.samples: 77 became 78" in changed
    assert "-> mixed became -> spare" in changed


def test_after_a_cancelled_bake(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()

    def stop_at_the_second(fraction: float, message: str) -> None:
        if "camera 2" in message:
            raise Cancelled

    cameras = [camera_above((0, 0, 0), 5.0, number=i) for i in range(3)]
    with pytest.raises(Cancelled):
        bake_scene(scene, geometry, cameras, tmp_path, None, stop_at_the_second)
    assert differences(before, dump()) == []
    # What was finished is kept, and nothing half-written lies about.
    assert [c.id for c in CacheStore.open(tmp_path).cameras] == [0]
    files = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    first = CacheStore.open(tmp_path).camera_path(0).relative_to(tmp_path)
    assert {str(first), "manifest.json"} <= files
    assert not [name for name in files if name.endswith(".part")]

    report = bake_scene(scene, geometry, cameras, tmp_path, BakeSettings(resume=True))
    assert (report.kept, report.baked) == (1, 2)


def test_after_a_failed_bake(scene: Any, tmp_path: Path) -> None:
    """A material that divides by nothing: Cycles gives infinities, and they are named."""
    material, surface = empty_material("broken")
    tree = material.node_tree
    power = tree.nodes.new("ShaderNodeVectorMath")
    power.operation = "SCALE"
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], power.inputs[0])
    power.inputs["Scale"].default_value = 3e38
    again = tree.nodes.new("ShaderNodeVectorMath")
    again.operation = "SCALE"
    again.inputs["Scale"].default_value = 3e38
    tree.links.new(power.outputs[0], again.inputs[0])
    light = node_in(tree, "ShaderNodeEmission", Color=again.outputs[0])
    tree.links.new(light.outputs[0], surface)
    add_plane(scene, "broken", (0.0, -2.0, 0.0), material)
    geometry = geometry_of_scene(scene)
    before = dump()
    with pytest.raises(InputError, match=r"material .broken. gives an? emission"):
        bake_scene(scene, geometry, [camera_above((0, 0, 0), 5.0)], tmp_path)
    assert differences(before, dump()) == []


def test_resuming_bakes_damaged_cameras_again(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    cameras = [camera_above((0, 0, 0), 5.0, number=i) for i in range(2)]
    bake_scene(scene, geometry, cameras, tmp_path)
    path = CacheStore.open(tmp_path).camera_path(1)
    good = path.read_bytes()
    path.write_bytes(good[:-100])
    report = bake_scene(scene, geometry, cameras, tmp_path, BakeSettings(resume=True))
    assert (report.kept, report.baked) == (1, 1)
    # The same input gives the same bake, to the last byte.
    assert path.read_bytes() == good


def test_a_changed_scene_is_told_from_its_cache(scene: Any, tmp_path: Path) -> None:
    cameras = [camera_above((0, 0, 0), 5.0)]
    bake_scene(scene, geometry_of_scene(scene), cameras, tmp_path)
    # Lights and cameras do not count.
    bpy.data.lights["Key"].energy = 3.0
    bpy.data.objects["Shot"].location.x = 9.0
    report = bake_scene(
        scene, geometry_of_scene(scene), cameras, tmp_path, BakeSettings(resume=True)
    )
    assert report.kept == 1
    node = bpy.data.materials["principled"].node_tree.nodes["Principled BSDF"]
    node.inputs["Roughness"].default_value = 0.9
    with pytest.raises(InputError, match="another scene"):
        bake_scene(scene, geometry_of_scene(scene), cameras, tmp_path)
    report = bake_scene(
        scene, geometry_of_scene(scene), cameras, tmp_path, BakeSettings(overwrite=True)
    )
    assert report.baked == 1
