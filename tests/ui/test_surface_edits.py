# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface edits in the interface: kept in the file, noticed, shown, and no reason to bake."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import addon
from addon.caching.fingerprint import scene_fingerprint
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.surface_edit import NO_EDITS, SurfaceEdit, SurfaceEdits
from addon.scene.surface_edit_reader import read_surface_edits
from addon.ui.scene_changes import SceneChanges
from addon.ui.surface_edit_watch import is_edit_alone

from .test_engine import baked, f12, scene
from .test_scene_changes import changes_of

__all__ = ["scene"]

EDIT = SurfaceEdit(0.5, (1.0, 0.75, 0.25), 1.5, -0.25, 2.0, (0.5, 0.5, 1.0), 4.0)


def cube() -> Any:
    return bpy.data.objects["Cube"]


def material() -> Any:
    return bpy.data.materials["Material"]


def set_edit(block: Any, edit: SurfaceEdit) -> None:
    for each in fields(SurfaceEdit):
        setattr(block.relume_edit, each.name, getattr(edit, each.name))


def read() -> SurfaceEdits:
    return with_render_depsgraph(bpy.context.scene, read_surface_edits)


def test_what_is_set_is_read(extension: None) -> None:
    assert read() == NO_EDITS
    set_edit(material(), EDIT)
    set_edit(cube(), SurfaceEdit(gain=0.25))
    assert read() == SurfaceEdits({"Material": EDIT}, {"Cube": SurfaceEdit(gain=0.25)})


def test_a_file_is_read_without_the_extension(tmp_path: Path) -> None:
    bpy.ops.wm.read_factory_settings()
    addon.register()
    set_edit(material(), EDIT)
    cube().relume_edit.specular = 0.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edited.blend"), check_existing=False)
    addon.unregister()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "edited.blend"))
    assert not hasattr(material(), "relume_edit")
    assert read() == SurfaceEdits({"Material": EDIT}, {"Cube": SurfaceEdit(specular=0.5)})


def test_an_animated_edit_is_read_at_its_frame(extension: None) -> None:
    group, current = material().relume_edit, bpy.context.scene
    for frame, gain in ((1, 0.0), (11, 1.0)):
        group.gain = gain
        group.keyframe_insert("gain", frame=frame)
    curve = material().animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0]
    for key in curve.keyframe_points:
        key.interpolation = "LINEAR"
    assert current is not None
    current.frame_set(4)
    assert read().materials["Material"].gain == pytest.approx(0.3)


def test_properties_are_the_edits_and_neutral(extension: None) -> None:
    properties: Any = material().relume_edit.bl_rna.properties
    names = {each.name for each in fields(SurfaceEdit)}
    assert names <= set(properties.keys())
    for name in names:
        assert len(properties[name].description) > 20
    assert read().is_neutral


def edit_and_move() -> None:
    cube().relume_edit.gain = 0.4
    cube().location.x += 1.0


@pytest.mark.parametrize(
    "edit",
    [
        lambda: setattr(cube().relume_edit, "tint", (1.0, 0.5, 0.0)),
        lambda: setattr(material().relume_edit, "roughness", 0.5),
    ],
    ids=["object", "material"],
)
def test_an_edit_concerns_surfaces_alone(extension: None, edit: Callable[[], None]) -> None:
    assert changes_of(edit) == (SceneChanges(edits=True), False)
    assert changes_of(lambda: setattr(cube(), "location", (1, 2, 3)))[0].geometry


def test_a_move_with_an_edit_is_a_move(extension: None) -> None:
    assert changes_of(edit_and_move)[0].geometry


def test_another_frame_forgets_the_edit_before(extension: None) -> None:
    current: Any = bpy.context.scene
    cube().relume_edit.gain = 0.5
    bpy.context.evaluated_depsgraph_get()
    assert is_edit_alone(cube().evaluated_get(bpy.context.evaluated_depsgraph_get()))
    current.frame_set(current.frame_current + 1)
    assert not is_edit_alone(cube().evaluated_get(bpy.context.evaluated_depsgraph_get()))


def test_an_edit_is_no_reason_to_bake(extension: None) -> None:
    def fingerprint() -> str:
        return scene_fingerprint(with_render_depsgraph(bpy.context.scene, read_geometry))

    before = fingerprint()
    set_edit(material(), EDIT)
    set_edit(cube(), EDIT)
    assert fingerprint() == before


@pytest.mark.parametrize("has_world", [False, True])
def test_f12_shows_an_edit_and_its_end(scene: Any, has_world: bool) -> None:
    baked(scene)
    scene.world = scene.world if has_world else None
    before = f12(scene)[..., :3]
    material().relume_edit.gain = 0.5
    after = f12(scene)[..., :3]
    # The floor has no material: it keeps its colour.
    seen = before.max(axis=-1) > 0.01 * before.max()
    factor = (after[seen] / before[seen]).mean(axis=-1)
    assert factor.min() == pytest.approx(0.5, rel=1e-3)
    assert factor.max() == pytest.approx(1.0, rel=1e-3)
    material().relume_edit.gain = 1.0
    np.testing.assert_array_equal(f12(scene)[..., :3], before)


def test_f12_shows_an_objects_edit_under_a_linked_light(scene: Any) -> None:
    baked(scene)
    scene.world = None
    floor = next(obj for obj in scene.objects if obj.name.startswith("Plane"))
    floor.relume_edit.gain = 0.25
    whole = f12(scene)[..., :3]
    receivers: Any = bpy.data.collections.new("receivers")
    receivers.objects.link(floor)
    bpy.data.objects["Light"].light_linking.receiver_collection = receivers
    linked = f12(scene)[..., :3]
    floor.relume_edit.gain = 1.0
    plain = f12(scene)[..., :3]
    lit = plain.max(axis=-1) > 0.01 * plain.max()
    # The cube, which was lit before, is not any more.
    assert 0 < lit.sum() < (whole.max(axis=-1) > 0.01 * plain.max()).sum()
    np.testing.assert_allclose(linked[lit], 0.25 * plain[lit], rtol=1e-3, atol=1e-6)


def test_reset_takes_an_edit_off(extension: None) -> None:
    set_edit(cube(), EDIT)
    set_edit(material(), EDIT)
    bpy.ops.relume.reset_surface_edit(of="object")
    assert read() == SurfaceEdits({"Material": EDIT})
    bpy.ops.relume.reset_surface_edit(of="material")
    assert read() == NO_EDITS
