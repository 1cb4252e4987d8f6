# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees whose inputs come from value nodes, attributes and objects; what plain Cycles shows of
such an input, on a surface that emits it, is what the closure takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .material_grid import node_in, set_inputs
from .material_trees import Probes, Tree
from .trees_of_closures import MULTI_GGX, glossy_fields, principled_fields, reflectance
from .view_trees import new_group, use_group

Give = Callable[[Any], Any]


def position(tree: Any) -> Any:
    return tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]


def noise(tree: Any, scale: float = 0.6) -> Any:
    """Slow, so that what is within a texel is nearly one value."""
    return node_in(tree, "ShaderNodeTexNoise", Vector=position(tree), Scale=scale, Detail=0.0)


def positive(probes: Probes) -> Any:
    return np.maximum(probes["value"], 0.0)


def as_colour(name: str, give: Give, prepare: Any = None, effects: Any = ()) -> Tree:
    """The value is a diffuse colour; Cycles reflects nothing of what is below 0."""

    def make(tree: Any, output: Any) -> Mapping[str, Any]:
        value = give(tree)
        node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=value)
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return {"value": value}

    return Tree(name, make, [{"diffuse_color": positive}], prepare=prepare, effects=effects)


def as_reflection(name: str, give: Give) -> Tree:
    """The value is a glossy colour."""

    def make(tree: Any, output: Any) -> Mapping[str, Any]:
        value = give(tree)
        node = node_in(tree, "ShaderNodeBsdfAnisotropic", Color=value, Roughness=0.3)
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return {"value": value}

    return Tree(name, make, [glossy_fields(positive, 0.3, MULTI_GGX)])


def as_roughness(name: str, give: Give, grey: Callable[[Any], Any], prepare: Any = None) -> Tree:
    """The value is a roughness, `grey` of it as an emission shows it, held to [0, 1]."""

    def make(tree: Any, output: Any) -> Mapping[str, Any]:
        value = give(tree)
        node = node_in(tree, "ShaderNodeBsdfAnisotropic", Color=(1, 1, 1), Roughness=value)
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return {"value": value}

    fields = glossy_fields(1.0, 0.0, MULTI_GGX) | {
        "roughness": lambda probes: np.clip(grey(probes["value"]), 0.0, 1.0)
    }
    return Tree(name, make, [fields], prepare=prepare)


def first(shown: Any) -> Any:
    return shown[:, :1]


def luma(shown: Any) -> Any:
    return (shown @ np.array([0.2126, 0.7152, 0.0722]))[:, None]


def mean(shown: Any) -> Any:
    return shown.mean(axis=1)[:, None]


def node_of(
    kind: str, output: Any = 0, settings: Mapping[str, Any] | None = None, **inputs: Any
) -> Give:
    """An output of a new node; inputs may be other such."""

    def give(tree: Any) -> Any:
        node = tree.nodes.new(kind)
        for name, value in (settings or {}).items():
            setattr(node, name, value)
        set_inputs(tree, node, **{key: v(tree) if callable(v) else v for key, v in inputs.items()})
        return node.outputs[output]

    return give


def grain(tree: Any) -> Any:
    return noise(tree).outputs["Color"]


def height(tree: Any) -> Any:
    return noise(tree).outputs[0]


def constant(kind: str, value: Any) -> Give:
    def give(tree: Any) -> Any:
        node = tree.nodes.new(kind)
        node.outputs[0].default_value = value
        return node.outputs[0]

    return give


def _ramp(tree: Any) -> Any:
    node = node_in(tree, "ShaderNodeValToRGB", Fac=height(tree))
    node.color_ramp.elements[0].color = (0.9, 0.1, 0.2, 1.0)
    node.color_ramp.elements[1].color = (0.1, 0.4, 0.9, 0.5)
    node.color_ramp.elements.new(0.5).color = (0.2, 0.9, 0.1, 1.0)
    return node.outputs[0]


def _curves(tree: Any) -> Any:
    node = node_in(tree, "ShaderNodeRGBCurve", Color=grain(tree))
    node.mapping.curves[0].points.new(0.4, 0.8)
    node.mapping.curves[3].points.new(0.6, 0.3)
    node.mapping.update()
    return node.outputs[0]


