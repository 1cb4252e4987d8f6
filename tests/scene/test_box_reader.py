# SPDX-License-Identifier: GPL-3.0-or-later
"""The box of interest that an object bounds."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from addon.scene.box_reader import find_box, read_box
from addon.scene.object_matrix_reader import world_from_object
from tests.scene.test_geometry_reader import add_mesh, instanced, scene, subdivided

__all__ = ["scene"]

CUBE: list[tuple[float, float, float]] = [
    (x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)
]
FACES: list[tuple[int, ...]] = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4)]


def box(obj: Any) -> np.ndarray:
    bpy.context.view_layer.update()
    return read_box(bpy.context.evaluated_depsgraph_get(), obj)


def empty(scene: bpy.types.Scene) -> bpy.types.Object:
    obj = bpy.data.objects.new("Box", None)
    scene.collection.objects.link(obj)
    return obj


def test_an_empty_bounds_its_cube(scene: bpy.types.Scene) -> None:
    obj = empty(scene)
    obj.empty_display_size = 2.0
    obj.location, obj.scale = (1.0, 2.0, 3.0), (1.0, -2.0, 0.5)
    # float32's spacing near 6
    np.testing.assert_allclose(box(obj), [[-1, -2, 2], [3, 6, 4]], atol=1e-6)


def test_a_turned_empty_bounds_the_box_around_it(scene: bpy.types.Scene) -> None:
    obj = empty(scene)
    obj.rotation_euler = (0.0, 0.0, np.pi / 4)
    side = np.sqrt(2.0)
    np.testing.assert_allclose(box(obj), [[-side, -side, -1], [side, side, 1]], atol=1e-6)


def test_a_mesh_bounds_its_vertices_with_its_modifiers_on(scene: bpy.types.Scene) -> None:
    obj = add_mesh(scene, "Mesh", CUBE, FACES)
    array = obj.modifiers.new("Array", "ARRAY")
    array.use_relative_offset, array.use_constant_offset = False, True
    array.constant_offset_displace = (3.0, 0.0, 0.0)
    array.count = 2
    obj.parent = empty(scene)
    obj.parent.location = (0.0, 10.0, 0.0)
    np.testing.assert_allclose(box(obj), [[0, 10, 0], [4, 11, 1]])


def test_an_object_that_is_not_rendered_or_seen_is_good_enough(scene: bpy.types.Scene) -> None:
    obj = empty(scene)
    obj.parent = empty(scene)
    obj.parent.location = (5.0, 0.0, 0.0)
    obj.hide_render = True
    inner = bpy.data.collections.new("Off")
    scene.collection.children.link(inner)
    for item in (obj, obj.parent):
        scene.collection.objects.unlink(item)
        inner.objects.link(item)
    scene.view_layers[0].layer_collection.children["Off"].exclude = True
    np.testing.assert_allclose(box(obj), [[4, -1, -1], [6, 1, 1]])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    np.testing.assert_allclose(world_from_object(depsgraph, obj)[:3, 3], [5, 0, 0])


def test_an_empty_that_instances_bounds_what_it_shows(scene: bpy.types.Scene) -> None:
    mesh = add_mesh(scene, "Mesh", CUBE, FACES)
    subdivided(mesh, 1)
    obj = instanced(scene, mesh)
    obj.location, obj.scale = (2.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    np.testing.assert_allclose(box(obj), [[2, 0, 0], [4, 2, 2]])


def test_what_bounds_no_box_is_named(scene: bpy.types.Scene) -> None:
    flat = add_mesh(scene, "Flat")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    with pytest.raises(InputError, match=r"'Flat' is flat"):
        box(flat)
    with pytest.raises(InputError, match=r"'Lamp' is a light"):
        box(lamp)
    vertexless = bpy.data.objects.new("None", bpy.data.meshes.new("None"))
    scene.collection.objects.link(vertexless)
    with pytest.raises(InputError, match=r"'None' holds nothing"):
        box(vertexless)
    with pytest.raises(InputError, match="no object 'Nobody'"):
        find_box(bpy.context.evaluated_depsgraph_get(), scene, "Nobody")
