# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of Mix and Add Shader nodes, groups, reroutes and muted nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from addon.caching.channels import MAX_LOBES

from .material_grid import node_in
from .material_trees import Probes, Tree
from .trees_of_closures import MULTI_GGX, glossy_fields, principled_fields

RED, BLUE = np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.2, 0.9])
GOLD = np.array([0.9, 0.7, 0.3])


def diffuse(tree: Any, colour: Any) -> Any:
    return node_in(tree, "ShaderNodeBsdfDiffuse", Color=colour).outputs[0]


def glossy(tree: Any, colour: Any, roughness: float = 0.2) -> Any:
    node = node_in(tree, "ShaderNodeBsdfAnisotropic", Color=colour, Roughness=roughness)
    return node.outputs[0]


def emission(tree: Any, colour: Any, strength: float) -> Any:
    return node_in(tree, "ShaderNodeEmission", Color=colour, Strength=strength).outputs[0]


def clear(tree: Any) -> Any:
    return node_in(tree, "ShaderNodeBsdfTransparent", Color=(1, 1, 1)).outputs[0]


def mix(tree: Any, factor: Any, first: Any, second: Any) -> Any:
    node = tree.nodes.new("ShaderNodeMixShader")
    if isinstance(factor, float):
        node.inputs[0].default_value = factor
    else:
        tree.links.new(factor, node.inputs[0])
    for source, sink in zip((first, second), node.inputs[1:], strict=True):
        if source is not None:
            tree.links.new(source, sink)
    return node.outputs[0]


def add(tree: Any, first: Any, second: Any) -> Any:
    node = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(first, node.inputs[0])
    tree.links.new(second, node.inputs[1])
    return node.outputs[0]


def value(tree: Any, number: float) -> Any:
    node = tree.nodes.new("ShaderNodeValue")
    node.outputs[0].default_value = number
    return node.outputs[0]


def surface(make: Callable[[Any], Any]) -> Callable[[Any, Any], None]:
    """A tree whose surface is the shader that `make` gives."""

    def whole(tree: Any, output: Any) -> None:
        tree.links.new(make(tree), output.inputs["Surface"])

    return whole


def gloss(colour: Any, roughness: float = 0.2, share: Any = 1.0) -> dict[str, Any]:
    """A gloss whose weight is in its colour, and is this share."""
    return glossy_fields(colour, roughness, MULTI_GGX) | {"specular_share": share}


# Mixes of mixes.


def _tower(depth: int) -> Callable[[Any], Any]:
    """Red and gold in turn, each a third of what is below it."""

    def make(tree: Any) -> Any:
        shader = diffuse(tree, RED)
        for level in range(depth):
            top = glossy(tree, GOLD) if level % 2 == 0 else diffuse(tree, BLUE)
            shader = mix(tree, 1.0 / 3.0, shader, top)
        return shader

    return make


def _tower_fields(depth: int) -> dict[str, Any]:
    red, blue, gold = 1.0, 0.0, 0.0
    for level in range(depth):
        red, blue, gold = (2.0 / 3.0 * x for x in (red, blue, gold))
        gold, blue = (gold + 1.0 / 3.0, blue) if level % 2 == 0 else (gold, blue + 1.0 / 3.0)
    return {"diffuse_color": red * RED + blue * BLUE} | gloss(gold * GOLD, share=gold)


def _four_glosses(tree: Any) -> Any:
    pairs = [mix(tree, 0.25, glossy(tree, RED, r), glossy(tree, BLUE, r + 0.1)) for r in (0.1, 0.5)]
    return mix(tree, 0.4, *pairs)


def _too_many(tree: Any) -> Any:
    shader = glossy(tree, (0.1, 0.1, 0.1), 0.1)
    for k in range(1, MAX_LOBES + 1):
        shader = add(tree, shader, glossy(tree, (0.1, 0.1, 0.1), 0.1 * (k + 1)))
    return shader


def _used_twice(tree: Any) -> Any:
    shader = diffuse(tree, RED)
    return add(tree, mix(tree, 0.5, shader, glossy(tree, GOLD)), shader)


def _colour_for_a_shader(tree: Any) -> Any:
    node = tree.nodes.new("ShaderNodeRGB")
    node.outputs[0].default_value = (0.1, 0.5, 2.0, 1.0)
    return mix(tree, 0.25, node.outputs[0], diffuse(tree, RED))


