# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles would render is what is read."""

from __future__ import annotations

import time

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
    # Without a threshold most of its texels are in between.
    (cutout,) = geometry.cutouts if threshold else [each.at_half for each in geometry.sheers]
    assert len(geometry.cutouts) + len(geometry.sheers) == 1
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


def instanced(scene: bpy.types.Scene, *objects: bpy.types.Object) -> bpy.types.Object:
    """Objects moved into a collection that an empty instances."""
    inner = bpy.data.collections.new("Inner")
    for obj in objects:
        scene.collection.objects.unlink(obj)
        inner.objects.link(obj)
    empty = bpy.data.objects.new("Instancer", None)
    empty.instance_type = "COLLECTION"
    empty.instance_collection = inner
    scene.collection.objects.link(empty)
    return empty


def subdivided(obj: bpy.types.Object, levels: int) -> None:
    modifier = obj.modifiers.new("Subdivide", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    modifier.levels = modifier.render_levels = levels


def test_objects_that_share_a_mesh_have_their_own_modifiers(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    other = bpy.data.objects.new("Other", plane.data)
    scene.collection.objects.link(other)
    subdivided(other, 2)
    geometry = read(scene)
    assert np.bincount(geometry.object_id).tolist() == [2, 32]


def node_instances(obj: bpy.types.Object, *primitives: str) -> None:
    """Geometry nodes that add an instance of each mesh primitive."""
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    output, joined = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("GeometryNodeJoinGeometry")
    for primitive in primitives:
        instance = tree.nodes.new("GeometryNodeGeometryToInstance")
        tree.links.new(tree.nodes.new(primitive).outputs["Mesh"], instance.inputs[0])
        tree.links.new(instance.outputs[0], joined.inputs[0])
    tree.links.new(joined.outputs[0], output.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = tree


def test_instances_that_geometry_nodes_make(scene: bpy.types.Scene) -> None:
    obj = add_mesh(scene, "Host")
    node_instances(obj, "GeometryNodeMeshCube", "GeometryNodeMeshIcoSphere")
    geometry = read(scene)
    assert sorted(np.bincount(geometry.object_id)) == [12, 20]
    assert set(geometry.object_names) == {"Host"}


def test_a_mirrored_instance_keeps_its_normals(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    plane.scale = (1.0, -1.0, 1.0)
    empty = instanced(scene, plane)
    empty.scale = (1.0, 1.0, -1.0)
    assert np.allclose(read(scene).normal, [0, 0, -1])


def test_what_an_instancer_hides_is_hidden(scene: bpy.types.Scene) -> None:
    empty = instanced(scene, add_mesh(scene, "Plane"))
    empty.visible_camera = False
    geometry = read(scene)
    assert not geometry.camera_visible.any()
    assert geometry.shadow_visible.all()


def test_holdouts_are_left_out(scene: bpy.types.Scene) -> None:
    add_mesh(scene, "Shown")
    add_mesh(scene, "Held out").is_holdout = True
    empty = instanced(scene, add_mesh(scene, "Instanced"))
    behind = bpy.data.collections.new("Behind")
    scene.collection.children.link(behind)
    scene.collection.objects.unlink(empty)
    behind.objects.link(empty)
    layer = scene.view_layers[0].layer_collection.children["Behind"]
    layer.holdout = True
    geometry = read(scene)
    assert geometry.object_names == ("Shown",)
    assert sum("holdout" in line for line in geometry.warnings) == 2
    # Seen in reflections only: there, but not for cameras.
    layer.holdout, layer.indirect_only = False, True
    geometry = read(scene)
    seen = np.array(geometry.object_names)[np.unique(geometry.object_id[geometry.camera_visible])]
    assert seen.tolist() == ["Shown"]
    assert len(geometry) == 4


def test_the_same_triangles_twice_are_two_objects(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    scene.collection.objects.link(bpy.data.objects.new("Again", plane.data))
    geometry = read(scene)
    corners = geometry.vertices[geometry.triangles]
    np.testing.assert_array_equal(corners[:2], corners[2:])
    assert geometry.object_id.tolist() == [0, 0, 1, 1]


def test_an_instancer_weighs_too(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    plane["relume_weight"] = 0.5
    instanced(scene, plane)["relume_weight"] = 0.5
    assert np.allclose(read(scene).weight, 0.25)


NO_WEIGHTS = [
    (2.0, 1.0, "is 2.0, which is not from 0 to 1; 1 is taken"),
    (-1, 0.0, "is -1, which is not from 0 to 1; 0 is taken"),
    (float("inf"), 1.0, "is inf, which is not from 0 to 1; 1 is taken"),
    (float("nan"), 1.0, "is not a number; 1 is taken"),
    ("much", 1.0, "is not a number; 1 is taken"),
    ([0.5, 0.5], 1.0, "is not a number; 1 is taken"),
]


@pytest.mark.parametrize(("value", "weight", "says"), NO_WEIGHTS)
def test_weights_that_make_no_sense_are_named(
    scene: bpy.types.Scene, value: object, weight: float, says: str
) -> None:
    plane = add_mesh(scene, "Plane")
    plane["relume_weight"] = value
    geometry = read(scene)
    assert np.allclose(geometry.weight, weight)
    assert geometry.warnings == (f"object 'Plane': its relume_weight {says} instead",)
    # The same of a material; two objects have it, and it is named once.
    del plane["relume_weight"]
    material = bpy.data.materials.new("Paint")
    material["relume_weight"] = value
    for obj in (plane, add_mesh(scene, "Other")):
        obj.data.materials.append(material)
    geometry = read(scene)
    assert np.allclose(geometry.weight, weight)
    assert geometry.warnings == (f"material 'Paint': its relume_weight {says} instead",)


def test_an_instancers_weight_is_named_too(scene: bpy.types.Scene) -> None:
    instancer = instanced(scene, add_mesh(scene, "Plane"))
    instancer["relume_weight"] = "much"
    (warning,) = read(scene).warnings
    assert warning.startswith(f"object '{instancer.name}': its relume_weight is not a number")


@pytest.mark.parametrize("value", [0, 0.0, 0.25, 1, 1.0, True, False])
def test_weights_that_make_sense_are_no_warning(scene: bpy.types.Scene, value: float) -> None:
    add_mesh(scene, "Plane")["relume_weight"] = value
    geometry = read(scene)
    assert np.allclose(geometry.weight, value)
    assert geometry.warnings == ()


def test_painted_weights_are_means_over_the_corners(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    plane.vertex_groups.new(name="bones").add([0, 1, 2, 3], 1.0, "REPLACE")
    group = plane.vertex_groups.new(name="relume_weight")
    group.add([0], 0.6, "REPLACE")
    group.add([1], 0.3, "REPLACE")
    plane["relume_weight"] = 0.5
    add_mesh(scene, "Plain")
    geometry = read(scene)
    of_vertex = np.array([0.6, 0.3, 0.0, 0.0])  # outside of the group is 0, as it is painted
    corners = geometry.triangles[geometry.object_id == 0]
    # float32's rounding of three weights
    np.testing.assert_allclose(
        geometry.weight[geometry.object_id == 0],
        0.5 * of_vertex[corners].mean(axis=1), rtol=1e-6,
    )  # fmt: skip
    assert (geometry.weight[geometry.object_id == 1] == 1.0).all()


def test_painted_weights_go_through_modifiers_and_instances(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Plane")
    group = plane.vertex_groups.new(name="relume_weight")
    for vertex in plane.data.vertices:
        group.add([vertex.index], vertex.co.x, "REPLACE")
    subdivided(plane, 3)
    array = plane.modifiers.new("Array", "ARRAY")
    array.count = 2
    array.use_relative_offset, array.use_constant_offset = False, True
    array.constant_offset_displace = (0.0, 2.0, 0.0)
    instanced(scene, plane).location = (5.0, 0.0, 0.0)
    geometry = read(scene)
    assert len(geometry) == 2 * 2 * 64
    # Interpolated linearly, so that it is x still; float32's rounding near x = 5
    x = geometry.vertices[geometry.triangles][..., 0].mean(axis=1) - 5.0
    np.testing.assert_allclose(geometry.weight, x, atol=1e-6)


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE"])
def test_an_attribute_weighs_as_a_group_does(scene: bpy.types.Scene, domain: str) -> None:
    plane = add_mesh(scene, "Plane", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)],
                     [(0, 1, 2), (2, 1, 3)])  # fmt: skip
    attribute = plane.data.attributes.new("relume_weight", "FLOAT", domain)
    values = {"POINT": [0, 0, 0.3, 0.9], "CORNER": [0, 0, 0.3, 0.3, 0, 0.9], "FACE": [0.1, 0.4]}
    attribute.data.foreach_set("value", values[domain])
    np.testing.assert_allclose(read(scene).weight, [0.1, 0.4], rtol=1e-6)  # float32's rounding


def test_coordinates_that_are_not_finite_by_any_way(scene: bpy.types.Scene) -> None:
    add_mesh(scene, "Good")
    infinite = add_mesh(scene, "Infinite").data
    infinite.attributes["position"].data.foreach_set("vector", [float("inf")] * 12)
    # A square of it overflows float32.
    add_mesh(scene, "Huge").data.vertices[2].co = (1e30, 1e30, 0)
    bend = add_mesh(scene, "Bent")
    bend.data.vertices[1].co = (float("nan"), 0, 0)
    subdivided(bend, 1)
    geometry = read(scene)
    assert np.isfinite(geometry.vertices).all()
    (warning,) = [line for line in geometry.warnings if "not finite" in line]
    assert "(Bent, Huge, Infinite)" in warning
    assert set(np.array(geometry.object_names)[geometry.object_id]) == {"Good"}


def test_thousands_of_instances_are_read_in_seconds(scene: bpy.types.Scene) -> None:
    number = 5000
    empties = [instanced(scene, add_mesh(scene, "Leaf"))]
    for place in range(1, number):
        empty = empties[0].copy()
        empty.location = (2.0 * place, 0.0, 0.0)
        scene.collection.objects.link(empty)
    started = time.process_time()
    geometry = read(scene)
    # About 0.4 s on one core, most of it Blender's; a loop over triangles is not in it.
    assert time.process_time() - started < 5.0
    assert np.bincount(geometry.object_id).tolist() == [2] * number
    assert np.allclose(geometry.bounds, [[0, 0, 0], [2 * number - 1, 1, 0]])


def test_particle_hair_is_named(scene: bpy.types.Scene) -> None:
    plane = add_mesh(scene, "Furry")
    plane.modifiers.new("Hair", "PARTICLE_SYSTEM")
    plane.particle_systems[0].settings.type = "HAIR"
    assert read(scene).warnings == ("object 'Furry' has particle hair, which is not shown yet",)
    plane.particle_systems[0].settings.render_type = "NONE"
    assert read(scene).warnings == ()


@pytest.mark.parametrize(
    ("alpha", "tint", "through"),
    [
        (1.0, 1.0, None),
        (0.7, 1.0, (0.3, 0.3, 0.3)),
        (0.3, 1.0, (0.7, 0.7, 0.7)),
        (0.0, 1.0, None),
        (0.0, 0.5, (0.5, 1.0, 1.0)),
    ],
)
def test_partial_alpha_is_a_layer(
    scene: bpy.types.Scene, alpha: float, tint: float, through: tuple[float, ...] | None
) -> None:
    material = bpy.data.materials.new("Veil")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    clear, mix = nodes.new("ShaderNodeBsdfTransparent"), nodes.new("ShaderNodeMixShader")
    clear.inputs["Color"].default_value = (tint, 1.0, 1.0, 1.0)
    mix.inputs[0].default_value = alpha
    links.new(clear.outputs[0], mix.inputs[1])
    links.new(nodes["Principled BSDF"].outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], nodes["Material Output"].inputs["Surface"])
    add_mesh(scene, "Cloth").data.materials.append(material)
    geometry = read(scene)
    assert geometry.warnings == ()
    found = [each.transmission[0, 0] for each in geometry.sheers]
    assert len(found) == (through is not None)
    if through is not None:
        assert found[0] == pytest.approx(through)
        assert geometry.is_sheer.all()


def test_partial_alpha_that_cannot_be_read_is_named(scene: bpy.types.Scene) -> None:
    """A tint by a picture with an alpha of its own; the mask alone can be read."""
    material = bpy.data.materials.new("Veil")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    clear, picture = nodes.new("ShaderNodeBsdfTransparent"), nodes.new("ShaderNodeTexImage")
    picture.image = bpy.data.images.new("Tint", 2, 2, alpha=True)
    picture.image.pixels.foreach_set(np.full(16, 0.5, dtype=np.float32))
    links.new(picture.outputs[0], clear.inputs["Color"])
    links.new(clear.outputs[0], nodes["Material Output"].inputs["Surface"])
    add_mesh(scene, "Cloth").data.materials.append(material)
    geometry = read(scene)
    assert not geometry.sheers
    text = "it tints what lies behind, which the view shows as if it did not"
    assert geometry.warnings == (f"material 'Veil': {text}",)


@pytest.mark.parametrize(("alpha", "is_named"), [(1.0, False), (0.7, True), (0.3, True)])
def test_partial_alpha_in_a_group_is_named(
    scene: bpy.types.Scene, alpha: float, is_named: bool
) -> None:
    group = bpy.data.node_groups.new("Glaze", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner, end = group.nodes.new("ShaderNodeBsdfPrincipled"), group.nodes.new("NodeGroupOutput")
    inner.inputs["Alpha"].default_value = alpha
    group.links.new(inner.outputs[0], end.inputs[0])
    material = bpy.data.materials.new("Veil")
    nodes = material.node_tree.nodes
    outer = nodes.new("ShaderNodeGroup")
    outer.node_tree = group
    material.node_tree.links.new(outer.outputs[0], nodes["Material Output"].inputs["Surface"])
    add_mesh(scene, "Cloth").data.materials.append(material)
    geometry = read(scene)
    assert not geometry.sheers
    text = "alpha depends on the node group 'Glaze'; the view draws it opaque"
    assert geometry.warnings == ((f"material 'Veil': {text}",) if is_named else ())


def test_terminators_are_their_own_objects(scene: bpy.types.Scene) -> None:
    """Cycles asks the object that is instanced, and not who instances it."""
    bpy.ops.mesh.primitive_cube_add()
    alone = bpy.context.object
    assert alone is not None
    alone.shadow_terminator_geometry_offset = 0.25
    bpy.ops.mesh.primitive_cube_add()
    shown = bpy.context.object
    assert shown is not None
    shown.name = "Shown"
    shown.shadow_terminator_shading_offset = 0.5
    group = bpy.data.collections.new("group")
    scene.collection.objects.unlink(shown)
    group.objects.link(shown)
    empty = bpy.data.objects.new("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    empty.shadow_terminator_geometry_offset = 0.7
    scene.collection.objects.link(empty)
    geometry = read(scene)
    assert geometry.terminator_offset is not None
    found = dict(zip(geometry.object_names, geometry.terminator_offset.tolist(), strict=True))
    assert found == {alone.name: 0.25, "Shown": pytest.approx(0.1)}
    (warning,) = geometry.warnings
    assert warning.startswith("object 'Shown': its shadow terminator's shading offset is not shown")
