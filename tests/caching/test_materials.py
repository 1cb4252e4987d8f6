# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked channels of known materials against their closed forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.bake import BakeReport
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.store import CacheStore

from .material_grid import (
    HALF,
    add_plane,
    at,
    bake,
    camera_above,
    empty_material,
    empty_scene,
    node_in,
)


def principled() -> Any:
    material, surface = empty_material("principled")
    tree = material.node_tree
    node = node_in(
        tree,
        "ShaderNodeBsdfPrincipled",
        Base_Color=(0.6, 0.3, 0.1),
        Metallic=0.25,
        Roughness=0.4,
        IOR=1.45,
        Specular_IOR_Level=0.7,
        Specular_Tint=(1.0, 0.8, 0.5),
        Emission_Color=(0.5, 0.25, 0.125),
        Emission_Strength=2.0,
    )
    tree.links.new(node.outputs[0], surface)
    return material


F0 = (0.45 / 2.45) ** 2 * 1.4
BASE = np.array([0.6, 0.3, 0.1])
PRINCIPLED = {
    "diffuse_color": 0.75 * BASE,
    "specular_f0": 0.25 * BASE + 0.75 * F0 * np.array([1.0, 0.8, 0.5]),
    "specular_f90": 1.0,
    "layer_f0": F0,
    "layer_f90": 1.0,
    "dielectric": 0.75,
    # (F0 + (1 - F0) w)(1 - tint) / (w / 7 * 6/7), with w = (6/7)^5, of a quarter of metal.
    "specular_dip": 0.25
    * (BASE + (1.0 - BASE) * (6 / 7) ** 5)
    * (1.0 - np.array([1.0, 0.8, 0.5]))
    * 7.0
    / (6 / 7) ** 6,
    "roughness": 0.4,
    "emission": [1.0, 0.5, 0.25],
}


def diffuse(tree: Any, colour: Any) -> Any:
    return node_in(tree, "ShaderNodeBsdfDiffuse", Color=colour).outputs[0]


def glossy(tree: Any, colour: Any, roughness: float) -> Any:
    node = node_in(tree, "ShaderNodeBsdfAnisotropic", Color=colour, Roughness=roughness)
    return node.outputs[0]


def mixed() -> Any:
    """Through a reroute and a muted Mix Shader, which passes its first shader on."""
    material, surface = empty_material("mixed")
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.3
    tree.links.new(diffuse(tree, (0.8, 0.2, 0.2)), mix.inputs[1])
    tree.links.new(glossy(tree, (0.9, 0.9, 0.9), 0.2), mix.inputs[2])
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(mix.outputs[0], reroute.inputs[0])
    muted = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(reroute.outputs[0], muted.inputs[1])
    tree.links.new(diffuse(tree, (0, 1, 0)), muted.inputs[2])
    muted.mute = True
    tree.links.new(muted.outputs[0], surface)
    return material


MIXED = {
    "diffuse_color": np.array([0.8, 0.2, 0.2]) * 0.7,
    "specular_f0": 0.27,
    "specular_f90": 0.27,
    "layer_f0": 0.0,
    "layer_f90": 0.0,
    "roughness": 0.2,
}


def nested_groups() -> Any:
    """A shader passes into one group, a colour through two, and a shader comes back out."""
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    enter, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    inner.links.new(diffuse(inner, enter.outputs["Color"]), leave.inputs["Shader"])

    outer = bpy.data.node_groups.new("outer", "ShaderNodeTree")
    for name, kind in (("Color", "Color"), ("Under", "Shader"), ("Fac", "Float")):
        outer.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
    outer.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    enter, leave = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput")
    use = outer.nodes.new("ShaderNodeGroup")
    use.node_tree = inner
    outer.links.new(enter.outputs["Color"], use.inputs["Color"])
    mix = outer.nodes.new("ShaderNodeMixShader")
    outer.links.new(enter.outputs["Fac"], mix.inputs[0])
    outer.links.new(enter.outputs["Under"], mix.inputs[1])
    outer.links.new(use.outputs["Shader"], mix.inputs[2])
    outer.links.new(mix.outputs[0], leave.inputs["Shader"])

    material, surface = empty_material("nested groups")
    tree = material.node_tree
    use = tree.nodes.new("ShaderNodeGroup")
    use.node_tree = outer
    use.inputs["Fac"].default_value = 0.25
    # A varying colour on one side of the boundary, and a varying shader on the other.
    position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    one = node_in(tree, "ShaderNodeVectorMath")
    one.operation = "MULTIPLY_ADD"
    tree.links.new(position, one.inputs[0])
    one.inputs[1].default_value = (0.0, 0.0, 0.0)
    one.inputs[2].default_value = (0.2, 0.4, 0.6)
    tree.links.new(one.outputs[0], use.inputs["Color"])
    tree.links.new(diffuse(tree, one.outputs[0]), use.inputs["Under"])
    tree.links.new(use.outputs["Shader"], surface)
    return material