def _mixed_colours(blend: str) -> Give:
    def give(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeMix")
        node.data_type, node.blend_type = "RGBA", blend
        sockets = {s.identifier: s for s in (*node.inputs, *node.outputs)}
        tree.links.new(height(tree), sockets["Factor_Float"])
        tree.links.new(grain(tree), sockets["A_Color"])
        sockets["B_Color"].default_value = (0.2, 0.6, 0.9, 1.0)
        return sockets["Result_Color"]

    return give


def _group_of_values(tree: Any) -> Any:
    inner, begin, end = new_group("squares", A_IN="Color", A_OUT="Color")
    node = node_in(inner, "ShaderNodeGamma", Color=begin.outputs["A"], Gamma=2.0)
    inner.links.new(node.outputs[0], end.inputs["A"])
    outer, begin, end = new_group("squares twice", A_IN="Color", A_OUT="Color")
    once, twice = use_group(outer, inner), use_group(outer, inner)
    outer.links.new(begin.outputs["A"], once.inputs["A"])
    outer.links.new(once.outputs[0], twice.inputs["A"])
    outer.links.new(twice.outputs[0], end.inputs["A"])
    use = use_group(tree, outer)
    tree.links.new(grain(tree), use.inputs["A"])
    return use.outputs[0]


def _more(tree: Any) -> Any:
    """From below 1 to above it."""
    node = node_in(tree, "ShaderNodeMath", Value=height(tree))
    node.operation = "MULTIPLY"
    node.inputs[1].default_value = 2.0
    return node.outputs[0]


def _less(tree: Any) -> Any:
    """From above 0 to below it."""
    node = node_in(tree, "ShaderNodeVectorMath", Vector=grain(tree))
    node.operation = "SUBTRACT"
    node.inputs[1].default_value = (0.5, 0.5, 0.5)
    return node.outputs[0]


VALUES = [
    as_colour("value", constant("ShaderNodeValue", 0.3)),
    as_colour("RGB", constant("ShaderNodeRGB", (0.2, 0.4, 0.6, 1.0))),
    as_roughness("RGB as a value", constant("ShaderNodeRGB", (0.2, 0.4, 0.6, 1.0)), luma),
    as_colour("noise", grain),
    as_roughness("noise as a value", grain, luma),
    as_roughness("roughness above 1", _more, first),
    as_colour("colour ramp", _ramp),
    as_roughness("alpha of a ramp", lambda tree: _ramp(tree).node.outputs["Alpha"], first),
    as_colour("RGB curves", _curves),
    *(as_colour(f"mix {blend}", _mixed_colours(blend))
      for blend in ("MIX", "MULTIPLY", "OVERLAY", "HUE", "SUBTRACT")),
    as_colour("hue and saturation",
              node_of("ShaderNodeHueSaturation", Hue=0.7, Saturation=1.6, Value=0.8, Color=grain)),
    as_colour("map range", node_of("ShaderNodeMapRange", Value=height, From_Min=0.3, From_Max=0.7)),
    as_colour("invert", node_of("ShaderNodeInvert", Color=grain)),
    as_colour("gamma", node_of("ShaderNodeGamma", Color=grain, Gamma=2.2)),
    as_colour("contrast", node_of("ShaderNodeBrightContrast", Color=grain, Contrast=0.5)),
    as_colour("grey", node_of("ShaderNodeRGBToBW", Color=grain)),
    as_colour("black body", node_of("ShaderNodeBlackbody", Temperature=3000.0)),
    as_colour("wavelength", node_of("ShaderNodeWavelength", Wavelength=540.0)),
    as_colour("below zero", _less),
    as_roughness("vector as a value", position, mean),
    as_colour("position", position),
    as_colour("mapped", node_of("ShaderNodeMapping", Rotation=(0.1, 0.4, 0.2), Scale=(1, 2, 3),
                                Vector=node_of("ShaderNodeTexCoord", "Generated"))),
    as_colour("wave", node_of("ShaderNodeTexWave", Vector=position, Scale=0.2)),
    as_colour("gradient", node_of("ShaderNodeTexGradient", Vector=node_of(
        "ShaderNodeTexCoord", "UV"))),
    as_colour("voronoi", node_of("ShaderNodeTexVoronoi", Vector=position, Scale=0.6)),
    as_colour("generated by default", node_of("ShaderNodeTexMagic", Scale=0.3)),
    as_colour("group of values", _group_of_values),
]  # fmt: skip


# What objects and meshes carry.


def _attribute(name: str, kind: str, domain: str, values: Any) -> Callable[[Any], None]:
    def prepare(plane: Any) -> None:
        layer = plane.data.attributes.new(name, kind, domain)
        key = "color" if "COLOR" in kind else "value" if kind == "FLOAT" else "vector"
        layer.data.foreach_set(key, np.asarray(values, dtype=np.float32).ravel())

    return prepare


def _second_uv(plane: Any) -> None:
    layer = plane.data.uv_layers.new(name="Other")
    layer.uv.foreach_set("vector", [0.1, 0.9, 0.2, 0.3, 0.8, 0.4, 0.6, 1.0])


def _look(plane: Any) -> None:
    plane.color, plane.pass_index = (0.3, 0.6, 0.9, 0.4), 3


def _turn_over(plane: Any) -> None:
    plane.rotation_euler = (np.pi, 0.0, 0.0)


def _own_property(plane: Any) -> None:
    plane["wear"] = 0.35


CORNERS = [[0.1, 0.5, 0.9, 1.0], [0.8, 0.2, 0.4, 0.5], [0.3, 0.7, 0.6, 0.2], [1.0, 0.9, 0.1, 0.7]]
CARRIED = [
    as_colour(
        "byte colours",
        node_of("ShaderNodeVertexColor", "Color", {"layer_name": "Paint"}),
        _attribute("Paint", "BYTE_COLOR", "CORNER", CORNERS),
    ),
    as_colour(
        "float colours",
        node_of("ShaderNodeVertexColor", "Color", {"layer_name": "Paint"}),
        _attribute("Paint", "FLOAT_COLOR", "POINT", CORNERS),
    ),
    as_roughness(
        "alpha of colours",
        node_of("ShaderNodeVertexColor", "Alpha", {"layer_name": "Paint"}),
        first,
        _attribute("Paint", "FLOAT_COLOR", "CORNER", CORNERS),
    ),
    as_colour(
        "vector attribute",
        node_of("ShaderNodeAttribute", "Vector", {"attribute_name": "Drift"}),
        _attribute("Drift", "FLOAT_VECTOR", "POINT", [c[:3] for c in CORNERS]),
    ),
    as_roughness(
        "float attribute",
        node_of("ShaderNodeAttribute", "Factor", {"attribute_name": "Wear"}),
        first,
        _attribute("Wear", "FLOAT", "POINT", [0.1, 0.4, 0.8, 0.6]),
    ),
    as_roughness(
        "property of the object",
        node_of(
            "ShaderNodeAttribute",
            "Factor",
            {"attribute_type": "OBJECT", "attribute_name": "wear"},
        ),
        first,
        _own_property,
    ),
    as_colour("attribute that is not there", node_of("ShaderNodeAttribute", "Color")),
    as_colour("second UV map", node_of("ShaderNodeUVMap", "UV", {"uv_map": "Other"}), _second_uv),
    as_colour("object colour", node_of("ShaderNodeObjectInfo", "Color"), _look),
    as_roughness("object alpha", node_of("ShaderNodeObjectInfo", "Alpha"), first, _look),
    as_colour("object index", node_of("ShaderNodeObjectInfo", "Object Index"), _look),
    as_colour("object random", node_of("ShaderNodeObjectInfo", "Random")),
    as_colour("front", node_of("ShaderNodeNewGeometry", "Backfacing")),
    as_colour("back", node_of("ShaderNodeNewGeometry", "Backfacing"), _turn_over),
    as_colour("island", node_of("ShaderNodeNewGeometry", "Random Per Island")),
    as_colour("tangent", node_of("ShaderNodeTangent", 0, {"direction_type": "UV_MAP"})),
]


# Values that change with time.


def _driven(tree: Any, output: Any) -> None:
    node = node_in(tree, "ShaderNodeBsdfPrincipled")
    node.name = "Driven"
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    curve = node.inputs["Roughness"].driver_add("default_value")
    curve.driver.expression = "0.1 + 0.05 * frame"


def _keyed(tree: Any, output: Any) -> None:
    node = tree.nodes.new("ShaderNodeValue")
    for frame, value in ((1, 0.2), (11, 0.7)):
        node.outputs[0].default_value = value
        node.outputs[0].keyframe_insert("default_value", frame=frame)
    shader = node_in(tree, "ShaderNodeBsdfPrincipled", Metallic=node.outputs[0])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


def _keyed_in_a_group(tree: Any, output: Any) -> None:
    group, _, end = new_group("moves", Value_OUT="Float")
    node = group.nodes.new("ShaderNodeValue")
    for frame, value in ((1, 0.8), (11, 0.2)):
        node.outputs[0].default_value = value
        node.outputs[0].keyframe_insert("default_value", frame=frame)
    group.links.new(node.outputs[0], end.inputs["Value"])
    shader = node_in(tree, "ShaderNodeBsdfPrincipled", Roughness=use_group(tree, group).outputs[0])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


# At frame 6; keys are joined by an S-shaped curve, whose middle is the mean.
FRAME = 6
MOVING = [
    Tree("driven", _driven, [principled_fields(roughness=0.4)]),
    Tree("keyed", _keyed, [principled_fields(metallic=0.45)]),
    Tree("keyed in a group", _keyed_in_a_group, [principled_fields(roughness=0.5)]),
]


def _no_nodes_left(tree: Any, output: Any) -> None:
    tree.nodes.clear()


TREES = [*VALUES, *CARRIED, *MOVING, Tree("no nodes", _no_nodes_left)]


# F0 and F90 are one channel.
ALIKE = [as_reflection("coloured", grain), as_reflection("from a value", height)]


def _by_index(tree: Any, output: Any) -> Mapping[str, Any]:
    ior = node_in(tree, "ShaderNodeMapRange", Value=height(tree), To_Min=1.2, To_Max=2.0)
    node = node_in(tree, "ShaderNodeBsdfPrincipled", IOR=ior.outputs[0])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return {"ior": ior.outputs[0]}


# Whether there is a layer at all depends on the IOR, so F90 varies, for all that is known, and
# has one component.
GREY = [
    Tree(
        "by index",
        _by_index,
        [
            principled_fields()
            | {
                "layer_f0": lambda probes: reflectance(first(probes["ior"])),
                "specular_f0": lambda probes: reflectance(probes["ior"]),
            }
        ],
    ),
    Tree("grey principled", _driven, [principled_fields(roughness=0.4)]),
]
