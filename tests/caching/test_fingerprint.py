# SPDX-License-Identifier: GPL-3.0-or-later
"""A fingerprint changes with what a cache shows, and with nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.fingerprint import scene_fingerprint
from addon.scene.world_reader import world_fingerprint

from .material_grid import add_plane, empty_material, empty_scene, geometry_of_scene, node_in


@pytest.fixture
def scene(tmp_path: Path) -> Any:
    """A plane with a picture file's colours through a group, a light, a camera, a world."""
    scene = empty_scene()
    group = bpy.data.node_groups.new("Tinted", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    gamma = node_in(
        group, "ShaderNodeGamma", Color=group.nodes.new("NodeGroupInput").outputs[0], Gamma=1.5
    )
    group.links.new(gamma.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])

    material, surface = empty_material("Paint")
    tree = material.node_tree
    picture = tree.nodes.new("ShaderNodeTexImage")
    picture.image = save_picture(tmp_path / "picture.png", 0.25)
    tinted = tree.nodes.new("ShaderNodeGroup")
    tinted.node_tree = group
    tree.links.new(picture.outputs["Color"], tinted.inputs[0])
    node = node_in(tree, "ShaderNodeBsdfPrincipled", Base_Color=tinted.outputs[0])
    tree.links.new(node.outputs[0], surface)
    add_plane(scene, "Plane", (0.0, 0.0, 0.0), material)

    for name, data in (
        ("Key", bpy.data.lights.new("Key", "POINT")),
        ("Shot", bpy.data.cameras.new("Shot")),
    ):
        scene.collection.objects.link(bpy.data.objects.new(name, data))
    scene.world = bpy.data.worlds.new("Sky")
    return scene


def save_picture(path: Path, value: float) -> Any:
    """A grey picture of 4 x 4, as a file's image."""
    image = bpy.data.images.new("drawn", 4, 4)
    image.pixels.foreach_set(np.full(64, value, dtype=np.float32))
    image.save(filepath=str(path))
    bpy.data.images.remove(image)
    return bpy.data.images.load(str(path))


def tree() -> Any:
    return bpy.data.materials["Paint"].node_tree


def mesh() -> Any:
    return bpy.data.meshes["Plane"]


def move_vertex(_: Path) -> None:
    mesh().vertices[0].co.z = 1e-3


def move_uv(_: Path) -> None:
    mesh().uv_layers[0].uv[0].vector.x = 0.5


def smooth(_: Path) -> None:
    mesh().shade_smooth()


def color(_: Path) -> None:
    tree().nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.125


def value_in_group(_: Path) -> None:
    bpy.data.node_groups["Tinted"].nodes["Gamma"].inputs["Gamma"].default_value = 2.0


def unlink(_: Path) -> None:
    tree().links.remove(tree().nodes["Principled BSDF"].inputs["Base Color"].links[0])


def other_picture(folder: Path) -> None:
    bpy.data.images.remove(save_picture(folder / "picture.png", 0.75))


def paint_picture(_: Path) -> None:
    bpy.data.images["picture.png"].pixels[0] = 1.0


def colorspace(_: Path) -> None:
    bpy.data.images["picture.png"].colorspace_settings.name = "Non-Color"


def interpolation(_: Path) -> None:
    tree().nodes["Image Texture"].interpolation = "Closest"


def new_object(_: Path) -> None:
    add_plane(bpy.context.scene, "second", (0.0, 0.0, 1.0), bpy.data.materials["Paint"])


@pytest.mark.parametrize(
    "change",
    [
        move_vertex, move_uv, smooth, color, value_in_group, unlink, other_picture, paint_picture,
        colorspace, interpolation, new_object,
    ],
)  # fmt: skip
def test_what_a_bake_shows_counts(
    scene: Any, tmp_path: Path, change: Callable[[Path], None]
) -> None:
    before = scene_fingerprint(geometry_of_scene(scene))
    assert scene_fingerprint(geometry_of_scene(scene)) == before
    change(tmp_path)
    assert scene_fingerprint(geometry_of_scene(scene)) != before


def move_light(scene: Any) -> None:
    scene.objects["Key"].location.x = 5.0
    scene.objects["Key"].data.energy = 7.0


def move_camera(scene: Any) -> None:
    scene.objects["Shot"].location.z = 3.0
    scene.render.resolution_x = 99


def arrange_nodes(_: Any) -> None:
    node = tree().nodes["Principled BSDF"]
    node.location = (500.0, 100.0)
    node.select = not node.select
    node.label = "shiny"


def unused_node(_: Any) -> None:
    node_in(tree(), "ShaderNodeGamma", Gamma=3.0)


def select(scene: Any) -> None:
    scene.objects["Plane"].select_set(True)
    mesh().vertices[0].select = False


def touch_picture(scene: Any) -> None:
    """The same content with another time, as after a copy to another machine."""
    del scene
    path = Path(bpy.path.abspath(bpy.data.images["picture.png"].filepath))
    path.write_bytes(path.read_bytes())


@pytest.mark.parametrize(
    "change", [move_light, move_camera, arrange_nodes, unused_node, select, touch_picture]
)
def test_what_no_bake_shows_does_not_count(scene: Any, change: Callable[[Any], None]) -> None:
    before = scene_fingerprint(geometry_of_scene(scene))
    change(scene)
    assert scene_fingerprint(geometry_of_scene(scene)) == before


def test_a_saved_file_keeps_its_fingerprint(scene: Any, tmp_path: Path) -> None:
    before = scene_fingerprint(geometry_of_scene(scene)), world_fingerprint(scene)
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    again = bpy.context.scene
    assert (scene_fingerprint(geometry_of_scene(again)), world_fingerprint(again)) == before


def test_the_world_has_its_own(scene: Any) -> None:
    surfaces, world = scene_fingerprint(geometry_of_scene(scene)), world_fingerprint(scene)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 2.5
    assert scene_fingerprint(geometry_of_scene(scene)) == surfaces
    assert world_fingerprint(scene) != world
    scene.world = None
    assert world_fingerprint(scene) == ""
