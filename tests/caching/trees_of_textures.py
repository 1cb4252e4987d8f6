# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees with image textures of each colour space, bump and normal maps, and textures in every
input of the Principled BSDF."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import bpy
import numpy as np

from .material_grid import node_in
from .material_trees import Probes, Tree
from .trees_of_closures import BASE, edge, principled_fields, reflectance
from .trees_of_inputs import as_colour, as_roughness, first, grain, height, noise, position

PIXELS = 8


def image(
    name: str, space: str, pixels: Any, *, is_float: bool = False, alpha: str = "STRAIGHT"
) -> Any:
    """An image of these pixels, (8, 8, 4) or four numbers for all, kept in the file."""
    made = bpy.data.images.new(name, PIXELS, PIXELS, alpha=True, float_buffer=is_float)
    made.colorspace_settings.name = space
    made.alpha_mode = alpha
    whole = np.broadcast_to(np.asarray(pixels, dtype=np.float32), (PIXELS, PIXELS, 4))
    made.pixels.foreach_set(np.ascontiguousarray(whole).ravel())
    made.pack()
    return made


def gradient() -> np.ndarray:
    """(8, 8, 4) red to the right, green upward, and as opaque as both."""
    x, y = np.meshgrid(np.linspace(0.1, 0.9, PIXELS), np.linspace(0.2, 1.0, PIXELS))
    return np.stack([x, y, np.full_like(x, 0.4), 0.5 + 0.25 * (x + y)], axis=-1)


def texture(made: Any, output: str = "Color", **settings: Any) -> Callable[[Any], Any]:
    def give(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = made()
        for name, value in settings.items():
            setattr(node, name, value)
        return node.outputs[output]

    return give


def from_srgb(encoded: Any) -> Any:
    """IEC 61966-2-1."""
    encoded = np.asarray(encoded, dtype=np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# Rec.2020 to Rec.709, both linear (ITU-R BT.2407, equation 1), to four digits.
FROM_REC_2020 = np.array(
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
)

# Of an image that has one colour; bytes hold it exactly.
CODES = np.array([51, 102, 204]) / 255.0


def of_one_colour(name: str, space: str, expected: Any, *, is_float: bool = False) -> Tree:
    def make(tree: Any, output: Any) -> None:
        made = image(name, space, [*CODES, 1.0], is_float=is_float)
        node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=texture(lambda: made)(tree))
        tree.links.new(node.outputs[0], output.inputs["Surface"])

    return Tree(name, make, [{"diffuse_color": expected}])


SPACES = ["sRGB", "Non-Color", "Linear Rec.709", "Linear Rec.2020", "ACEScg", "Linear DCI-P3 D65"]


def _gradient_in(space: str, *, is_float: bool) -> Tree:
    name = f"{'float' if is_float else 'byte'} {space}"
    return as_colour(name, texture(lambda: image(name, space, gradient(), is_float=is_float)))


IMAGES = [
    of_one_colour("one sRGB colour", "sRGB", from_srgb(CODES)),
    of_one_colour("one raw colour", "Non-Color", CODES),
    of_one_colour("one linear colour", "Linear Rec.709", CODES, is_float=True),
    of_one_colour("one wide colour", "Linear Rec.2020", FROM_REC_2020 @ CODES),
    *(_gradient_in(space, is_float=False) for space in SPACES),
    *(_gradient_in(space, is_float=True) for space in SPACES),
    as_roughness(
        "alpha of an image", texture(lambda: image("alpha", "sRGB", gradient()), "Alpha"), first
    ),
    *(
        as_colour(
            f"{mode} alpha",
            texture(lambda mode=mode: image(mode, "sRGB", gradient(), alpha=mode)),
        )
        for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
    ),
    *(
        as_colour(
            f"{extension} {interpolation}",
            texture(
                lambda: image("shown", "sRGB", gradient()),
                extension=extension,
                interpolation=interpolation,
            ),
        )
        for extension, interpolation in (("CLIP", "Cubic"), ("MIRROR", "Smart"))
    ),
    as_colour(
        "image from all sides",
        texture(lambda: image("box", "sRGB", gradient()), projection="BOX", projection_blend=0.3),
    ),
    as_colour("no image", lambda tree: tree.nodes.new("ShaderNodeTexImage").outputs["Color"]),
]


# Normals: what a node gives as a vector, at unit length.


def _bent(give: Callable[[Any], Any]) -> Callable[[Any, Any], Mapping[str, Any]]:
    def make(tree: Any, output: Any) -> Mapping[str, Any]:
        normal = give(tree)
        node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=BASE, Normal=normal)
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return {"normal": normal}

    return make


