# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of what objects get of a light: read, edited, noticed and kept in the .blend."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.light_linking import LightLinking, LinkedObjects, ObjectSelection, ObjectWeight
from addon.scene.light_linking_reader import linked_objects
from addon.scene.light_reader import read_lights
from addon.ui.light_objects import objects_beyond_cycles
from addon.ui.write_back_objects import are_objects_current, are_objects_written

from .test_scene_changes import LIGHTS, changes_of


def lamp() -> Any:
    return bpy.data.objects["Light"]


def selection() -> ObjectSelection | None:
    (light,) = with_render_depsgraph(bpy.context.scene, read_lights)
    return light.linking.selection


def add(weight: float, **more: Any) -> Any:
    entry = lamp().relume_objects.entries.add()
    entry.weight = weight
    for name, value in more.items():
        setattr(entry, name, value)
    return entry


def pair() -> Any:
    """A collection of the cube and a second object, "Other"."""
    made = bpy.data.collections.new("pair")
    cube: Any = bpy.data.objects["Cube"]
    other = bpy.data.objects.new("Other", cube.data)
    bpy.context.scene.collection.children.link(made)
    made.objects.link(cube)
    made.objects.link(other)
    return made


def test_the_list_is_read(extension: None) -> None:
    assert selection() is None
    add(0.5, object=bpy.data.objects["Cube"], use_diffuse=False)
    add(3.0, collection=pair())
    add(7.0)
    lamp().relume_objects.others = 0.25
    assert selection() == ObjectSelection(
        (ObjectWeight("Cube", 3.0, 1.5), ObjectWeight("Other", 3.0, 3.0)), 0.25
    )


def test_the_list_is_read_without_the_extension(tmp_path: Path) -> None:
    import addon

    bpy.ops.wm.read_factory_settings()
    addon.register()
    add(0.5, object=bpy.data.objects["Cube"], use_specular=False)
    add(1.0, collection=pair())
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    wanted = selection()
    addon.unregister()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not hasattr(lamp(), "relume_objects")
    assert selection() == wanted
    assert wanted == ObjectSelection((ObjectWeight("Cube", 0.5, 1.0), ObjectWeight("Other")))


def test_edits_concern_lights_alone(extension: None) -> None:
    entry = add(0.5, object=bpy.data.objects["Cube"])
    bpy.context.view_layer.update()
    for edit in (
        lambda: setattr(entry, "weight", 0.25),
        lambda: setattr(entry, "use_diffuse", False),
        lambda: setattr(lamp().relume_objects, "others", 0.0),
    ):
        assert changes_of(edit) == (LIGHTS, False)
    bpy.context.view_layer.objects.active = lamp()
    assert changes_of(bpy.ops.relume.remove_light_object)[0].lights


def test_weights_are_animated(extension: None) -> None:
    entry = add(0.0, object=bpy.data.objects["Cube"])
    entry.keyframe_insert("weight", frame=1)
    entry.weight = 1.0
    entry.keyframe_insert("weight", frame=11)
    bpy.context.scene.frame_set(6)
    found = selection()
    assert found is not None
    assert found.weights[0].diffuse == pytest.approx(0.5)


def test_operators(extension: None) -> None:
    cube = bpy.data.objects["Cube"]
    settings = lamp().relume_objects
    for obj in bpy.data.objects:
        obj.select_set(obj == cube)
    bpy.context.view_layer.objects.active = lamp()
    bpy.ops.relume.add_light_objects()
    assert [entry.object for entry in settings.entries] == [cube]
    bpy.ops.relume.add_light_objects()
    assert [entry.object for entry in settings.entries] == [cube, None]
    bpy.ops.relume.remove_light_object()
    bpy.ops.relume.remove_light_object()
    assert not len(settings.entries)
    assert bpy.ops.relume.remove_light_object() == {"CANCELLED"}
    bpy.context.view_layer.objects.active = cube
    assert not bpy.ops.relume.add_light_objects.poll()


def test_what_cycles_does_not_show_is_said(extension: None) -> None:
    entry = add(0.0, object=bpy.data.objects["Cube"])
    assert not objects_beyond_cycles(lamp())
    entry.weight = 0.5
    (line,) = objects_beyond_cycles(lamp())
    assert "'Cube'" in line


def linked() -> LightLinking:
    (light,) = with_render_depsgraph(bpy.context.scene, read_lights)
    return light.linking


def test_write_to_cycles_and_back(extension: None) -> None:
    """The artist's collection and the list stay what they are, in Relume too."""
    bpy.context.view_layer.objects.active = lamp()
    own = pair()
    lamp().light_linking.receiver_collection = own
    entry = add(0.0, object=bpy.data.objects["Cube"])
    before = linked()
    assert not are_objects_current(lamp().data)
    bpy.ops.relume.write_back()
    assert are_objects_written(lamp().data)
    assert are_objects_current(lamp().data)
    assert linked() == before
    written = lamp().light_linking.receiver_collection
    assert linked_objects(written) == LinkedObjects(frozenset(["Other"]), frozenset(["Cube"]))
    entry.weight = 1.0
    assert not are_objects_current(lamp().data)
    bpy.ops.relume.write_back()
    assert lamp().light_linking.receiver_collection == own
    entry.weight = 0.0
    bpy.ops.relume.write_back()
    bpy.ops.relume.remove_write_back()
    assert lamp().light_linking.receiver_collection == own
    assert not are_objects_written(lamp().data)
    assert len(bpy.data.collections) == 2
    assert linked() == before
