# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees with groups, reroutes, and muted nodes and links."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .material_grid import node_in
from .material_trees import Tree
from .trees_of_closures import reflectance
from .trees_of_mixes import BLUE, GOLD, RED, diffuse, gloss, glossy, mix, surface
from .trees_of_views import FRESNEL, layers
from .view_trees import new_group, use_group


def _shiny(tree: Any) -> Any:
    """A group that puts a gloss on a shader, by a Fresnel node of its own."""
    group, begin, end = new_group("shiny", Under_IN="Shader", IOR_IN="Float", Out_OUT="Shader")
    fresnel = node_in(group, "ShaderNodeFresnel", IOR=begin.outputs["IOR"]).outputs[0]
    shader = mix(group, fresnel, begin.outputs["Under"], glossy(group, GOLD))
    group.links.new(shader, end.inputs["Out"])
    use = use_group(tree, group)
    use.inputs["IOR"].default_value = 1.8
    tree.links.new(diffuse(tree, RED), use.inputs["Under"])
    return use.outputs[0]


def _nested(tree: Any) -> Any:
    """Shaders pass through three groups, and a factor's default stands on the middle one."""
    inner, begin, end = new_group("inner", A_IN="Shader", B_IN="Shader", F_IN="Float",
                                  Out_OUT="Shader")  # fmt: skip
    shader = mix(inner, begin.outputs["F"], begin.outputs["A"], begin.outputs["B"])
    inner.links.new(shader, end.inputs["Out"])
    middle, begin, end = new_group("middle", A_IN="Shader", Out_OUT="Shader")
    use = use_group(middle, inner)
    use.inputs["F"].default_value = 0.25
    middle.links.new(begin.outputs["A"], use.inputs["A"])
    middle.links.new(glossy(middle, GOLD), use.inputs["B"])
    middle.links.new(use.outputs[0], end.inputs["Out"])
    outer, begin, end = new_group("outer", A_IN="Shader", Out_OUT="Shader")
    use = use_group(outer, middle)
    outer.links.new(begin.outputs["A"], use.inputs["A"])
    outer.links.new(use.outputs[0], end.inputs["Out"])
    use = use_group(tree, outer)
    tree.links.new(diffuse(tree, RED), use.inputs["A"])
    return use.outputs[0]


def _paint(colour: Any) -> Any:
    """A group that paints in a colour, whose default is `colour`."""
    group, begin, end = new_group("paint", Color_IN="Color", Out_OUT="Shader")
    group.interface.items_tree["Color"].default_value = (*colour, 1.0)
    group.links.new(diffuse(group, begin.outputs["Color"]), end.inputs["Out"])
    return group


def _two_uses(tree: Any) -> Any:
    """One group twice, with a default and with a value."""
    group = _paint(RED)
    first, second = (use_group(tree, group) for _ in range(2))
    second.inputs["Color"].default_value = (*BLUE, 1.0)
    return mix(tree, 0.25, first.outputs[0], second.outputs[0])


def _normal_of_a_group(
    default: tuple[float, float, float] = (0, 0, 0), *, linked: bool = False, hidden: bool = False
) -> Callable[[Any], Any]:
    """A group's Normal input. Cycles takes its value for a normal also where nothing is linked,
    unless that value is hidden (as measured with a sun over such planes)."""

    def make(tree: Any) -> Any:
        group, begin, end = new_group("bends", Normal_IN="Vector", Out_OUT="Shader")
        group.interface.items_tree["Normal"].hide_value = hidden
        node = node_in(
            group, "ShaderNodeBsdfDiffuse", Color=RED, Normal=begin.outputs["Normal"]
        ).outputs[0]
        group.links.new(node, end.inputs["Out"])
        use = use_group(tree, group)
        use.inputs["Normal"].default_value = default
        if linked:
            position = node_in(tree, "ShaderNodeCombineXYZ", X=3.0, Z=4.0).outputs[0]
            tree.links.new(position, use.inputs["Normal"])
        return use.outputs[0]

    return make


def _two_outputs(tree: Any) -> Any:
    group, _, end = new_group("two", First_OUT="Shader", Second_OUT="Shader")
    group.links.new(diffuse(group, RED), end.inputs["First"])
    group.links.new(glossy(group, GOLD), end.inputs["Second"])
    use = use_group(tree, group)
    return mix(tree, 0.25, use.outputs["First"], use.outputs["Second"])


def _rerouted(tree: Any) -> Any:
    shader = mix(tree, 0.25, diffuse(tree, RED), glossy(tree, GOLD))
    for _ in range(3):
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(shader, reroute.inputs[0])
        shader = reroute.outputs[0]
    return shader


def _muted_mix(tree: Any) -> Any:
    shader = mix(tree, 0.25, diffuse(tree, RED), glossy(tree, GOLD))
    shader.node.mute = True
    return shader


def _muted_link(tree: Any) -> Any:
    shader = mix(tree, 0.25, diffuse(tree, RED), glossy(tree, GOLD))
    shader.node.inputs[2].links[0].is_muted = True
    return shader


def _muted_factor(tree: Any) -> Any:
    """A muted Math node passes its first input's own value on."""
    node = node_in(tree, "ShaderNodeMath")
    node.inputs[0].default_value, node.inputs[1].default_value = 0.25, 0.5
    node.mute = True
    return mix(tree, node.outputs[0], diffuse(tree, RED), glossy(tree, GOLD))


def _muted_group(tree: Any) -> Any:
    """A muted group passes its first shader on."""
    shader = _shiny(tree)
    shader.node.mute = True
    return shader


QUARTER = [{"diffuse_color": 0.75 * RED} | gloss(0.25 * GOLD, share=0.25)]
TREES = [
    Tree("shiny group", surface(_shiny), layers(FRESNEL, reflectance(1.8))),
    Tree("nested groups", surface(_nested), QUARTER),
    Tree(
        "two uses of a group",
        surface(_two_uses),
        [{"diffuse_color": 0.75 * RED + 0.25 * BLUE}],
    ),
    Tree("group without a normal", surface(_normal_of_a_group()), [{"diffuse_color": RED}]),
    Tree(
        "group with a normal",
        surface(_normal_of_a_group(linked=True)),
        [{"diffuse_color": RED, "normal": (0.6, 0.0, 0.8)}],
    ),
    Tree(
        "group with a default normal",
        surface(_normal_of_a_group((1.2, 0.0, 1.6))),
        [{"diffuse_color": RED, "normal": (0.6, 0.0, 0.8)}],
    ),
    Tree(
        "group with a hidden normal",
        surface(_normal_of_a_group((1.2, 0.0, 1.6), hidden=True)),
        [{"diffuse_color": RED}],
    ),
    Tree("two outputs of a group", surface(_two_outputs), QUARTER),
    Tree("rerouted", surface(_rerouted), QUARTER),
    Tree("muted mix", surface(_muted_mix), [{"diffuse_color": RED}]),
    Tree("muted link", surface(_muted_link), [{"diffuse_color": 0.75 * RED}]),
    Tree("muted factor", surface(_muted_factor), QUARTER),
    Tree("muted group", surface(_muted_group), [{"diffuse_color": RED}]),
]