def unit(probes: Probes) -> Any:
    normal = probes["normal"]
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def bent(
    name: str, give: Callable[[Any], Any], prepare: Callable[[Any], None] | None = None
) -> Tree:
    return Tree(name, _bent(give), [{"diffuse_color": BASE, "normal": unit}], prepare=prepare)


def bump(tree: Any) -> Any:
    return node_in(tree, "ShaderNodeBump", Height=height(tree), Strength=0.8).outputs[0]


def bump_on_a_normal_map(tree: Any) -> Any:
    under = normal_map("TANGENT", 0.7)(tree)
    return node_in(tree, "ShaderNodeBump", Height=height(tree), Normal=under).outputs[0]


def normal_map(space: str, strength: float) -> Callable[[Any], Any]:
    def give(tree: Any) -> Any:
        colour = node_in(tree, "ShaderNodeMapRange", Value=height(tree), To_Min=0.4, To_Max=0.8)
        joined = node_in(tree, "ShaderNodeCombineXYZ", X=colour.outputs[0], Y=0.4, Z=0.9)
        node = node_in(tree, "ShaderNodeNormalMap", Color=joined.outputs[0], Strength=strength)
        node.space = space
        return node.outputs[0]

    return give


def _turned_and_stretched(plane: Any) -> None:
    plane.rotation_euler = (0.0, 0.0, 0.5 * np.pi)
    # As large as before, in another direction; a mirrored UV map, too.
    plane.scale = (1.0, -1.0, 1.0)


def _turned_over(plane: Any) -> None:
    plane.rotation_euler = (np.pi, 0.0, 0.0)


def _displaced(tree: Any, output: Any) -> Mapping[str, Any]:
    """As bump; the surface's own normal has it in it."""
    node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=BASE)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    displacement = node_in(tree, "ShaderNodeDisplacement", Height=height(tree), Scale=0.3)
    tree.links.new(displacement.outputs[0], output.inputs["Displacement"])
    return {"normal": tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]}


def _two_normals(tree: Any, output: Any) -> Mapping[str, Any]:
    """Lobes that agree in all but the normal."""
    bumped, mapped = bump(tree), normal_map("WORLD", 1.0)(tree)
    mix = tree.nodes.new("ShaderNodeMixShader")
    for normal, socket in zip((bumped, mapped), mix.inputs[1:], strict=True):
        node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=BASE, Normal=normal)
        tree.links.new(node.outputs[0], socket)
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return {"normal": bumped, "second": mapped}


NORMALS = [
    bent("bump", bump),
    bent("bump on a normal map", bump_on_a_normal_map),
    *(
        bent(f"normal map {space} {strength}", normal_map(space, strength))
        for space in ("TANGENT", "OBJECT", "WORLD")
        for strength in (1.0, 0.5)
    ),
    bent("turned normal map", normal_map("TANGENT", 1.0), _turned_and_stretched),
    bent("turned object normals", normal_map("OBJECT", 1.0), _turned_and_stretched),
    bent("normal map behind", normal_map("TANGENT", 1.0), _turned_over),
    bent("bump behind", bump, _turned_over),
    Tree("displaced", _displaced, [{"diffuse_color": BASE, "normal": unit}]),
    Tree(
        "two normals",
        _two_normals,
        [
            {"diffuse_color": 0.5 * BASE, "normal": unit},
            {
                "diffuse_color": 0.5 * BASE,
                "normal": lambda probes: unit({"normal": probes["second"]}),
            },
        ],
    ),
]


# Textures in every input.

RANGES = {
    "Metallic": (0.1, 0.9),
    "Roughness": (0.2, 0.8),
    "IOR": (1.2, 2.0),
    "Diffuse Roughness": (0.0, 1.0),
    "Specular IOR Level": (0.2, 0.9),
}


def _all_textured(tree: Any, output: Any) -> Mapping[str, Any]:
    node = node_in(tree, "ShaderNodeBsdfPrincipled")
    sockets = {
        "Base Color": grain(tree),
        "Specular Tint": noise(tree, 0.4).outputs["Color"],
        "Emission Color": position(tree),
        "Normal": bump(tree),
    }
    for number, (name, (low, high)) in enumerate(RANGES.items()):
        value = noise(tree, 0.3 + 0.1 * number).outputs[0]
        sockets[name] = node_in(
            tree, "ShaderNodeMapRange", Value=value, From_Min=0.3, From_Max=0.7, To_Min=low,
            To_Max=high,
        ).outputs[0]  # fmt: skip
    for name, socket in sockets.items():
        tree.links.new(socket, node.inputs[name])
    node.inputs["Emission Strength"].default_value = 2.0
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return sockets


