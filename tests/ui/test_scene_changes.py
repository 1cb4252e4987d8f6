# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import pytest

from addon.ui.scene_changes import NOTHING, SceneChanges, read_changes, scene_key, world_key


def changes_of(edit: Callable[[], None]) -> tuple[SceneChanges, bool]:
    """What an edit is seen as, and whether the scene's key changed."""
    view_layer: Any = bpy.context.view_layer
    view_layer.update()
    found = [NOTHING]

    def note(_scene: Any, depsgraph: Any) -> None:
        found[0] = found[0] | read_changes(depsgraph)

    graph = bpy.context.evaluated_depsgraph_get()
    before = scene_key(graph)
    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        edit()
        view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    return found[0], scene_key(bpy.context.evaluated_depsgraph_get()) != before


def objects() -> Any:
    return bpy.data.objects


def set_strength(light: Any, strength: float) -> None:
    node = next(n for n in light.node_tree.nodes if n.type == "EMISSION")
    node.inputs["Strength"].default_value = strength


LIGHTS = SceneChanges(lights=True)


@pytest.mark.parametrize(
    "edit",
    [
        lambda: setattr(objects()["Light"], "location", (1, 2, 3)),
        lambda: setattr(objects()["Light"].data, "energy", 5.0),
        lambda: setattr(objects()["Light"].data, "color", (1, 0, 0)),
        lambda: set_strength(objects()["Light"].data, 3.0),
        lambda: setattr(objects()["Light"].relume, "mute", True),
        lambda: setattr(objects()["Light"].relume, "solo", True),
    ],
    ids=["move", "energy", "colour", "nodes", "mute", "solo"],
)
def test_a_light_edit_concerns_lights_alone(extension: None, edit: Callable[[], None]) -> None:
    assert changes_of(edit) == (LIGHTS, False)


def receive(*names: str) -> Any:
    """The light gets a collection of receivers."""
    made = bpy.data.collections.new("receivers")
    for name in names:
        made.objects.link(objects()[name])
    objects()["Light"].light_linking.receiver_collection = made
    bpy.context.view_layer.update()
    return made


@pytest.mark.parametrize(
    "edit",
    [
        lambda made: setattr(objects()["Light"].light_linking, "receiver_collection", None),
        lambda made: setattr(objects()["Light"].light_linking, "blocker_collection", made),
        lambda made: made.objects.unlink(objects()["Cube"]),
        lambda made: setattr(made.collection_objects[0].light_linking, "link_state", "EXCLUDE"),
        lambda made: made.children.link(bpy.data.collections.new("more")),
    ],
    ids=["receivers", "blockers", "objects", "state", "children"],
)
def test_linking_concerns_lights_alone(extension: None, edit: Callable[[Any], None]) -> None:
    made = receive("Cube")
    found, key_changed = changes_of(lambda: edit(made))
    # Blender lists each object then, so that it may have been a surface's edit as well.
    assert replace(found, edits=False) == LIGHTS
    assert not key_changed


def test_casting_no_shadow_changes_the_key(extension: None) -> None:
    assert changes_of(lambda: setattr(objects()["Cube"], "visible_shadow", False))[1]
    assert changes_of(lambda: setattr(objects()["Cube"], "visible_camera", False))[1]


def test_moving_a_mesh_concerns_geometry(extension: None) -> None:
    found, _ = changes_of(lambda: setattr(objects()["Cube"], "location", (1, 2, 3)))
    assert found.geometry
    assert not found.lights


def test_moving_the_camera_concerns_neither(extension: None) -> None:
    found, key_changed = changes_of(lambda: setattr(objects()["Camera"], "location", (1, 2, 3)))
    assert found == NOTHING
    assert not key_changed


def test_selecting_concerns_nothing(extension: None) -> None:
    found, key_changed = changes_of(lambda: objects()["Cube"].select_set(False))
    assert found == NOTHING
    assert not key_changed


@pytest.mark.parametrize("name", ["Light", "Cube"])
def test_hiding_and_removing_change_the_key(extension: None, name: str) -> None:
    assert changes_of(lambda: objects()[name].hide_set(True))[1]
    assert changes_of(lambda: objects()[name].hide_set(False))[1]
    assert changes_of(lambda: objects().remove(objects()[name]))[1]


def test_the_worlds_colour_concerns_the_world(extension: None) -> None:
    world: Any = bpy.context.scene.world
    node = world.node_tree.nodes["Background"]
    found, _ = changes_of(lambda: setattr(node.inputs["Color"], "default_value", (1, 0, 0, 1)))
    assert found == SceneChanges(world=True)


def test_a_materials_edit_concerns_what_is_baked(extension: None) -> None:
    node = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"]
    found, _ = changes_of(lambda: setattr(node.inputs["Roughness"], "default_value", 0.9))
    assert found.materials
    assert not found.lights
    assert not found.world


def test_another_world_changes_its_key(extension: None) -> None:
    scene = bpy.context.scene
    keys = [world_key(bpy.context.evaluated_depsgraph_get())]
    edits: list[tuple[Any, str, Any]] = [
        (scene, "world", bpy.data.worlds.new("Other")),
        (scene, "world", None),
        (scene.render, "film_transparent", True),
    ]
    for owner, name, value in edits:
        setattr(owner, name, value)
        keys.append(world_key(bpy.context.evaluated_depsgraph_get()))
    assert len(set(keys)) == 4
