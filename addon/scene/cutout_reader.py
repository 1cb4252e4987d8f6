# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the alpha mask of a material, for the passes that rasterize it.

The bake lets Cycles evaluate any alpha. A rasterized view or shadow map has only the
triangles, so a mask is read here where the material's alpha is a constant or an image passed
through Math nodes, which is how foliage is made; or depends on the view alone, as that of
window panes does, and is then taken from the front. Any other alpha is named as a problem and
drawn opaque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from .node_reader import source_of

Extension = Literal["REPEAT", "EXTEND", "CLIP", "MIRROR"]


@dataclass(frozen=True)
class CutoutSource:
    """What was found; `uv_map` is None when the material needs no mask, "" for the active map."""

    alpha: NDArray[np.float32]
    uv_map: str | None
    extension: Extension
    problem: str = ""


class _Unsupported(Exception):
    """The alpha depends on a node that cannot be read as an image."""


@dataclass
class _Found:
    """The one image map that an alpha may depend on."""

    image: Any = None
    uv_map: str = ""
    extension: Extension = "REPEAT"
    tints: bool = False


# Alpha nearer than this to 0 or 1 is as good as that; masks have soft texels along their outlines,
# at most about this share of them all.
CLEAR = 0.02
_MOST_BETWEEN = 0.05

# Cycles' own bound.
_LEAST_IOR = 1e-5

_OPAQUE = np.ones((1, 1), dtype=np.float32)


def read_cutout_source(material: Any) -> CutoutSource | None:
    """The mask of `material`, or None where it is opaque."""
    tree = material.node_tree
    if tree is None:
        return None
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    if output is None:
        return None
    found = _Found()
    try:
        alpha = 0.0 if is_only_volume(output) else _shader_alpha(output.inputs["Surface"], found)
    except _Unsupported as reason:
        return CutoutSource(
            _OPAQUE, None, "REPEAT", f"alpha depends on {reason}; the view draws it opaque"
        )
    values = np.atleast_2d(np.asarray(alpha, dtype=np.float32))
    problem = _shown_hard(values)
    if found.tints:
        problem = problem or "it tints what lies behind, which the view shows as if it did not"
    if (values >= 0.5).all():
        return CutoutSource(_OPAQUE, None, "REPEAT", problem) if problem else None
    return CutoutSource(np.ascontiguousarray(values), found.uv_map, found.extension, problem)


def is_only_volume(output: Any) -> bool:
    """Whether a material's output has a volume and no surface: Cycles then shows no surface."""
    volume, surface = (source_of(output.inputs[name]) for name in ("Volume", "Surface"))
    return volume is not None and surface is None


def _shown_hard(alpha: NDArray[np.float32]) -> str:
    """What to say of a mask that is neither there nor not there."""
    between = (alpha > CLEAR) & (alpha < 1.0 - CLEAR)
    if between.mean() <= _MOST_BETWEEN:
        return ""
    if alpha.size == 1:
        shown = "opaque" if alpha.item() >= 0.5 else "not there"
        return f"it is see-through (alpha {alpha.item():.2f}); the view shows it as {shown}"
    return (
        f"{100.0 * between.mean():.0f} % of its alpha is between 0 and 1; the view shows it as "
        "opaque from a half on, and not there below"
    )


def _shader_alpha(socket: Any, found: _Found) -> Any:
    output = source_of(socket)
    if output is None:
        return 1.0
    node = output.node
    reader = _SHADER_ALPHA.get(node.bl_idname)
    return 1.0 if reader is None else reader(node, found)


def _mix_alpha(node: Any, found: _Found) -> Any:
    first = _shader_alpha(node.inputs[1], found)
    second = _shader_alpha(node.inputs[2], found)
    if np.ndim(first) == 0 and np.ndim(second) == 0 and first == second:
        return first
    factor = np.clip(_value(node.inputs[0], found), 0.0, 1.0)
    return first * (1.0 - factor) + second * factor


def _add_alpha(node: Any, found: _Found) -> Any:
    return np.minimum(_shader_alpha(node.inputs[0], found), _shader_alpha(node.inputs[1], found))


def _group_alpha(node: Any, _found: _Found) -> Any:
    if node.node_tree is None or _group_is_opaque(node.node_tree, set()):
        return 1.0
    raise _Unsupported(f"the node group '{node.node_tree.name}'")


def _transparent_alpha(node: Any, found: _Found) -> Any:
    color = node.inputs["Color"]
    is_linked = source_of(color) is not None
    if not is_linked and max(color.default_value[:3]) < CLEAR:
        return 1.0  # black: what Cycles shows of it is opaque
    found.tints |= is_linked or min(color.default_value[:3]) < 1.0 - CLEAR
    return 0.0


def _principled_alpha(node: Any, found: _Found) -> Any:
    return np.clip(_value(node.inputs["Alpha"], found), 0.0, 1.0)


