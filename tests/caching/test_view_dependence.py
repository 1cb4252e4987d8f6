# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that depend on the view, in every place of a tree that they can be in."""

from __future__ import annotations

from typing import Any

import bpy
import pytest

from addon.caching.bake import BakeReport

from .material_grid import add_plane, bake, camera_above, empty_scene, node_in
from .view_trees import Maker, effects_of, material_of, new_group, shown, use_group, view_effects_of


@pytest.fixture(autouse=True)
def _new_file() -> None:
    empty_scene()


def facing(tree: Any) -> Any:
    return node_in(tree, "ShaderNodeLayerWeight", Blend=0.3).outputs["Facing"]


def matte(tree: Any, colour: Any = (0.5, 0.5, 0.5)) -> Any:
    return node_in(tree, "ShaderNodeBsdfDiffuse", Color=colour).outputs[0]


def gloss(tree: Any) -> Any:
    return node_in(tree, "ShaderNodeBsdfAnisotropic", Color=(1, 1, 1), Roughness=0.2).outputs[0]


def mix(tree: Any, factor: Any, first: Any = None, second: Any = None) -> Any:
    node = tree.nodes.new("ShaderNodeMixShader")
    if isinstance(factor, float):
        node.inputs[0].default_value = factor
    else:
        tree.links.new(factor, node.inputs[0])
    tree.links.new(first or matte(tree), node.inputs[1])
    tree.links.new(second or gloss(tree), node.inputs[2])
    return node


def surface(tree: Any, output: Any, shader: Any) -> None:
    tree.links.new(shader, output.inputs["Surface"])


# Places in a tree where the value has a say.


def behind_reroutes(tree: Any, output: Any) -> None:
    value = facing(tree)
    for _ in range(3):
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(value, reroute.inputs[0])
        value = reroute.outputs[0]
    shown(tree, output, value)


def behind_mapping(tree: Any, output: Any) -> None:
    source = tree.nodes.new("ShaderNodeTexCoord").outputs["Reflection"]
    mapped = node_in(tree, "ShaderNodeMapping", Vector=source)
    picture = node_in(tree, "ShaderNodeTexNoise", Vector=mapped.outputs[0])
    shown(tree, output, picture.outputs["Color"])


def through_a_muted_node(tree: Any, output: Any) -> None:
    muted = tree.nodes.new("ShaderNodeMath")
    tree.links.new(facing(tree), muted.inputs[0])
    muted.mute = True
    shown(tree, output, muted.outputs[0])


def inside_a_group(tree: Any, output: Any) -> None:
    group, _, end = new_group("inner", Value_OUT="Float")
    group.links.new(facing(group), end.inputs["Value"])
    outer, _, outer_end = new_group("outer", Value_OUT="Float")
    outer.links.new(use_group(outer, group).outputs[0], outer_end.inputs["Value"])
    shown(tree, output, use_group(tree, outer).outputs[0])


def into_a_group(tree: Any, output: Any) -> None:
    group, begin, end = new_group("doubles", Value_IN="Float", Value_OUT="Float")
    group.links.new(
        node_in(group, "ShaderNodeMath", Value=begin.outputs["Value"]).outputs[0],
        end.inputs["Value"],
    )
    use = use_group(tree, group)
    tree.links.new(facing(tree), use.inputs["Value"])
    shown(tree, output, use.outputs[0])


def into_a_group_of_shaders(tree: Any, output: Any) -> None:
    group, begin, end = new_group("paints", Color_IN="Color", Shader_OUT="Shader")
    group.links.new(matte(group, begin.outputs["Color"]), end.inputs["Shader"])
    use = use_group(tree, group)
    tree.links.new(facing(tree), use.inputs["Color"])
    surface(tree, output, use.outputs[0])


def one_use_of_two(tree: Any, output: Any) -> None:
    """One group twice; what the second takes depends on the view."""
    group, begin, end = new_group("passes", Value_IN="Float", Value_OUT="Float")
    group.links.new(begin.outputs["Value"], end.inputs["Value"])
    uses = [use_group(tree, group) for _ in range(2)]
    tree.links.new(facing(tree), uses[1].inputs["Value"])
    both = tree.nodes.new("ShaderNodeMath")
    for use, socket in zip(uses, both.inputs, strict=False):
        tree.links.new(use.outputs[0], socket)
    shown(tree, output, both.outputs[0])


def a_factor_and_elsewhere(tree: Any, output: Any) -> None:
    value = facing(tree)
    surface(tree, output, mix(tree, value, matte(tree, value)).outputs[0])


def a_factor_after_a_ramp(tree: Any, output: Any) -> None:
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(facing(tree), ramp.inputs[0])
    surface(tree, output, mix(tree, ramp.outputs[0]).outputs[0])


def in_what_a_curve_is_made_of(tree: Any, output: Any) -> None:
    """The Fresnel node is shaded at run time; its IOR depends on the view by itself."""
    fresnel = node_in(tree, "ShaderNodeFresnel", IOR=facing(tree)).outputs[0]
    surface(tree, output, mix(tree, fresnel).outputs[0])