def fresnel_mix() -> Any:
    material, surface = empty_material("fresnel mix")
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(node_in(tree, "ShaderNodeFresnel", IOR=1.5).outputs[0], mix.inputs[0])
    tree.links.new(diffuse(tree, (0.5, 0.5, 0.5)), mix.inputs[1])
    tree.links.new(glossy(tree, (0.9, 0.8, 0.7), 0.1), mix.inputs[2])
    tree.links.new(mix.outputs[0], surface)
    return material


FRESNEL_MIX = {
    "diffuse_color": 0.5,
    "view_base": 1.0,
    "view_slope": -1.0,
    "view_curve": 1.0,
    "view_parameter": 0.04,
    "specular_f0_2": [0.9, 0.8, 0.7],
    "specular_f90_2": [0.9, 0.8, 0.7],
    "roughness_2": 0.1,
    "view_base_2": 0.0,
    "view_slope_2": 1.0,
    "view_curve_2": 1.0,
    "view_parameter_2": 0.04,
}


def added_emission() -> Any:
    material, surface = empty_material("added emission")
    tree = material.node_tree
    add = tree.nodes.new("ShaderNodeAddShader")
    light = node_in(tree, "ShaderNodeEmission", Color=(1.0, 2.0, 3.0), Strength=4.0)
    tree.links.new(diffuse(tree, (0.2, 0.2, 0.2)), add.inputs[0])
    tree.links.new(light.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], surface)
    return material


def glass() -> Any:
    material, surface = empty_material("window")
    tree = material.node_tree
    node = node_in(tree, "ShaderNodeBsdfGlass", Color=(1, 1, 1), Roughness=0.0, IOR=1.5)
    tree.links.new(node.outputs[0], surface)
    return material


def facing_colour() -> Any:
    material, surface = empty_material("facing colour")
    tree = material.node_tree
    facing = tree.nodes.new("ShaderNodeLayerWeight").outputs["Facing"]
    tree.links.new(diffuse(tree, facing), surface)
    return material


def tilted_normal() -> Any:
    """A normal map of (1, 0.5, 1), which is (1, 0, 1) in object space."""
    material, surface = empty_material("tilted normal")
    tree = material.node_tree
    bend = node_in(tree, "ShaderNodeNormalMap", Color=(1.0, 0.5, 1.0))
    bend.space = "OBJECT"
    node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5), Normal=bend.outputs[0])
    tree.links.new(node.outputs[0], surface)
    return material


def checker(size: int = 4) -> Any:
    """Texels of known values, read without a filter."""
    image = bpy.data.images.new("checker", size, size, float_buffer=True, is_data=True)
    column, row = np.meshgrid(np.arange(size), np.arange(size))
    pixels = np.stack(
        [column / size, row / size, np.full((size, size), 0.25), np.ones((size, size))], axis=-1
    )
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    material, surface = empty_material("checker")
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(diffuse(tree, texture.outputs["Color"]), surface)
    return material


