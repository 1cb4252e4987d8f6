# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a material's surface edit into its nodes, so that Cycles shows it too.

An input that is not linked gets another value; before one that is linked a node is put. What the
nodes have no input for is refused before anything is changed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from ..errors import InputError
from ..scene.animation_reader import animation_curves
from ..scene.node_use import used_nodes
from ..scene.surface_edit import WHITE, SurfaceEdit, Tint

_Step = Callable[[], None]

# Nodes that hand shaders on, or that no edit changes.
_LEFT_ALONE = {
    "ShaderNodeMixShader",
    "ShaderNodeAddShader",
    "ShaderNodeBsdfTransparent",
    "ShaderNodeHoldout",
    "NodeReroute",
}
# Cycles takes no reflectance above this for an IOR.
_MOST_F0 = 0.99


def apply_edit(material: Any, edit: SurfaceEdit) -> None:
    """Change a `bpy.types.Material`'s nodes so that they look as the edit shows them.

    Raises:
        InputError: the material has no nodes that can be changed, or they have no input for the
            edit; nothing is changed then.
    """
    if material.library is not None or not material.is_editable:
        raise InputError(
            f"material '{material.name}' is linked from another file; make it local, or change it "
            "there"
        )
    steps = [
        step
        for node in used_nodes(material.node_tree)
        if node.bl_idname not in _LEFT_ALONE
        and any(output.type == "SHADER" for output in node.outputs)
        for step in _Shader(material, node, edit).steps()
    ]
    for step in steps:
        step()