def in_bump(tree: Any, output: Any) -> None:
    bump = node_in(tree, "ShaderNodeBump", Height=facing(tree)).outputs[0]
    node = node_in(tree, "ShaderNodeBsdfDiffuse", Normal=bump)
    surface(tree, output, node.outputs[0])


def in_displacement(tree: Any, output: Any) -> None:
    surface(tree, output, matte(tree))
    height = node_in(tree, "ShaderNodeDisplacement", Height=facing(tree)).outputs[0]
    tree.links.new(height, output.inputs["Displacement"])


def in_alpha(tree: Any, output: Any) -> None:
    clear = tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0]
    depth = tree.nodes.new("ShaderNodeCameraData").outputs["View Z Depth"]
    surface(tree, output, mix(tree, depth, clear).outputs[0])


FLAGGED: list[Maker] = [
    behind_reroutes, behind_mapping, through_a_muted_node, inside_a_group, into_a_group,
    into_a_group_of_shaders, one_use_of_two, a_factor_and_elsewhere, a_factor_after_a_ramp,
    in_what_a_curve_is_made_of, in_bump, in_displacement, in_alpha,
]  # fmt: skip


# Places where it has none, or where it is shaded at run time.


def linked_to_nothing(tree: Any, output: Any) -> None:
    facing(tree)
    surface(tree, output, matte(tree))


def in_a_chain_that_ends_nowhere(tree: Any, output: Any) -> None:
    node_in(tree, "ShaderNodeMath", Value=facing(tree))
    surface(tree, output, matte(tree))


def behind_a_muted_link(tree: Any, output: Any) -> None:
    shown(tree, output, facing(tree))
    node = output.inputs["Surface"].links[0].from_node
    node.inputs["Color"].links[0].is_muted = True


def muted(tree: Any, output: Any) -> None:
    value = facing(tree)
    shown(tree, output, value)
    value.node.mute = True


def beside_what_a_muted_node_passes_on(tree: Any, output: Any) -> None:
    join = mix(tree, 0.5, None, matte(tree, facing(tree)))
    join.mute = True
    surface(tree, output, join.outputs[0])


def in_an_output_for_another_engine(tree: Any, output: Any) -> None:
    surface(tree, output, matte(tree))
    output.target = "CYCLES"
    other = tree.nodes.new("ShaderNodeOutputMaterial")
    other.target = "EEVEE"
    shown(tree, other, facing(tree))


def in_an_output_that_is_not_active(tree: Any, output: Any) -> None:
    surface(tree, output, matte(tree))
    other = tree.nodes.new("ShaderNodeOutputMaterial")
    shown(tree, other, facing(tree))
    output.is_active_output, other.is_active_output = True, False


def behind_an_output_of_a_group_that_is_not_read(tree: Any, output: Any) -> None:
    group, _, end = new_group("two", Static_OUT="Float", View_OUT="Float")
    group.links.new(facing(group), end.inputs["View"])
    group.links.new(node_in(group, "ShaderNodeValue").outputs[0], end.inputs["Static"])
    shown(tree, output, use_group(tree, group).outputs["Static"])


def in_an_input_of_a_group_that_is_not_read(tree: Any, output: Any) -> None:
    group, begin, end = new_group("drops", Used_IN="Color", Left_IN="Color", Color_OUT="Color")
    group.links.new(begin.outputs["Used"], end.inputs["Color"])
    use = use_group(tree, group)
    tree.links.new(facing(tree), use.inputs["Left"])
    shown(tree, output, use.outputs[0])


def in_the_side_of_a_mix_that_has_no_weight(tree: Any, output: Any) -> None:
    surface(tree, output, mix(tree, 0.0, None, matte(tree, facing(tree))).outputs[0])


def as_a_factor(tree: Any, output: Any) -> None:
    surface(tree, output, mix(tree, facing(tree)).outputs[0])


def as_a_factor_behind_a_reroute(tree: Any, output: Any) -> None:
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(node_in(tree, "ShaderNodeFresnel").outputs[0], reroute.inputs[0])
    surface(tree, output, mix(tree, reroute.outputs[0]).outputs[0])


def as_a_factor_inside_a_group(tree: Any, output: Any) -> None:
    group, begin, end = new_group("shiny", Under_IN="Shader", Shader_OUT="Shader")
    fresnel = node_in(group, "ShaderNodeLayerWeight").outputs["Fresnel"]
    group.links.new(mix(group, fresnel, begin.outputs[0]).outputs[0], end.inputs[0])
    use = use_group(tree, group)
    tree.links.new(matte(tree), use.inputs[0])
    surface(tree, output, use.outputs[0])


def as_a_factor_and_in_a_dead_end(tree: Any, output: Any) -> None:
    value = facing(tree)
    node_in(tree, "ShaderNodeMath", Value=value)
    surface(tree, output, mix(tree, value).outputs[0])


