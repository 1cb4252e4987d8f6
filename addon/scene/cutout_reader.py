# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the alpha mask of a material, for the passes that rasterize it.

The bake lets Cycles evaluate any alpha. A rasterized view or shadow map has only the
triangles, so a mask is read here where the material's alpha is a constant or an image passed
through Math nodes, which is how foliage is made; or depends on the view alone, as that of
window panes does, and is then taken from the front. Any other alpha is named as a problem and
drawn opaque. What is neither there nor not there, or tinted, is `sheer_reader`'s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mask_value_reader import Extension, ImageFound, UnreadableError, value_of
from .node_reader import source_of
from .sheer_reader import CLEAR, group_is_opaque, read_transmission


@dataclass(frozen=True)
class CutoutSource:
    """What was found; `uv_map` is None when the material needs no mask, "" for the active map.

    Attributes:
        alpha: (H, W) where it is there; 1 all over of what is sheer.
        transmission: (H, W, 3) what a sheer material lets through; None of others.
        outside: (3,) the same outside of a clipped image.
        problem: what is not shown as it is; "" for nothing.
    """

    alpha: NDArray[np.float32]
    uv_map: str | None
    extension: Extension
    problem: str = ""
    transmission: NDArray[np.float32] | None = None
    outside: NDArray[np.float32] | None = None

    @property
    def is_sheer(self) -> bool:
        """Whether it is shown as a layer before what lies behind."""
        return self.transmission is not None


# Masks have soft texels along their outlines, at most about this share of them all.
_MOST_BETWEEN = 0.05

_OPAQUE = np.ones((1, 1), dtype=np.float32)


def read_cutout_source(material: Any) -> CutoutSource | None:
    """The mask of `material`, or None where it is opaque."""
    tree = material.node_tree
    if tree is None:
        return None
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    if output is None:
        return None
    found = ImageFound()
    try:
        alpha = 0.0 if is_only_volume(output) else _shader_alpha(output.inputs["Surface"], found)
    except UnreadableError as reason:
        return CutoutSource(
            _OPAQUE, None, "REPEAT", f"alpha depends on {reason}; the view draws it opaque"
        )
    values = np.atleast_2d(np.asarray(alpha, dtype=np.float32))
    problem = _shown_hard(values)
    if problem or found.tints or found.by_view or found.adds:
        sheer = read_transmission(output.inputs["Surface"])
        if sheer is not None:
            return _sheer_source(*sheer)
    if found.tints:
        problem = problem or "it tints what lies behind, which the view shows as if it did not"
    if (values >= 0.5).all():
        return CutoutSource(_OPAQUE, None, "REPEAT", problem) if problem else None
    return CutoutSource(np.ascontiguousarray(values), found.uv_map, found.extension, problem)


def is_sheer(material: Any) -> bool:
    """Whether a material is shown as a layer before what lies behind it."""
    source = read_cutout_source(material)
    return source is not None and source.is_sheer


def _sheer_source(
    transmission: NDArray[np.float32], outside: NDArray[np.float32], found: ImageFound
) -> CutoutSource | None:
    if max(transmission.max(), outside.max()) < CLEAR:
        return None
    problem = ""
    if found.by_view:
        problem = (
            "how much it lets through is shown as seen from the front at any angle, also in its "
            "shadow"
        )
    return CutoutSource(_OPAQUE, found.uv_map, found.extension, problem, transmission, outside)


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


def _shader_alpha(socket: Any, found: ImageFound) -> Any:
    output = source_of(socket)
    if output is None:
        return 1.0
    node = output.node
    reader = _SHADER_ALPHA.get(node.bl_idname)
    return 1.0 if reader is None else reader(node, found)


def _mix_alpha(node: Any, found: ImageFound) -> Any:
    first = _shader_alpha(node.inputs[1], found)
    second = _shader_alpha(node.inputs[2], found)
    if np.ndim(first) == 0 and np.ndim(second) == 0 and first == second:
        return first
    factor = np.clip(value_of(node.inputs[0], found), 0.0, 1.0)
    return first * (1.0 - factor) + second * factor


def _add_alpha(node: Any, found: ImageFound) -> Any:
    first, second = (_shader_alpha(node.inputs[i], found) for i in (0, 1))
    found.adds |= bool(np.any(np.minimum(first, second) < np.maximum(first, second)))
    return np.minimum(first, second)


def _group_alpha(node: Any, _found: ImageFound) -> Any:
    if node.node_tree is None or group_is_opaque(node.node_tree, set()):
        return 1.0
    raise UnreadableError(f"the node group '{node.node_tree.name}'")


def _transparent_alpha(node: Any, found: ImageFound) -> Any:
    color = node.inputs["Color"]
    is_linked = source_of(color) is not None
    if not is_linked and max(color.default_value[:3]) < CLEAR:
        return 1.0  # black: what Cycles shows of it is opaque
    found.tints |= is_linked or min(color.default_value[:3]) < 1.0 - CLEAR
    return 0.0


def _principled_alpha(node: Any, found: ImageFound) -> Any:
    return np.clip(value_of(node.inputs["Alpha"], found), 0.0, 1.0)


_SHADER_ALPHA: dict[str, Callable[[Any, ImageFound], Any]] = {
    "ShaderNodeBsdfTransparent": _transparent_alpha,
    "ShaderNodeMixShader": _mix_alpha,
    "ShaderNodeAddShader": _add_alpha,
    "ShaderNodeGroup": _group_alpha,
    "ShaderNodeBsdfPrincipled": _principled_alpha,
}
