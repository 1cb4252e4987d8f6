# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's file is the same after a bake as before it, however the bake ends."""

from __future__ import annotations

import math
import os
import pkgutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.progress import Cancelled

from .full_scene import full_scene
from .material_grid import add_plane, camera_above, empty_material, geometry_of_scene, node_in
from .rna_dump import differences, dump


@pytest.fixture
def scene() -> Any:
    return full_scene()


CAMERAS = [camera_above((0, 0, 0), 5.0, number=number) for number in range(2)]


def test_a_dump_changes_nothing(scene: Any) -> None:
    before = dump()
    assert differences(before, dump()) == []
    assert len(before) > 10_000


def _node(material: str, node: str) -> Any:
    return bpy.data.materials[material].node_tree.nodes[node]


def _hide_in_second(scene: Any) -> None:
    bpy.data.objects["bare"].hide_set(True, view_layer=scene.view_layers["second"])


def _key_again(scene: Any) -> None:
    action = bpy.data.objects["textured"].animation_data.action
    curve = action.layers[0].strips[0].channelbags[0].fcurves[0]
    curve.keyframe_points[0].interpolation = "CONSTANT"


def _exclude(scene: Any) -> None:
    scene.view_layers[0].layer_collection.children["excluded"].exclude = True


def _swap_links(scene: Any) -> None:
    tree = bpy.data.node_groups["graded"]
    start = next(node for node in tree.nodes if node.bl_idname == "NodeGroupInput")
    curves = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeRGBCurve")
    tree.links.new(start.outputs[0], curves.inputs["Color"])


def _driver_target(scene: Any) -> None:
    driver = bpy.data.objects["mixed"].animation_data.drivers[0].driver
    driver.variables[0].targets[0].data_path = "location.x"


_GRADED: dict[str, Callable[[Any], None]] = {
    "a ramp in a group": lambda s: setattr(
        bpy.data.node_groups["graded"].nodes["Color Ramp"].color_ramp.elements[1], "position", 0.5
    ),
    "a curve in a group": lambda s: setattr(
        bpy.data.node_groups["graded"].nodes["RGB Curves"].mapping.curves[3].points[1],
        "location",
        (0.3, 0.7),
    ),
    "a link in a group": _swap_links,
}