TOWERS = [
    *(
        Tree(f"depth {depth}", surface(_tower(depth)), [_tower_fields(depth)])
        for depth in (1, 2, 3, 4)
    ),
    Tree(
        "four lobes",
        surface(_four_glosses),
        [gloss(w * c, r, w) for w, c, r in ((0.45, RED, 0.1), (0.15, BLUE, 0.2), (0.3, RED, 0.5),
                                         (0.1, BLUE, 0.6))],
    ),
    Tree(
        "five lobes",
        surface(_too_many),
        [gloss([0.1] * 3, 0.1 * k) for k in range(1, MAX_LOBES)]
        # The last two weigh the same.
        + [gloss([0.2] * 3, 0.1 * (MAX_LOBES + 0.5), 2.0)],
        effects=("of its 5 lobes",),
    ),
    Tree(
        "used twice",
        surface(_used_twice),
        [{"diffuse_color": 1.5 * RED} | gloss(0.5 * GOLD, share=0.5)],
    ),
    Tree(
        "principled and diffuse",
        surface(
            lambda tree: mix(
                tree, 0.25, node_in(tree, "ShaderNodeBsdfPrincipled").outputs[0], diffuse(tree, RED)
            )
        ),
        [
            principled_fields()
            | {"diffuse_color": [0.6] * 3, "specular_f0": 0.03, "specular_f90": 0.75,
               "specular_share": 0.75, "dielectric": 0.75},
            {"diffuse_color": 0.25 * RED},
        ],
    ),
    Tree(
        "added emission",
        surface(lambda tree: add(tree, diffuse(tree, RED), emission(tree, GOLD, 3.0))),
        [{"diffuse_color": RED}],
        emission=3.0 * GOLD,
    ),
    Tree(
        "colour for a shader",
        surface(_colour_for_a_shader),
        [{"diffuse_color": 0.25 * RED}],
        emission=0.75 * np.array([0.1, 0.5, 2.0]),
    ),
    Tree(
        "nothing on one side",
        surface(lambda tree: mix(tree, 0.25, None, diffuse(tree, RED))),
        [{"diffuse_color": 0.25 * RED}],
    ),
    Tree(
        "all of one side",
        surface(lambda tree: mix(tree, 1.0, glossy(tree, GOLD), diffuse(tree, RED))),
        [{"diffuse_color": RED}],
    ),
    Tree(
        "factor beyond 1",
        surface(lambda tree: mix(tree, value(tree, 7.0), glossy(tree, GOLD), diffuse(tree, RED))),
        [{"diffuse_color": RED}],
    ),
    Tree(
        "mostly there mix",
        surface(lambda tree: mix(tree, 0.75, clear(tree), diffuse(tree, RED))),
        [{"diffuse_color": 0.75 * RED, "diffuse_share": 0.75}],
    ),
    Tree(
        "hardly there mix",
        surface(lambda tree: mix(tree, 0.25, clear(tree), diffuse(tree, RED))),
        [{"diffuse_color": 0.25 * RED, "diffuse_share": 0.25}],
    ),
    Tree(
        "clear below a mix",
        surface(
            lambda tree: mix(
                tree, 0.5, mix(tree, 0.5, clear(tree), diffuse(tree, RED)), glossy(tree, GOLD)
            )
        ),
        [{"diffuse_color": 0.25 * RED, "diffuse_share": 0.25} | gloss(0.5 * GOLD, share=0.5)],
    ),
]  # fmt: skip


# Mixes by a texture: the factor is what plain Cycles shows of it, held to [0, 1].


def _noise(tree: Any, scale: float = 0.7, gain: float = 1.0) -> Any:
    """A slow noise, so that what is within a texel is nearly one value."""
    position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    noise = node_in(tree, "ShaderNodeTexNoise", Vector=position, Scale=scale, Detail=0.0)
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = "MULTIPLY"
    tree.links.new(noise.outputs[0], node.inputs[0])
    node.inputs[1].default_value = gain
    return node.outputs[0]


def _by_texture(tree: Any, output: Any) -> dict[str, Any]:
    factor = _noise(tree, gain=1.8)
    shader = mix(tree, factor, diffuse(tree, RED), glossy(tree, GOLD))
    tree.links.new(shader, output.inputs["Surface"])
    return {"factor": factor}


def _share(probes: Probes) -> Any:
    return np.clip(probes["factor"], 0.0, 1.0)


def _by_colour(tree: Any, output: Any) -> dict[str, Any]:
    """A colour as a factor is its luma."""
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(_noise(tree), ramp.inputs[0])
    ramp.color_ramp.elements[0].color = (0.1, 0.9, 0.2, 1.0)
    ramp.color_ramp.elements[1].color = (0.9, 0.3, 0.5, 1.0)
    shader = mix(tree, ramp.outputs[0], diffuse(tree, RED), glossy(tree, GOLD))
    tree.links.new(shader, output.inputs["Surface"])
    return {"factor": ramp.outputs[0]}


def _luma(probes: Probes) -> Any:
    return (probes["factor"] @ np.array([0.2126, 0.7152, 0.0722]))[:, None]


def _by_vector(tree: Any, output: Any) -> dict[str, Any]:
    """A vector as a factor is its components' mean."""
    coordinates = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
    shader = mix(tree, coordinates, diffuse(tree, RED), glossy(tree, GOLD))
    tree.links.new(shader, output.inputs["Surface"])
    return {"factor": coordinates}


def _mean(probes: Probes) -> Any:
    return probes["factor"].mean(axis=1)[:, None]


def _soft_edge(tree: Any, output: Any) -> dict[str, Any]:
    """Never less than half there."""
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = "MULTIPLY_ADD"
    tree.links.new(_noise(tree), node.inputs[0])
    node.inputs[1].default_value, node.inputs[2].default_value = 0.4, 0.55
    under = mix(tree, _noise(tree, scale=0.4), diffuse(tree, RED), glossy(tree, GOLD))
    shader = mix(tree, node.outputs[0], clear(tree), under)
    tree.links.new(shader, output.inputs["Surface"])
    return {"factor": _noise(tree, scale=0.4)}


def _mixed_fields(share: Callable[[Probes], Any]) -> dict[str, Any]:
    return {"diffuse_color": lambda probes: (1.0 - share(probes)) * RED} | gloss(
        lambda probes: share(probes) * GOLD, share=lambda probes: share(probes)[:, :1]
    )


TEXTURED = [
    Tree("by texture", _by_texture, [_mixed_fields(_share)]),
    Tree("by colour", _by_colour, [_mixed_fields(_luma)]),
    Tree("by vector", _by_vector, [_mixed_fields(_mean)]),
    Tree("soft all over", _soft_edge, [_mixed_fields(_share)]),
]


TREES = [*TOWERS, *TEXTURED]