def _dielectric(probes: Probes) -> Any:
    """(n, 3) its reflectance at normal incidence."""
    f0 = reflectance(first(probes["IOR"])) * 2.0 * first(probes["Specular IOR Level"])
    return np.minimum(f0 * probes["Specular Tint"], 1.0)


def _metal(probes: Probes) -> Any:
    return first(probes["Metallic"])


TEXTURED = {
    "diffuse_color": lambda probes: (1.0 - _metal(probes)) * probes["Base Color"],
    "diffuse_roughness": lambda probes: first(probes["Diffuse Roughness"]),
    "diffuse_share": lambda probes: 1.0 - _metal(probes),
    "layer_f0": lambda probes: _dielectric(probes).max(axis=1, keepdims=True),
    "layer_f90": 1.0,
    "specular_f0": lambda probes: (
        _metal(probes) * probes["Base Color"] + (1.0 - _metal(probes)) * _dielectric(probes)
    ),
    "specular_f90": 1.0,
    "specular_dip": lambda probes: (
        _metal(probes) * edge(probes["Base Color"], np.minimum(probes["Specular Tint"], 1.0))
    ),
    "dielectric": lambda probes: 1.0 - _metal(probes),
    "roughness": lambda probes: first(probes["Roughness"]),
    "normal": lambda probes: unit({"normal": probes["Normal"]}),
}


def _conductor(tree: Any, output: Any) -> Mapping[str, Any]:
    node = tree.nodes.new("ShaderNodeBsdfMetallic")
    node.fresnel_type = "F82"
    sockets = {"Base Color": grain(tree), "Edge Tint": noise(tree, 0.4).outputs["Color"]}
    for name, socket in sockets.items():
        tree.links.new(socket, node.inputs[name])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return sockets


WHOLE = [
    Tree(
        "textures in every input",
        _all_textured,
        [TEXTURED],
        emission=lambda probes: 2.0 * probes["Emission Color"],
    ),
    Tree(
        "textured metal",
        _conductor,
        [
            {
                "specular_f0": lambda probes: probes["Base Color"],
                "specular_f90": 1.0,
                "specular_dip": lambda probes: edge(probes["Base Color"], probes["Edge Tint"]),
                "roughness": 0.5,
            }
        ],
    ),
]

# Anisotropy: alpha is divided by the aspect along the tangent, and multiplied with it across.


def _stretched(kind: str, anisotropy: str, rotation: str, amount: float, turns: float) -> Any:
    def make(tree: Any, output: Any) -> Mapping[str, Any]:
        node = node_in(tree, kind)
        node.inputs[anisotropy].default_value = amount
        node.inputs[rotation].default_value = turns
        tangent = node_in(tree, "ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return {"tangent": tangent.outputs[0]}

    return make


def _turned(turns: float) -> Callable[[Probes], Any]:
    """About the planes' normal, +Z."""
    sine, cosine = np.sin(2.0 * np.pi * turns), np.cos(2.0 * np.pi * turns)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return lambda probes: probes["tangent"] @ turn.T


GLOSSY, METALLIC = "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfMetallic"
STRETCHED = [
    *(
        Tree(
            f"glossy stretched by {amount}",
            _stretched(GLOSSY, "Anisotropy", "Rotation", amount, 0.1),
            [
                {"specular_f0": 0.8, "specular_f90": 0.8, "roughness": 0.5}
                | {"aspect": aspect, "tangent": _turned(0.1)}
            ],
        )
        # Alpha along the tangent is 1 - a times as large, or by 1 + a.
        for amount, aspect in ((0.4, 1.0 / 0.6), (-0.4, 0.6))
    ),
    Tree(
        "metal stretched",
        _stretched(METALLIC, "Anisotropy", "Rotation", 0.5, 0.0),
        [
            {"specular_f0": [0.617, 0.577, 0.540], "specular_f90": 1.0, "roughness": 0.5}
            | {"specular_dip": edge(np.array([0.617, 0.577, 0.540]), [0.695, 0.726, 0.770])}
            | {"aspect": np.sqrt(1.0 - 0.9 * 0.5), "tangent": _turned(0.0)}
        ],
    ),
    Tree(
        "principled stretched",
        _stretched("ShaderNodeBsdfPrincipled", "Anisotropic", "Anisotropic Rotation", 0.8, 0.3),
        [principled_fields() | {"aspect": np.sqrt(1.0 - 0.9 * 0.8), "tangent": _turned(0.3)}],
    ),
]

TREES = [*STRETCHED, *IMAGES, *NORMALS, *WHOLE]
