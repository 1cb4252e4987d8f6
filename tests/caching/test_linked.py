# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces and materials that come from libraries, and from geometry nodes, are baked too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.progress import Cancelled

from .material_grid import (
    HALF,
    add_plane,
    at,
    camera_above,
    empty_material,
    empty_scene,
    geometry_of_scene,
    node_in,
)
from .rna_dump import differences, dump

RED, GREEN, BLUE = (0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8)


def paint(name: str, color: tuple[float, float, float]) -> Any:
    material, surface = empty_material(name)
    node = node_in(material.node_tree, "ShaderNodeBsdfDiffuse", Color=color)
    material.node_tree.links.new(node.outputs[0], surface)
    return material


def write_library(path: Path) -> None:
    """Three collections: a plane painted red in each, made by geometry nodes in "Nodes"."""
    scene = empty_scene()
    for name in ("Set", "Override", "Excluded"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        plane = add_plane(scene, f"{name} plane", (0.0, 0.0, 0.0), bpy.data.materials.get("Paint"))
        if not plane.data.materials:
            plane.data.materials.append(paint("Paint", RED))
        scene.collection.objects.unlink(plane)
        collection.objects.link(plane)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def link_collection(path: Path, name: str) -> Any:
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.collections = [name]
    return next(c for c in bpy.data.collections if c.name == name and c.library is not None)


def set_material_nodes(material: Any) -> Any:
    """A geometry node group that gives everything a material."""
    group = bpy.data.node_groups.new("Repaint", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    node = node_in(
        group, "GeometryNodeSetMaterial", Geometry=group.nodes.new("NodeGroupInput").outputs[0]
    )
    node.inputs["Material"].default_value = material
    group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    return group


@pytest.fixture
def scene(tmp_path: Path) -> Any:
    """An instance, an override and an unused collection of a library whose material has the
    name of a local one; a plane that geometry nodes repaint."""
    library = tmp_path / "library.blend"
    write_library(library)
    scene = empty_scene()
    add_plane(scene, "local", (-1.0, 0.0, 0.0), paint("Paint", GREEN))

    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type = "COLLECTION"
    instancer.instance_collection = link_collection(library, "Set")
    instancer.location = (1.0, 0.0, 0.0)
    scene.collection.objects.link(instancer)

    override = link_collection(library, "Override").override_hierarchy_create(
        scene, scene.view_layers[0]
    )
    override.objects[0].location = (-1.0, 1.5, 0.0)

    scene.collection.children.link(link_collection(library, "Excluded"))
    children = scene.view_layers[0].layer_collection.children
    children["Excluded"].exclude = True

    blue = paint("Blue", BLUE)
    blue.use_fake_user = True
    repainted = add_plane(scene, "repainted", (1.0, 1.5, 0.0), bpy.data.materials["Paint", None])
    repainted.modifiers.new("Repaint", "NODES").node_group = set_material_nodes(blue)
    return scene


def changes(before: dict[str, str]) -> list[str]:
    """What a bake left changed, but for Blender's note that linked data was used directly."""
    return [line for line in differences(before, dump()) if "].is_library_indirect:" not in line]


@pytest.mark.parametrize(
    ("place", "color"),
    [((-1, 0, 0), GREEN), ((1, 0, 0), RED), ((-1, 1.5, 0), RED), ((1, 1.5, 0), BLUE)],
)
def test_each_surface_has_its_own_material(
    scene: Any, tmp_path: Path, place: Any, color: Any
) -> None:
    cameras = [camera_above((0.0, 0.75, 0.0), 3.0)]
    bake_scene(scene, geometry_of_scene(scene), cameras, tmp_path / "cache")
    store = CacheStore.open(tmp_path / "cache")
    assert set(store.plan.material_names) == {"Paint", "Paint [library.blend]", "Blue"}
    found = at(store.read_camera(0), store, "diffuse_color", place)
    assert np.allclose(found, color, rtol=HALF, atol=0.0)
    # Nothing of the collection that the view layer leaves out.
    assert at(store.read_camera(0), store, "depth", (0.0, 0.0, 0.0)) == 0.0


def test_linked_data_is_linked_again(scene: Any, tmp_path: Path) -> None:
    geometry = geometry_of_scene(scene)
    cameras = [camera_above((0.0, 0.75, 0.0), 3.0)]
    before = dump()
    bake_scene(scene, geometry, cameras, tmp_path / "cache")
    assert changes(before) == []


@pytest.mark.parametrize("message", ["Reading", "camera 1", "camera 2"])
def test_linked_data_is_linked_again_when_stopped(scene: Any, tmp_path: Path, message: str) -> None:
    geometry = geometry_of_scene(scene)
    cameras = [camera_above((0.0, 0.75, 0.0), 3.0, number=i) for i in range(2)]
    before = dump()

    def stop(_: float, now: str) -> None:
        if message in now:
            raise Cancelled

    with pytest.raises(Cancelled):
        bake_scene(scene, geometry, cameras, tmp_path / "cache", BakeSettings(), stop)
    assert changes(before) == []