class _Shader:
    """A shader node and what an edit changes about it."""

    def __init__(self, material: Any, node: Any, edit: SurfaceEdit) -> None:
        self._material = material
        self._node = node
        self._edit = edit

    def steps(self) -> Iterator[_Step]:
        """The changes, each to be called."""
        kind = self._node.bl_idname
        if kind == "ShaderNodeBsdfPrincipled":
            yield from self._principled()
        elif kind in ("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlossy"):
            yield from self._tinted("Color")
            yield from self._roughened("Roughness")
            yield from self._weighted()
        elif kind == "ShaderNodeBsdfMetallic":
            if self._node.fresnel_type != "F82" and self._edit.color_factor != WHITE:
                raise self._refusal("a physical conductor has no colour; choose F82 Tint")
            yield from self._tinted("Base Color")
            yield from self._roughened("Roughness")
            yield from self._weighted()
        elif kind == "ShaderNodeEmission":
            yield from self._scaled("Strength", self._edit.emission)
        elif kind in (
            "ShaderNodeBsdfDiffuse",
            "ShaderNodeBsdfTranslucent",
            "ShaderNodeBsdfSheen",
        ):
            yield from self._tinted("Color")
        else:
            raise self._refusal("it is not understood; change it by hand")

    def _principled(self) -> Iterator[_Step]:
        edit = self._edit
        has_coat = self._is_used("Coat Weight")
        yield from self._tinted("Base Color")
        if self._is_used("Sheen Weight"):
            yield from self._tinted("Sheen Tint")
        yield from self._roughened("Roughness")
        if has_coat:
            yield from self._roughened("Coat Roughness")
        yield from self._scaled("Emission Strength", edit.emission)
        if edit.specular_factor == WHITE:
            return
        if self._is_used("Metallic"):
            raise self._refusal("a metal has no input for its specular; put a Mix Shader behind it")
        yield from self._scaled("Specular IOR Level", edit.specular)
        yield from self._multiplied("Specular Tint", edit.specular_tint)
        if has_coat:
            coat = self._node.inputs["Coat IOR"]
            if coat.is_linked:
                raise self._refusal("the IOR of its coat is linked; change it by hand")
            self._require_still(coat)
            ior = max(coat.default_value, 1.0)
            f0 = ((ior - 1.0) / (ior + 1.0)) ** 2 * max(edit.specular_factor)
            root = math.sqrt(min(f0, _MOST_F0))
            yield lambda: setattr(coat, "default_value", (1.0 + root) / (1.0 - root))

    def _tinted(self, name: str) -> Iterator[_Step]:
        yield from self._multiplied(name, self._edit.color_factor)

    def _multiplied(self, name: str, factor: Tint) -> Iterator[_Step]:
        if factor == WHITE:
            return
        socket = self._node.inputs[name]
        if not socket.is_linked:
            self._require_still(socket)

        def step() -> None:
            if not socket.is_linked:
                red, green, blue, alpha = socket.default_value
                wanted = (red * factor[0], green * factor[1], blue * factor[2], alpha)
                socket.default_value = wanted
                return
            mix = self._before(socket, "ShaderNodeMix")
            mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
            mix.clamp_factor = mix.clamp_result = False
            a, b = (each for each in mix.inputs if each.type == "RGBA")
            mix.inputs[0].default_value = 1.0
            b.default_value = (*factor, 1.0)
            self._insert(socket, a, next(o for o in mix.outputs if o.type == "RGBA"))

        yield step

    def _scaled(self, name: str, factor: float) -> Iterator[_Step]:
        if factor != 1.0:
            yield self._affine(name, factor, 0.0, is_share=False)

    def _roughened(self, name: str) -> Iterator[_Step]:
        edit = self._edit
        if (edit.roughness, edit.roughness_offset) != (1.0, 0.0):
            yield self._affine(name, edit.roughness, edit.roughness_offset, is_share=True)

    def _affine(self, name: str, factor: float, offset: float, *, is_share: bool) -> _Step:
        socket = self._node.inputs[name]
        if not socket.is_linked:
            self._require_still(socket)

        def step() -> None:
            if not socket.is_linked:
                value = socket.default_value * factor + offset
                socket.default_value = min(max(value, 0.0), 1.0) if is_share else value
                return
            node = self._before(socket, "ShaderNodeMath")
            node.operation, node.use_clamp = "MULTIPLY_ADD", is_share
            node.inputs[1].default_value, node.inputs[2].default_value = factor, offset
            self._insert(socket, node.inputs[0], node.outputs[0])

        return step

    def _weighted(self) -> Iterator[_Step]:
        """The whole shader by a factor, which must be a share without a tint."""
        edit = self._edit
        if edit.specular_factor == WHITE:
            return
        if edit.specular_tint != WHITE or edit.specular > 1.0:
            raise self._refusal("its gloss can be neither tinted nor raised; use gain and tint")

        def step() -> None:
            output, tree = self._node.outputs[0], self._material.node_tree
            targets = [link.to_socket for link in output.links]
            mix = tree.nodes.new("ShaderNodeMixShader")
            mix.location = (self._node.location.x + 200.0, self._node.location.y)
            mix.inputs[0].default_value = edit.specular
            tree.links.new(output, mix.inputs[2])
            for target in targets:
                tree.links.new(mix.outputs[0], target)

        yield step

    def _is_used(self, name: str) -> bool:
        socket = self._node.inputs[name]
        return bool(socket.is_linked or socket.default_value > 0.0)

    def _before(self, socket: Any, kind: str) -> Any:
        node = self._material.node_tree.nodes.new(kind)
        node.label = f"{socket.name} by Relume"
        node.location = (self._node.location.x - 200.0, self._node.location.y)
        return node

    def _insert(self, socket: Any, into: Any, out_of: Any) -> None:
        links = self._material.node_tree.links
        links.new(socket.links[0].from_socket, into)
        links.new(out_of, socket)

    def _require_still(self, socket: Any) -> None:
        path = socket.path_from_id("default_value")
        if any(curve.data_path == path for curve in animation_curves(socket.id_data)):
            raise self._refusal(f"its '{socket.name}' is animated; change it by hand")

    def _refusal(self, why: str) -> InputError:
        node = f"{self._node.bl_label} node '{self._node.name}'"
        return InputError(f"material '{self._material.name}', {node}: {why}")
