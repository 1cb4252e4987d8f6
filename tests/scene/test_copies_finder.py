# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes are found to stand in a scene many times."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.scene import copies_finder
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry import SceneGeometry
from addon.scene.geometry_reader import read_geometry
from addon.scene.mesh_copies import keeps_digits
from addon.scene.octahedral import from_codes

# Of two 16-bit numbers (`octahedral`), once in each space, in radians.
CODE_ERROR = 3e-4


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> bpy.types.Scene:
    """An empty one, of which even small meshes are worth it."""
    monkeypatch.setattr(copies_finder, "LEAST_TRIANGLES", 4)
    monkeypatch.setattr(copies_finder, "LEAST_SPARED_OF_MESH", 8)
    monkeypatch.setattr(copies_finder, "LEAST_SPARED", 8)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def masked_material(name: str) -> bpy.types.Material:
    """Cut out by a picture: all of a texel, or nothing."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    picture = nodes.new("ShaderNodeTexImage")
    picture.image = bpy.data.images.new(name, 4, 4, alpha=True)
    picture.image.pixels.foreach_set((np.arange(64) % 12 > 5).astype(np.float32))
    links.new(picture.outputs["Alpha"], nodes["Principled BSDF"].inputs["Alpha"])
    return material


def tree_mesh() -> bpy.types.Mesh:
    """Smooth, in two materials, one cut out."""
    rng = np.random.default_rng(2)
    corners = rng.normal(size=(12, 3))
    faces = [tuple(rng.permutation(12)[:3]) for _ in range(9)]
    mesh = bpy.data.meshes.new("Tree")
    mesh.from_pydata(corners.tolist(), [], [tuple(map(int, face)) for face in faces])
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    mesh.polygons.foreach_set("material_index", [index % 2 for index in range(len(faces))])
    layer = mesh.uv_layers.new(name="Map")
    layer.uv.foreach_set("vector", rng.uniform(size=2 * len(mesh.loops)).astype(np.float32))
    mesh.materials.append(bpy.data.materials.new("Bark"))
    mesh.materials.append(masked_material("Leaf"))
    return mesh


def add(scene: bpy.types.Scene, mesh: bpy.types.Mesh, name: str) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def read(scene: bpy.types.Scene) -> SceneGeometry:
    return with_render_depsgraph(scene, read_geometry)


def check(geometry: SceneGeometry) -> None:
    """Every copy is the triangles that the scene has of it."""
    for copies in geometry.copies:
        assert len(copies) > 1
        assert (np.diff(copies.first) > 0).all()
        for index, matrix in enumerate(copies.world_from_mesh):
            some = copies.first[index] + np.arange(len(copies.triangles))
            turned = slice(None, None, -1 if np.linalg.det(matrix[:3, :3]) < 0.0 else 1)
            world = copies.corners @ matrix[:3, :3].T + matrix[:3, 3]
            corners = geometry.vertices[geometry.triangles[some]][:, turned]
            assert np.abs(corners - world).max() < 1e-9
            assert (geometry.object_id[some] == copies.object_id[index]).all()
            assert np.array_equal(geometry.material_id[some], copies.material_id)
            assert (geometry.camera_visible[some] == copies.camera_visible).all()
            assert (geometry.shadow_visible[some] == copies.shadow_visible).all()
            if geometry.uv is not None:
                assert copies.uv is not None
                assert np.array_equal(geometry.uv[some][:, turned], copies.uv)
            assert geometry.corner_normals is not None
            assert copies.corner_normals is not None
            normal = from_codes(copies.corner_normals) @ np.linalg.inv(matrix[:3, :3])
            normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
            found = from_codes(geometry.corner_normals[some][:, turned])
            assert np.abs(normal - found).max() < CODE_ERROR
            # The side that the artist gave it, mirrored or not.
            flat = copies.normal @ np.linalg.inv(matrix[:3, :3])
            assert (np.sum(flat * geometry.normal[some], axis=1) > 0.0).all()


def test_linked_duplicates(scene: bpy.types.Scene) -> None:
    mesh = tree_mesh()
    alone = bpy.data.meshes.new("Alone")
    alone.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    add(scene, alone, "Alone")
    for index, size in enumerate([(1, 1, 1), (-1, 1, 1), (2, 0.5, 1), (-1, -1, -3)]):
        obj = add(scene, mesh, f"Tree {index}")
        obj.scale, obj.location = size, (3.0 * index, 1.0, 0.0)
        obj.rotation_euler = (0.3 * index, 0.2, 1.0)
    flat = add(scene, mesh, "Flat")
    flat.scale = (1.0, 1.0, 0.0)
    geometry = read(scene)
    (copies,) = geometry.copies
    assert geometry.uv is not None
    assert len(geometry.cutouts) == 1
    names = [geometry.object_names[index] for index in copies.object_id]
    assert names == [f"Tree {index}" for index in range(4)]
    assert copies.spared == 3 * 9
    check(geometry)


def test_what_differs_stands_apart(scene: bpy.types.Scene) -> None:
    """By material, by who sees it, and what is sheared too far."""
    mesh = tree_mesh()
    for index in range(3):
        add(scene, mesh, f"Tree {index}")
        painted = add(scene, mesh, f"Painted {index}")
        painted.material_slots[0].link = "OBJECT"
        painted.material_slots[0].material = bpy.data.materials["Leaf"]
        add(scene, mesh, f"Unseen {index}").visible_camera = False
    sheared = add(scene, mesh, "Sheared")
    # An object's own matrix has no shear; what it has from its parent may.
    sheared.parent = bpy.data.objects["Tree 0"]
    sheared.matrix_parent_inverse = Matrix.Shear("XY", 4, (3.0, 0.0))
    geometry = read(scene)
    found = sorted(
        tuple(sorted({geometry.object_names[i].split()[0] for i in copies.object_id}))
        for copies in geometry.copies
    )
    assert found == [("Painted",), ("Tree",), ("Unseen",)]
    check(geometry)


def test_instances_of_a_collection(scene: bpy.types.Scene) -> None:
    mesh = tree_mesh()
    collection = bpy.data.collections.new("Trees")
    collection.objects.link(bpy.data.objects.new("Tree", mesh))
    for index in range(3):
        empty = bpy.data.objects.new(f"Grove {index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location = (5.0 * index, 0.0, 0.0)
        scene.collection.objects.link(empty)
    geometry = read(scene)
    assert [len(copies) for copies in geometry.copies] == [3]
    check(geometry)


def test_what_light_passes_through_is_drawn_in_layers(scene: bpy.types.Scene) -> None:
    """And flattened, as layers are told apart triangle by triangle."""
    mesh = tree_mesh()
    for index in range(3):
        add(scene, mesh, f"Tree {index}")
    assert read(scene).copies
    pixels = np.full(64, 0.5, dtype=np.float32)
    bpy.data.images["Leaf"].pixels.foreach_set(pixels)
    geometry = read(scene)
    assert geometry.sheers
    assert not geometry.copies


def test_few_triangles_are_not_worth_it(
    scene: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = tree_mesh()
    for index in range(3):
        add(scene, mesh, f"Tree {index}")
    assert read(scene).copies
    monkeypatch.setattr(copies_finder, "LEAST_SPARED", 2 * 9 + 1)
    assert not read(scene).copies
    monkeypatch.setattr(copies_finder, "LEAST_SPARED", 2 * 9)
    assert read(scene).copies
    monkeypatch.setattr(copies_finder, "LEAST_SPARED_OF_MESH", 2 * 9 + 1)
    assert not read(scene).copies
    monkeypatch.setattr(copies_finder, "LEAST_SPARED_OF_MESH", 8)
    monkeypatch.setattr(copies_finder, "LEAST_TRIANGLES", 10)
    assert not read(scene).copies


def test_which_places_keep_digits() -> None:
    def matrix(axes: np.ndarray) -> np.ndarray:
        result = np.eye(4)
        result[:3, :3] = axes
        return result

    assert keeps_digits(matrix(np.diag([1e-3, 50.0, -2.0])))
    assert not keeps_digits(matrix(np.diag([1.0, 1.0, 0.0])))
    assert not keeps_digits(matrix(np.array([[1.0, 0.9, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 1.0]])))
    assert not keeps_digits(matrix(np.full((3, 3), np.nan)))