def holed(name: str, alpha: float, colour: tuple[float, float, float]) -> Any:
    """Opaque where x is above `alpha`, a hole elsewhere."""
    material, surface = empty_material(name)
    tree = material.node_tree
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], split.inputs[0])
    step = tree.nodes.new("ShaderNodeMath")
    step.operation = "GREATER_THAN"
    tree.links.new(split.outputs[0], step.inputs[0])
    step.inputs[1].default_value = alpha
    # Nothing is all-or-nothing in the file: 0.3 and 0.8 are below and above the threshold.
    soft = tree.nodes.new("ShaderNodeMath")
    soft.operation = "MULTIPLY_ADD"
    tree.links.new(step.outputs[0], soft.inputs[0])
    soft.inputs[1].default_value, soft.inputs[2].default_value = 0.5, 0.3
    node = node_in(
        tree, "ShaderNodeBsdfPrincipled", Base_Color=colour, Alpha=soft.outputs[0], IOR=1.0
    )
    tree.links.new(node.outputs[0], surface)
    return material


@dataclass(frozen=True)
class Baked:
    store: CacheStore
    report: BakeReport
    framebuffer: DeepFramebuffer

    def at(self, name: str, x: float, y: float = 0.0, z: float = 0.0) -> np.ndarray:
        return at(self.framebuffer, self.store, name, (x, y, z))


PLACES = {
    "principled": -3.75, "mixed": -2.5, "nested": -1.25, "fresnel": 0.0, "emission": 1.25,
    "glass": 2.5, "facing": 3.75,
}  # fmt: skip


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> Baked:
    scene = empty_scene()
    makers = (
        principled, mixed, nested_groups, fresnel_mix, added_emission, glass, facing_colour
    )  # fmt: skip
    for maker, x in zip(makers, PLACES.values(), strict=True):
        add_plane(scene, maker.__name__, (x, 0.0, 0.0), maker())
    add_plane(scene, "bare", (0.0, 2.0, 0.0), None)
    # A new material is a new Principled BSDF.
    add_plane(scene, "fresh", (4.0, 2.0, 0.0), bpy.data.materials.new("fresh"))
    turned = add_plane(scene, "turned over", (2.0, 2.0, 0.0), bpy.data.materials["mixed"])
    turned.rotation_euler = (np.pi, 0.0, 0.0)
    add_plane(scene, "tilted", (-2.0, 2.0, 0.0), tilted_normal())
    add_plane(scene, "checker", (0.0, -2.5, 0.0), checker(), size=3.0)
    store, report = bake(scene, [camera_above((0, 0, 0), 5.0)], tmp_path_factory.mktemp("row"))
    return Baked(store, report, store.read_camera(0))


@pytest.mark.parametrize(
    ("place", "expected"),
    [("principled", PRINCIPLED), ("mixed", MIXED), ("fresnel", FRESNEL_MIX)],
)
def test_lobes_of_a_material(row: Baked, place: str, expected: dict[str, Any]) -> None:
    for name, value in expected.items():
        # One rounding to half, and a few of the float32 operations in the nodes.
        found = row.at(name, PLACES[place])
        assert found == pytest.approx(np.broadcast_to(value, found.shape), rel=2 * HALF), name


def test_expressions_cross_the_boundaries_of_groups(row: Baked) -> None:
    found = row.at("diffuse_color", PLACES["nested"])
    # Both sides of the mix have the same colour, whatever its factor.
    assert found == pytest.approx([0.2, 0.4, 0.6], rel=2 * HALF)


def test_emission_is_radiance(row: Baked) -> None:
    assert row.at("emission", PLACES["emission"]) == pytest.approx([4.0, 8.0, 12.0], rel=1e-6)
    assert row.at("diffuse_color", PLACES["emission"]) == pytest.approx(0.2, rel=2 * HALF)


def test_texture_texels(row: Baked) -> None:
    for column in range(4):
        for line in range(4):
            x, y = -1.5 + 0.75 * (column + 0.5), -4.0 + 0.75 * (line + 0.5)
            expected = [column / 4, line / 4, 0.25]
            assert row.at("diffuse_color", x, y) == pytest.approx(expected, abs=HALF)