def as_a_factor_twice(tree: Any, output: Any) -> None:
    value = facing(tree)
    add = tree.nodes.new("ShaderNodeAddShader")
    for socket in add.inputs:
        tree.links.new(mix(tree, value).outputs[0], socket)
    surface(tree, output, add.outputs[0])


STATIC: list[Maker] = [
    linked_to_nothing, in_a_chain_that_ends_nowhere, behind_a_muted_link, muted,
    beside_what_a_muted_node_passes_on, in_an_output_for_another_engine,
    in_an_output_that_is_not_active, behind_an_output_of_a_group_that_is_not_read,
    in_an_input_of_a_group_that_is_not_read, in_the_side_of_a_mix_that_has_no_weight,
    as_a_factor, as_a_factor_behind_a_reroute, as_a_factor_inside_a_group,
    as_a_factor_and_in_a_dead_end, as_a_factor_twice,
]  # fmt: skip


@pytest.mark.parametrize("make", FLAGGED, ids=lambda make: make.__name__)
def test_a_frozen_value_is_named_once(make: Maker) -> None:
    assert len(view_effects_of(material_of("checked", make))) == 1


@pytest.mark.parametrize("make", STATIC, ids=lambda make: make.__name__)
def test_what_is_not_frozen_is_not_named(make: Maker) -> None:
    assert not effects_of(material_of("checked", make))


def test_a_warning_names_node_outputs_and_effect() -> None:
    def make(tree: Any, output: Any) -> None:
        data = tree.nodes.new("ShaderNodeCameraData")
        data.name = "How far"
        add = tree.nodes.new("ShaderNodeMath")
        tree.links.new(data.outputs["View Z Depth"], add.inputs[0])
        tree.links.new(data.outputs["View Distance"], add.inputs[1])
        shown(tree, output, add.outputs[0])

    (effect,) = effects_of(material_of("fog", make))
    assert effect == (
        "the Camera Data node 'How far' depends on the view (View Z Depth, View Distance); its "
        "value is kept as the caching camera saw it"
    )


def test_each_node_is_named_by_itself() -> None:
    def make(tree: Any, output: Any) -> None:
        add = tree.nodes.new("ShaderNodeMath")
        tree.links.new(facing(tree), add.inputs[0])
        tree.links.new(facing(tree), add.inputs[1])
        shown(tree, output, add.outputs[0])

    effects = view_effects_of(material_of("two", make))
    assert [effect.split("'")[1] for effect in effects] == ["Layer Weight", "Layer Weight.001"]


@pytest.mark.parametrize(
    ("carrier", "flagged"),
    [("camera", True), ("light", True), ("under a camera", True), ("empty", False), (None, False)],
)
def test_coordinates_of_what_may_move(carrier: str | None, flagged: bool) -> None:
    target = bpy.data.objects.new("carried", None)
    if carrier in {"camera", "under a camera"}:
        camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
        target.parent = camera
        target = camera if carrier == "camera" else target
    elif carrier == "light":
        target = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))

    def make(tree: Any, output: Any) -> None:
        node = tree.nodes.new("ShaderNodeTexCoord")
        node.object = target if carrier else None
        shown(tree, output, node.outputs["Object"])

    assert bool(view_effects_of(material_of("checked", make))) == flagged


@pytest.fixture
def report(tmp_path: Any) -> BakeReport:
    scene = bpy.context.scene
    add_plane(scene, "a", (0, 0, 0), material_of("frozen fog", behind_reroutes))
    add_plane(scene, "b", (1, 0, 0), material_of("still", linked_to_nothing))
    _, report = bake(scene, [camera_above((0, 0, 0), 3.0)], tmp_path)
    return report


def test_a_bake_reports_the_material(report: BakeReport) -> None:
    (line,) = report.approximations
    assert str(line).startswith("material 'frozen fog': the Layer Weight node 'Layer Weight'")


def transparent_depth(tree: Any, output: Any) -> None:
    """How many cut-outs are before a surface depends on from where it is seen."""
    shown(tree, output, tree.nodes.new("ShaderNodeLightPath").outputs["Transparent Depth"])


def wires_by_pixels(tree: Any, output: Any) -> None:
    node = tree.nodes.new("ShaderNodeWireframe")
    node.use_pixel_size = True
    shown(tree, output, node.outputs[0])


def wires_by_length(tree: Any, output: Any) -> None:
    shown(tree, output, tree.nodes.new("ShaderNodeWireframe").outputs[0])


def script(tree: Any, output: Any) -> None:
    node = tree.nodes.new("ShaderNodeScript")
    node.outputs.new("NodeSocketFloat", "Value")
    shown(tree, output, node.outputs["Value"])


@pytest.mark.parametrize(
    ("make", "flagged"),
    [(transparent_depth, True), (wires_by_pixels, True), (wires_by_length, False), (script, True)],
)
def test_what_two_pictures_cannot_tell(make: Maker, flagged: bool) -> None:
    """The nodes that test_view_nodes.py leaves out."""
    assert bool(view_effects_of(material_of("checked", make))) == flagged
