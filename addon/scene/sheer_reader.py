# SPDX-License-Identifier: GPL-3.0-or-later
"""What sheer materials let pass straight through, in which colours.

A Transparent BSDF lets through its colour, a Principled BSDF what its alpha leaves; a Mix Shader
mixes, and an Add Shader adds, as Cycles sums its closures.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mask_value_reader import ImageFound, UnreadableError, color_of, value_of
from .node_reader import source_of

# Alpha nearer than this to 0 or 1 is as good as that.
CLEAR = 0.02


def read_transmission(
    surface: Any,
) -> tuple[NDArray[np.float32], NDArray[np.float32], ImageFound] | None:
    """What passes through the shader at a material's Surface input.

    Returns:
        (H, W, 3) in [0, 1] by the image that was found, (3,) the same where a clipped one ends,
        and that image; None if it depends on what is not read.
    """
    found, beyond = ImageFound(), ImageFound(outside=True)
    try:
        through = _shader_transmission(surface, found)
        outside = _shader_transmission(surface, beyond)
    except UnreadableError:
        return None
    if np.ndim(outside) > 1:
        outside = outside[0, 0]
    through = np.clip(through, 0.0, 1.0).astype(np.float32)
    picture = np.ascontiguousarray(through if through.ndim == 3 else through[None, None])
    return picture, np.clip(outside, 0.0, 1.0).astype(np.float32), found


def _shader_transmission(socket: Any, found: ImageFound) -> Any:
    """(3,) or (H, W, 3)."""
    output = source_of(socket)
    if output is None:
        return np.zeros(3)
    reader = _TRANSMISSION.get(output.node.bl_idname)
    return np.zeros(3) if reader is None else reader(output.node, found)


def _mixed(node: Any, found: ImageFound) -> Any:
    first, second = (_shader_transmission(node.inputs[i], found) for i in (1, 2))
    if np.array_equal(first, second):
        return first
    factor = np.asarray(np.clip(value_of(node.inputs[0], found), 0.0, 1.0))[..., None]
    return first * (1.0 - factor) + second * factor


def _added(node: Any, found: ImageFound) -> Any:
    return sum(_shader_transmission(node.inputs[i], found) for i in (0, 1))


def _group(node: Any, _found: ImageFound) -> Any:
    if node.node_tree is None or group_is_opaque(node.node_tree, set()):
        return np.zeros(3)
    raise UnreadableError(f"the node group '{node.node_tree.name}'")


def _transparent(node: Any, found: ImageFound) -> Any:
    return color_of(node.inputs["Color"], found)


def _principled(node: Any, found: ImageFound) -> Any:
    alpha = np.clip(value_of(node.inputs["Alpha"], found), 0.0, 1.0)
    return np.asarray(1.0 - alpha)[..., None] * np.ones(3)


_TRANSMISSION: dict[str, Callable[[Any, ImageFound], Any]] = {
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeMixShader": _mixed,
    "ShaderNodeAddShader": _added,
    "ShaderNodeGroup": _group,
    "ShaderNodeBsdfPrincipled": _principled,
}


def group_is_opaque(tree: Any, seen: set[int]) -> bool:
    """Whether no node of a group, or of groups in it, can let light pass straight through."""
    seen.add(tree.session_uid)
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfTransparent":
            return False
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            alpha = node.inputs["Alpha"]
            if alpha.is_linked or alpha.default_value <= 1.0 - CLEAR:
                return False
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner.session_uid not in seen and not group_is_opaque(inner, seen):
            return False
    return True