CHANGES: dict[str, Callable[[Any], None]] = {
    **_GRADED,
    "a setting of Cycles": lambda s: setattr(s.cycles, "samples", 78),
    "a render setting": lambda s: setattr(s.render.image_settings, "quality", 3),
    "a node's value": lambda s: setattr(
        _node("principled", "Principled BSDF").inputs["Roughness"], "default_value", 0.111
    ),
    "a node's place": lambda s: setattr(
        _node("principled", "Principled BSDF"), "location", (3.0, 4.0)
    ),
    "a material on a mesh": lambda s: bpy.data.objects["mixed"].data.materials.__setitem__(
        0, bpy.data.materials["spare"]
    ),
    "a face's material": lambda s: setattr(
        bpy.data.meshes["slots"].polygons[0], "material_index", 2
    ),
    "a vertex": lambda s: setattr(bpy.data.meshes["bare"].vertices[1].co, "x", 7.0),
    "a vertex group": lambda s: (
        bpy.data.objects["deformed"].vertex_groups[0].add([0], 0.1, "REPLACE")
    ),
    "a shape key": lambda s: setattr(
        bpy.data.shape_keys[0].key_blocks["raised"].data[1].co, "z", 0.3
    ),
    "a modifier": lambda s: setattr(
        bpy.data.objects["deformed"].modifiers["smooth"], "show_viewport", True
    ),
    "a keyframe": _key_again,
    "a driver's variable": _driver_target,
    "a marker": lambda s: setattr(s.timeline_markers[0], "frame", 8),
    "a custom property": lambda s: bpy.data.materials["textured"].__setitem__("of its own", 4),
    "a pointer in one": lambda s: bpy.data.objects["pointing"].__setitem__(
        "its material", bpy.data.materials["spare"]
    ),
    "a nested one": lambda s: bpy.data.objects["pointing"]["more"]["inner"].__setitem__(
        "word", "other"
    ),
    "a pixel": lambda s: bpy.data.images["generated"].pixels.__setitem__(5, 0.9),
    "an image's file": lambda s: setattr(bpy.data.images["missing"], "filepath", "//b.png"),
    "the selection": lambda s: bpy.data.objects["bare"].select_set(
        False, view_layer=s.view_layers[0]
    ),
    "the active object": lambda s: setattr(
        s.view_layers[0].objects, "active", bpy.data.objects["slots"]
    ),
    "what is hidden in a layer": _hide_in_second,
    "an excluded collection": _exclude,
    "a pass": lambda s: setattr(s.view_layers["second"], "use_pass_uv", True),
    "a fake user": lambda s: setattr(bpy.data.materials["spare"], "use_fake_user", True),
    "a new block": lambda s: bpy.data.node_groups.new("left over", "ShaderNodeTree"),
    "the frame": lambda s: s.frame_set(13),
    "the part of a frame": lambda s: s.frame_set(12, subframe=0.5),
    "the world's nodes": lambda s: setattr(
        s.world.node_tree.nodes["Gradient Texture"], "gradient_type", "RADIAL"
    ),
    "another scene": lambda s: setattr(bpy.data.scenes["other"], "world", None),
    "a text": lambda s: bpy.data.texts["notes"].write("more"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_dump_sees_a_change(scene: Any, what: str) -> None:
    before = dump()
    CHANGES[what](scene)
    assert differences(before, dump())


def test_after_a_bake(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()
    report = bake_scene(scene, geometry, CAMERAS, tmp_path)
    assert report.baked == 2
    # With all that a bake may do: a white sky for cut-outs, and the world's picture.
    assert "ambient_occlusion" in report.plan.stored
    assert CacheStore.open(tmp_path).world_path is not None
    assert differences(before, dump()) == []
    assert bpy.context.scene == scene


class Stopper:
    """Stops a bake when it tells its progress for the time `last`; counts the times."""

    def __init__(self, last: float, error: BaseException) -> None:
        self._last, self._error, self.count = last, error, 0

    def __call__(self, fraction: float, message: str) -> None:
        self.count += 1
        if self.count > self._last:
            raise self._error


@pytest.mark.parametrize("error", [Cancelled(), KeyboardInterrupt()])
def test_after_a_bake_that_is_stopped_at_each_step(
    scene: Any, tmp_path: Path, error: BaseException
) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()
    counted = Stopper(math.inf, error)
    bake_scene(scene, geometry, CAMERAS, tmp_path / "whole", None, counted)
    assert counted.count >= 5
    for last in range(counted.count):
        folder = tmp_path / str(last)
        with pytest.raises(type(error)):
            bake_scene(scene, geometry, CAMERAS, folder, None, Stopper(last, error))
        assert differences(before, dump()) == []
        assert not list(folder.rglob("*.part"))


# Where a bake may fail, and how often that place is come by.
PLACES = {
    "addon.caching.aov_render.render_to": 4,
    "addon.caching.aov_render.OpenEXR.File": 2,
    "addon.caching.aov_render._set_up_cycles": 1,
    "addon.caching.aov_render.Stage": 1,
    "addon.scene.world_reader.render_to": 1,
    "addon.scene.world_reader._set_up": 1,
    "addon.caching.store.write_parts": 3,
    "addon.caching.store.CacheStore.write_manifest": 3,
    "addon.caching.specialize.plan_channels": 1,
    "addon.caching.specialize._instrument": 5,
    "addon.caching.specialize.ShaderReader.shader": 4,
    "addon.caching.specialize.view_dependent_effects": 3,
}


@pytest.mark.parametrize("place", PLACES)
def test_after_an_error_inside(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """At each time that this place is come by."""
    geometry = geometry_of_scene(scene)
    before = dump()
    module, _, name = place.rpartition(".")
    holder = pkgutil.resolve_name(module)
    real = getattr(holder, name)
    for last in range(PLACES[place]):
        calls = 0

        def fail(*words: Any, **named: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls > last:  # noqa: B023 - called in this turn
                raise RuntimeError(place)
            return real(*words, **named)

        monkeypatch.setattr(holder, name, fail)
        with pytest.raises((RuntimeError, InputError)):
            bake_scene(scene, geometry, CAMERAS, tmp_path / str(last))
        monkeypatch.undo()
        assert differences(before, dump()) == []


def test_after_a_bake_onto_a_full_disk(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()
    monkeypatch.setattr("secrets.token_hex", lambda count: "token")

    def fill(fraction: float, message: str) -> None:
        if "camera 2" in message:
            part = tmp_path / "cameras" / f".0001.exr.token.{os.getpid()}.part"
            part.symlink_to("/dev/full")

    with pytest.raises(InputError, match="the disk is full"):
        bake_scene(scene, geometry, CAMERAS, tmp_path, None, fill)
    assert differences(before, dump()) == []
    assert [camera.id for camera in CacheStore.open(tmp_path).cameras] == [0]
    assert not list(tmp_path.rglob("*.part"))


def test_after_a_bake_without_a_folder_for_temporary_files(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    geometry = geometry_of_scene(scene)
    before = dump()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    with pytest.raises(InputError, match="TMPDIR") as caught:
        bake_scene(scene, geometry, CAMERAS, tmp_path / "cache")
    assert "\n" not in str(caught.value)
    assert differences(before, dump()) == []


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
    add_plane(scene, "broken", (-1.0, 3.0, 0.0), material)
    geometry = geometry_of_scene(scene)
    before = dump()
    with pytest.raises(InputError, match=r"material .broken. gives .emission"):
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
