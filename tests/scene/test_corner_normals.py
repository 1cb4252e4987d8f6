# SPDX-License-Identifier: GPL-3.0-or-later
"""The normals that meshes interpolate for shading are read as Cycles has them."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.camplace.camera import CachingCamera
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry import SceneGeometry
from addon.scene.geometry_reader import read_geometry
from addon.scene.octahedral import from_codes
from tests import synthetic
from tests.reference.shading_normal import shading_normals

# Of two 16-bit numbers (`octahedral`), in radians.
CODE_ERROR = 7e-5


@pytest.fixture
def scene() -> bpy.types.Scene:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add_cube(scene: bpy.types.Scene, name: str, *, smooth: bool) -> bpy.types.Object:
    """From -1 to 1; smooth, its corners' normals lie along its diagonals."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def read(scene: bpy.types.Scene) -> SceneGeometry:
    return with_render_depsgraph(scene, read_geometry)


def test_flat_faces_have_none(scene: bpy.types.Scene) -> None:
    add_cube(scene, "Flat", smooth=False)
    assert read(scene).corner_normals is None


@pytest.mark.parametrize("scale", [(1, 1, 1), (2.0, 3.0, 0.5), (-2.0, 3.0, 0.5), (-1, -1, -1)])
def test_of_stretched_and_mirrored_objects(
    scene: bpy.types.Scene, scale: tuple[float, float, float]
) -> None:
    cube = add_cube(scene, "Smooth", smooth=True)
    cube.scale = scale
    cube.location = (5.0, 6.0, 7.0)
    geometry = read(scene)
    assert geometry.corner_normals is not None
    found = from_codes(geometry.corner_normals).reshape(-1, 3)
    # Along the diagonals of a cube, and across a surface: by the scale's inverse.
    corner = geometry.vertices[geometry.triangles].reshape(-1, 3) - np.array(cube.location)
    expected = corner / np.square(scale)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.linalg.norm(found - expected, axis=1).max() < CODE_ERROR + 1e-6


def test_flat_objects_beside_smooth_ones_keep_their_faces(scene: bpy.types.Scene) -> None:
    add_cube(scene, "Smooth", smooth=True)
    add_cube(scene, "Flat", smooth=False).location = (4, 0, 0)
    geometry = read(scene)
    assert geometry.corner_normals is not None
    name = np.array(geometry.object_names)[geometry.object_id]
    flat = from_codes(geometry.corner_normals[name == "Flat"])
    apart = np.linalg.norm(flat - geometry.normal[name == "Flat"][:, None], axis=-1)
    assert apart.max() < CODE_ERROR


def material(kind: str) -> bpy.types.Material:
    """Without anything on its normal, or with a Bump node, or with a displacement."""
    made = bpy.data.materials.new(kind)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    if kind == "plain":
        return made
    noise = nodes.new("ShaderNodeTexNoise")
    if kind == "bump":
        bump = nodes.new("ShaderNodeBump")
        bump.inputs["Distance"].default_value = 0.5
        links.new(noise.outputs["Factor"], bump.inputs["Height"])
        links.new(bump.outputs["Normal"], nodes["Principled BSDF"].inputs["Normal"])
    else:
        moved = nodes.new("ShaderNodeDisplacement")
        links.new(noise.outputs["Factor"], moved.inputs["Height"])
        links.new(moved.outputs["Displacement"], nodes["Material Output"].inputs["Displacement"])
    return made


def test_cycles_shades_with_them_but_for_bumps(scene: bpy.types.Scene, tmp_path: Path) -> None:
    from addon.caching.bake import bake_scene
    from addon.caching.store import CacheStore
    from addon.caching.stored_framebuffers import StoredFramebuffers

    for number, kind in enumerate(("plain", "bump", "displaced")):
        cube = add_cube(scene, kind, smooth=True)
        cube.location, cube.rotation_euler = (4.0 * number, 0, 0), (0.4, 0.3, 0.9)
        cube.scale = (-1.0, 1.3, 0.7)
        cube.data.materials.append(material(kind))
    place = synthetic.looking_at((4.0, -9.0, 3.0), (4.0, 0.0, 0.0))
    camera = CachingCamera(0, place, 1.2, 0.1, 100.0, 64, "PERSPECTIVE", 0)
    geometry = read(scene)
    bake_scene(scene, geometry, [camera], tmp_path)
    store = CacheStore.open(tmp_path)
    names = store.plan.material_names
    assert dict(zip(names, store.plan.mesh_normals["normal"], strict=True)) == {
        "plain": True,
        "bump": False,
        "displaced": False,
    }
    (framebuffer,) = StoredFramebuffers(store)
    found, expected, seen = compared(framebuffer.channels, geometry, camera)
    apart = np.linalg.norm(found - expected, axis=1)
    plain = np.array(names)[seen - 1] == "plain"
    # Codes of the corners and of the cached normal. Cycles looks up to 0.005 texels beside the
    # centre (its filter is 0.01 wide), and over a cube of some 10 the normals turn by 2 radians.
    assert plain.sum() > 100
    assert np.percentile(apart[plain], 99) < 2.0 * CODE_ERROR + 0.005 * 2.0 / 10.0
    for kind in ("bump", "displaced"):
        assert np.median(apart[np.array(names)[seen - 1] == kind]) > 0.01


def compared(
    channels: dict[str, NDArray[np.float32]], geometry: SceneGeometry, camera: CachingCamera
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Of texels that show a surface: the cached normal, the mesh's, and the material's number."""
    side = (np.arange(camera.resolution) + 0.5) / camera.resolution
    u, v = np.meshgrid(side, side)
    end = camera.unproject(np.stack([u, v, np.ones_like(u)], axis=-1)).reshape(-1, 3)
    ray = end - camera.origin
    triangle, point = synthetic.Tracer(geometry).hit(np.broadcast_to(camera.origin, ray.shape), ray)
    ids = np.rint(channels["material_id"].reshape(-1)).astype(np.int64)
    expected = np.zeros_like(ray)
    hit = (triangle >= 0) & (ids > 0)
    expected[hit] = shading_normals(geometry, triangle[hit], point[hit])
    hit &= ids == geometry.material_id[triangle] + 1
    return channels["normal"].reshape(-1, 3).astype(np.float64)[hit], expected[hit], ids[hit]