def test_no_material_is_cycles_default(row: Baked) -> None:
    for name in PRINCIPLED:
        bare, fresh = (row.at(name, x, 2.0) for x in (0.0, 4.0))
        # The default goes from Python to half, a new material through Cycles' float32 nodes.
        assert bare == pytest.approx(fresh, rel=2 * HALF), name
    assert row.at("diffuse_color", 0.0, 2.0) == pytest.approx(0.8, rel=HALF)
    assert row.at("layer_f0", 0.0, 2.0) == pytest.approx(0.04, rel=HALF)
    assert row.at("normal", 0.0, 2.0) == pytest.approx([0.0, 0.0, 1.0], abs=HALF)
    number = row.at("material_id", 0.0, 2.0)[0]
    assert row.store.plan.material_names[int(number) - 1] == ""


def test_material_ids_name_the_materials(row: Baked) -> None:
    names = row.store.plan.material_names
    assert names[int(row.at("material_id", PLACES["mixed"])[0]) - 1] == "mixed"
    assert names[int(row.at("material_id", PLACES["glass"])[0]) - 1] == "window"


def test_back_faces_turn_their_normal_to_the_camera(row: Baked) -> None:
    assert row.at("normal", 2.0, 2.0) == pytest.approx([0.0, 0.0, 1.0], abs=HALF)


def test_normal_map(row: Baked) -> None:
    half = np.sqrt(0.5)
    assert row.at("normal", -2.0, 2.0) == pytest.approx([half, 0.0, half], abs=2 * HALF)


def test_depth_of_a_plane_and_of_nothing(row: Baked) -> None:
    depth = row.framebuffer.channels["depth"][..., 0]
    hit = depth > 0.0
    # Cycles transforms the hit point in float32: a few spacings of 5.
    assert depth[hit] == pytest.approx(5.0, abs=8 * float(np.spacing(np.float32(5.0))))
    assert not row.at("depth", 4.9, 4.9).any()
    for name, pixels in row.framebuffer.channels.items():
        assert not pixels[~hit].any(), name


def test_what_is_approximated_is_named(row: Baked) -> None:
    text = "\n".join(row.report.approximations)
    assert "'window'" in text
    assert "'facing colour'" in text
    assert "Layer Weight" in text
    for exact in ("mixed", "nested groups", "fresnel mix", "added emission"):
        assert f"'{exact}'" not in text


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Baked:
    scene = empty_scene()
    for z, alpha, colour in (
        (3.0, 1.0, (0.9, 0.0, 0.0)),
        (2.0, 0.0, (0.0, 0.9, 0.0)),
        (1.0, -1.0, (0.0, 0.0, 0.9)),
    ):
        name = f"layer {z:.0f}"
        add_plane(scene, name, (0.0, 0.0, z), holed(name, alpha, colour), size=4.0)
    camera = camera_above((0, 0, 0), 8.0, fov=0.6)
    store, report = bake(scene, [camera], tmp_path_factory.mktemp("stack"))
    return Baked(store, report, store.read_camera(0))


@pytest.mark.parametrize(
    ("x", "z", "colour"),
    [(1.2, 3.0, [0.9, 0, 0]), (0.5, 2.0, [0, 0.9, 0]), (-0.5, 1.0, [0, 0, 0.9]), (-1.4, 0.0, None)],
)
def test_the_first_surface_without_a_hole_is_recorded(
    stack: Baked, x: float, z: float, colour: list[float] | None
) -> None:
    if colour is None:
        assert not stack.at("depth", x, z=0.0).any()
        return
    assert stack.at("depth", x, z=z) == pytest.approx(8.0 - z, rel=1e-6)
    # Full colour: the part that is not cut away counts as wholly opaque.
    assert stack.at("diffuse_color", x, z=z) == pytest.approx(colour, abs=2 * HALF)
    names = stack.store.plan.material_names
    assert names[int(stack.at("material_id", x, z=z)[0]) - 1] == f"layer {z:.0f}"


def test_channels_that_nothing_needs_are_left_out(stack: Baked) -> None:
    plan = stack.store.plan
    assert plan.stored == ("depth", "material_id", "normal", "diffuse_color")
    assert plan.constant("emission") == (0.0, 0.0, 0.0)
    assert plan.constant("ambient_occlusion") == (1.0,)