_SHADER_ALPHA: dict[str, Callable[[Any, _Found], Any]] = {
    "ShaderNodeBsdfTransparent": _transparent_alpha,
    "ShaderNodeMixShader": _mix_alpha,
    "ShaderNodeAddShader": _add_alpha,
    "ShaderNodeGroup": _group_alpha,
    "ShaderNodeBsdfPrincipled": _principled_alpha,
}


def _group_is_opaque(tree: Any, seen: set[int]) -> bool:
    """Whether no node of a group, or of groups in it, can let light pass straight through."""
    seen.add(tree.session_uid)
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfTransparent":
            return False
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            alpha = node.inputs["Alpha"]
            if alpha.is_linked or alpha.default_value < 0.5:
                return False
        inner = getattr(node, "node_tree", None)
        if (
            inner is not None
            and inner.session_uid not in seen
            and not _group_is_opaque(inner, seen)
        ):
            return False
    return True


def _value(socket: Any, found: _Found) -> Any:
    output = source_of(socket)
    if output is None:
        return float(socket.default_value)
    node = output.node
    if node.bl_idname == "ShaderNodeValue":
        return float(node.outputs[0].default_value)
    if node.bl_idname == "ShaderNodeMath":
        operation = _MATH.get(node.operation)
        if operation is None:
            raise _Unsupported(f"a Math node set to {node.operation}")
        inputs = [_value(node.inputs[i], found) for i in range(operation[0])]
        with np.errstate(divide="ignore", invalid="ignore"):
            result = np.nan_to_num(operation[1](*inputs), nan=0.0, posinf=0.0, neginf=0.0)
        return np.clip(result, 0.0, 1.0) if node.use_clamp else result
    if node.bl_idname == "ShaderNodeTexImage":
        return _image_channel(node, output.identifier, found)
    if node.bl_idname in {"ShaderNodeFresnel", "ShaderNodeLayerWeight"}:
        return _straight_on(node, output.identifier, found)
    raise _Unsupported(f"the node '{node.name}'")


def _straight_on(node: Any, output: str, found: _Found) -> Any:
    """What depends on the view, where it looks at the surface straight on; the bake has it so."""
    if node.bl_idname == "ShaderNodeFresnel":
        ior = np.maximum(_value(node.inputs["IOR"], found), _LEAST_IOR)
    elif output == "Facing":
        return 0.0
    else:
        # Cycles' Layer Weight: the IOR is 1 / (1 - blend).
        ior = 1.0 / np.maximum(1.0 - _value(node.inputs["Blend"], found), _LEAST_IOR)
    return ((ior - 1.0) / (ior + 1.0)) ** 2


_MATH: dict[str, tuple[int, Any]] = {
    "ADD": (2, np.add),
    "SUBTRACT": (2, np.subtract),
    "MULTIPLY": (2, np.multiply),
    "DIVIDE": (2, np.divide),
    "MULTIPLY_ADD": (3, lambda a, b, c: a * b + c),
    "POWER": (2, np.power),
    "MINIMUM": (2, np.minimum),
    "MAXIMUM": (2, np.maximum),
    "LESS_THAN": (2, lambda a, b: np.where(np.less(a, b), 1.0, 0.0)),
    "GREATER_THAN": (2, lambda a, b: np.where(np.greater(a, b), 1.0, 0.0)),
    "ROUND": (1, lambda a: np.floor(np.asarray(a) + 0.5)),
    "FLOOR": (1, np.floor),
    "CEIL": (1, np.ceil),
    "ABSOLUTE": (1, np.abs),
    "SQRT": (1, np.sqrt),
}


def _image_channel(node: Any, output: str, found: _Found) -> NDArray[np.float32]:
    image = node.image
    if image is None or (not image.has_data and image.size[0] == 0):
        return np.zeros((1, 1), dtype=np.float32)
    if node.projection != "FLAT":
        raise _Unsupported(f"the {node.projection.lower()}-projected image '{image.name}'")
    if image.source not in {"FILE", "GENERATED"}:
        raise _Unsupported(f"the image '{image.name}', whose source is {image.source.lower()}")
    if found.image not in (None, image):
        raise _Unsupported("more than one image")
    uv_map = _uv_map(node)
    width, height = image.size
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)
    found.image, found.uv_map = image, uv_map
    found.extension = cast("Extension", node.extension)
    if output == "Alpha":
        if image.channels < 4 or image.alpha_mode == "NONE":
            return np.ones((1, 1), dtype=np.float32)
        return pixels[..., 3].copy()
    if image.colorspace_settings.is_data:
        return pixels[..., : min(3, image.channels)].mean(axis=-1, dtype=np.float32)
    raise _Unsupported(f"the colour of the image '{image.name}'")


def _uv_map(node: Any) -> str:
    output = source_of(node.inputs["Vector"])
    if output is None:
        return ""
    if output.node.bl_idname == "ShaderNodeUVMap" and not output.node.from_instancer:
        return str(output.node.uv_map)
    if output.node.bl_idname == "ShaderNodeTexCoord" and output.name == "UV":
        return ""
    raise _Unsupported(f"the texture coordinates made by the node '{output.node.name}'")
