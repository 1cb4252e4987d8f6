# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees whose mix factors are curves of the view, which are shaded at run time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .material_grid import node_in
from .material_trees import Tree
from .trees_of_closures import reflectance
from .trees_of_mixes import BLUE, GOLD, RED, diffuse, emission, gloss, glossy, mix, surface

FRESNEL, FACING = 1, 2


def by_view(curve: int, parameter: float, *, falls: bool) -> dict[str, Any]:
    return {
        "view_base": 1.0 if falls else 0.0,
        "view_slope": -1.0 if falls else 1.0,
        "view_curve": curve,
        "view_parameter": parameter,
    }


def _layered(kind: str, output: str, **inputs: Any) -> Callable[[Any], Any]:
    def make(tree: Any) -> Any:
        factor = node_in(tree, kind, **inputs).outputs[output]
        return mix(tree, factor, diffuse(tree, RED), glossy(tree, GOLD))

    return make


def layers(curve: int, parameter: float) -> list[dict[str, Any]]:
    return [
        {"diffuse_color": RED} | by_view(curve, parameter, falls=True),
        gloss(GOLD) | by_view(curve, parameter, falls=False),
    ]


def _facing_exponent(blend: float) -> float:
    return 2.0 * blend if blend < 0.5 else 0.5 / (1.0 - blend)


def _curves_of_curves(tree: Any) -> Any:
    inner = _layered("ShaderNodeFresnel", "Factor", IOR=1.5)(tree)
    factor = node_in(tree, "ShaderNodeLayerWeight", Blend=0.5).outputs["Facing"]
    return mix(tree, factor, inner, diffuse(tree, BLUE))


def _with_normals(*, same: bool) -> Callable[[Any], Any]:
    """A bent normal for both shaders, and for the Fresnel node too or not."""

    def make(tree: Any) -> Any:
        bent = node_in(tree, "ShaderNodeNormalMap", Color=(0.8, 0.5, 0.9))
        bent.space = "WORLD"
        bent = bent.outputs[0]
        factor = node_in(tree, "ShaderNodeFresnel", IOR=1.5)
        if same:
            tree.links.new(bent, factor.inputs["Normal"])
        under = node_in(tree, "ShaderNodeBsdfDiffuse", Color=RED, Normal=bent).outputs[0]
        over = node_in(
            tree, "ShaderNodeBsdfAnisotropic", Color=GOLD, Roughness=0.2, Normal=bent
        ).outputs[0]
        return mix(tree, factor.outputs[0], under, over)

    return make


BENT = [lobe | {"normal": (0.6, 0.0, 0.8)} for lobe in layers(FRESNEL, reflectance(1.5))]
TREES = [
    *(
        Tree(
            f"fresnel {ior}",
            surface(_layered("ShaderNodeFresnel", "Factor", IOR=ior)),
            layers(FRESNEL, reflectance(ior)),
        )
        for ior in (1.0, 1.45, 2.5)
    ),
    Tree(
        "fresnel 0.7",
        surface(_layered("ShaderNodeFresnel", "Factor", IOR=0.7)),
        layers(FRESNEL, reflectance(0.7)),
        effects=("its IOR is below 1 and is inverted",),
    ),
    *(
        Tree(
            f"weight {blend}",
            surface(_layered("ShaderNodeLayerWeight", "Fresnel", Blend=blend)),
            layers(FRESNEL, reflectance(1.0 / (1.0 - blend))),
        )
        for blend in (0.0, 0.3, 0.8)
    ),
    *(
        Tree(
            f"facing {blend}",
            surface(_layered("ShaderNodeLayerWeight", "Facing", Blend=blend)),
            layers(FACING, _facing_exponent(blend)),
        )
        for blend in (0.1, 0.5, 0.75)
    ),
    Tree("fresnel with its normal", surface(_with_normals(same=True)), BENT),
    Tree(
        "fresnel without the normal",
        surface(_with_normals(same=False)),
        BENT,
        effects=("the normal of what it mixes",),
    ),
    Tree(
        "curves of curves",
        surface(_curves_of_curves),
        [
            layers(FRESNEL, 0.04)[0],
            layers(FRESNEL, 0.04)[1],
            {"diffuse_color": BLUE} | by_view(FACING, 1.0, falls=False),
        ],
        effects=("a second weight that depends on the view",),
    ),
    Tree(
        "glow by fresnel",
        surface(
            lambda tree: mix(
                tree,
                node_in(tree, "ShaderNodeFresnel", IOR=1.5).outputs[0],
                diffuse(tree, RED),
                emission(tree, GOLD, 2.0),
            )
        ),
        [layers(FRESNEL, 0.04)[0]],
        emission=0.04 * 2.0 * GOLD,
        effects=("a second weight that depends on the view",),
    ),
]
