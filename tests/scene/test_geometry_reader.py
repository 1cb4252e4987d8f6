# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles would render is what is read."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry import SceneGeometry
from addon.scene.geometry_reader import read_geometry


@pytest.fixture
def scene() -> bpy.types.Scene:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add_mesh(
    scene: bpy.types.Scene,
    name: str,
    vertices: list[tuple[float, float, float]] | None = None,
    faces: list[tuple[int, ...]] | None = None,
) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(
        vertices or [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], faces or [(0, 1, 2, 3)]
    )
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def read(scene: bpy.types.Scene) -> SceneGeometry:
    return with_render_depsgraph(scene, read_geometry)


def test_an_empty_scene_is_refused(scene: bpy.types.Scene) -> None:
    with pytest.raises(InputError, match="no mesh"):
        read(scene)


def test_transforms_and_mirrors(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    plane.location = (10.0, 0.0, 1.0)
    plane.scale = (-2.0, 3.0, 1.0)
    geometry = read(scene)
    assert len(geometry) == 2
    assert geometry.area.sum() == pytest.approx(6.0)
    assert np.allclose(geometry.bounds, [[8, 0, 1], [10, 3, 1]])
    # The mirror turned the corners; the normal stays where the artist's was.
    assert np.allclose(geometry.normal, [0, 0, 1])


def test_render_visibility_and_modifiers_count(scene: bpy.types.Scene) -> None:
    add_mesh(scene, "Shown")
    add_mesh(scene, "Hidden").hide_render = True
    viewport_only = add_mesh(scene, "Viewport hidden")
    viewport_only.hide_viewport = True
    bevel = scene.objects["Shown"].modifiers.new("Subdivide", "SUBSURF")
    bevel.subdivision_type = "SIMPLE"
    bevel.levels, bevel.render_levels = 0, 2
    geometry = read(scene)
    assert set(geometry.object_names) == {"Shown", "Viewport hidden"}
    assert len(geometry) == 2 * 16 + 2
    assert scene.render.engine != "RELUME_PROBE"


def test_ray_visibility(scene: bpy.types.Scene) -> None:
    add_mesh(scene, "Plain")
    add_mesh(scene, "Caster").visible_camera = False
    add_mesh(scene, "Ghost").visible_shadow = False
    geometry = read(scene)
    name = np.array(geometry.object_names)[geometry.object_id]
    assert set(name[geometry.camera_visible]) == {"Plain", "Ghost"}
    assert set(name[geometry.shadow_visible]) == {"Plain", "Caster"}


def test_instances_differ(scene: bpy.types.Scene) -> None:
    inner = bpy.data.collections.new("Inner")
    mesh = add_mesh(scene, "Leaf")
    scene.collection.objects.unlink(mesh)
    inner.objects.link(mesh)
    for x in (0.0, 5.0):
        empty = bpy.data.objects.new("Instancer", None)
        empty.instance_type = "COLLECTION"
        empty.instance_collection = inner
        empty.location = (x, 0, 0)
        scene.collection.objects.link(empty)
    geometry = read(scene)
    assert len(geometry) == 4
    assert len(np.unique(geometry.object_id)) == 2
    assert np.allclose(geometry.bounds, [[0, 0, 0], [6, 1, 0]])


def test_curves_become_triangles(scene: bpy.types.Scene) -> None:
    curve = bpy.data.curves.new("Pipe", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (1, 0, 0, 1)
    scene.collection.objects.link(bpy.data.objects.new("Pipe", curve))
    assert len(read(scene)) > 0


def test_broken_triangles_are_left_out_and_named(scene: bpy.types.Scene) -> None:
    add_mesh(scene, "Good")
    broken = add_mesh(scene, "Broken", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 2, 2)],
                      [(0, 1, 2), (1, 2, 3)])  # fmt: skip
    broken.data.vertices[3].co = (float("nan"), 0, 0)
    add_mesh(scene, "Needle", [(0, 0, 0), (1, 1, 1), (2, 2, 2)], [(0, 1, 2)])
    geometry = read(scene)
    assert len(geometry) == 3
    assert np.isfinite(geometry.vertices).all()
    assert any("not finite" in line and "Broken" in line for line in geometry.warnings)


def test_weights_multiply(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    plane["relume_weight"] = 0.5
    material = bpy.data.materials.new("Dull")
    material["relume_weight"] = 0.25
    plane.data.materials.append(material)
    assert np.allclose(read(scene).weight, 0.125)


def leaf_material(threshold: bool) -> bpy.types.Material:
    material = bpy.data.materials.new("Leaf")

    tree = material.node_tree
    principled = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    image = bpy.data.images.new("Mask", 4, 2, alpha=True)
    pixels = np.ones((2, 4, 4), dtype=np.float32)
    pixels[:, :2, 3] = 0.2
    image.pixels.foreach_set(pixels.ravel())
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    source = texture.outputs["Alpha"]
    if threshold:
        math = tree.nodes.new("ShaderNodeMath")
        math.operation = "LESS_THAN"
        math.inputs[1].default_value = 0.5
        tree.links.new(source, math.inputs[0])
        invert = tree.nodes.new("ShaderNodeMath")
        invert.operation = "SUBTRACT"
        invert.inputs[0].default_value = 1.0
        tree.links.new(math.outputs[0], invert.inputs[1])
        source = invert.outputs[0]
    tree.links.new(source, principled.inputs["Alpha"])
    return material


@pytest.mark.parametrize("threshold", [False, True])
def test_image_cutouts_are_read(scene: bpy.types.Scene, threshold: bool) -> None:
    plane = add_mesh(scene, "Leaf")
    plane.data.uv_layers.new(name="UVMap")
    plane.data.materials.append(leaf_material(threshold))
    geometry = read(scene)
    (cutout,) = geometry.cutouts
    assert cutout.alpha.shape == (2, 4)
    assert ((cutout.alpha >= 0.5) == [[False, False, True, True]] * 2).all()
    assert geometry.uv is not None
    assert geometry.uv.shape == (2, 3, 2)
    assert np.allclose(np.sort(geometry.uv.reshape(-1, 2).max(axis=0)), [1, 1])


def test_an_alpha_that_cannot_be_read_is_named(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    material = bpy.data.materials.new("Cloudy")

    tree = material.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    principled = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(noise.outputs[0], principled.inputs["Alpha"])
    plane.data.materials.append(material)
    geometry = read(scene)
    assert not geometry.cutouts
    assert any("'Cloudy'" in line and "Noise" in line for line in geometry.warnings)
