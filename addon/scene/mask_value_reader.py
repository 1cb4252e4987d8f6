# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a material's nodes that are constants, or one image passed through Math nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from .node_reader import source_of

Extension = Literal["REPEAT", "EXTEND", "CLIP", "MIRROR"]

# Cycles' own bound.
_LEAST_IOR = 1e-5


class UnreadableError(Exception):
    """The alpha depends on a node that cannot be read as an image."""


@dataclass
class ImageFound:
    """The one image map that an alpha may depend on, and what else was met on the way.

    Attributes:
        image: the image; None as long as none was met.
        uv_map: the map that it is laid out by, "" for the active one.
        extension: what lies outside of it.
        tints: whether some of what lies behind is let through coloured.
        by_view: whether a factor depends on the view.
        adds: whether a surface is added to what lies behind.
        outside: read each image as it is outside of a clipped one.
    """

    image: Any = None
    uv_map: str = ""
    extension: Extension = "REPEAT"
    tints: bool = False
    by_view: bool = False
    adds: bool = False
    outside: bool = False


def value_of(socket: Any, found: ImageFound) -> Any:
    """A number input: a float, or (H, W) where it depends on an image.

    Raises:
        UnreadableError: it depends on something else.
    """
    output = source_of(socket)
    if output is None:
        return float(socket.default_value)
    node = output.node
    if node.bl_idname == "ShaderNodeValue":
        return float(node.outputs[0].default_value)
    if node.bl_idname == "ShaderNodeMath":
        operation = _MATH.get(node.operation)
        if operation is None:
            raise UnreadableError(f"a Math node set to {node.operation}")
        inputs = [value_of(node.inputs[i], found) for i in range(operation[0])]
        with np.errstate(divide="ignore", invalid="ignore"):
            result = np.nan_to_num(operation[1](*inputs), nan=0.0, posinf=0.0, neginf=0.0)
        return np.clip(result, 0.0, 1.0) if node.use_clamp else result
    if node.bl_idname == "ShaderNodeTexImage":
        return _image_channel(node, output.identifier, found)
    if node.bl_idname in {"ShaderNodeFresnel", "ShaderNodeLayerWeight"}:
        found.by_view = True
        return _straight_on(node, output.identifier, found)
    raise UnreadableError(f"the node '{node.name}'")


def _straight_on(node: Any, output: str, found: ImageFound) -> Any:
    """What depends on the view, where it looks at the surface straight on; the bake has it so."""
    if node.bl_idname == "ShaderNodeFresnel":
        ior = np.maximum(value_of(node.inputs["IOR"], found), _LEAST_IOR)
    elif output == "Facing":
        return 0.0
    else:
        # Cycles' Layer Weight: the IOR is 1 / (1 - blend).
        ior = 1.0 / np.maximum(1.0 - value_of(node.inputs["Blend"], found), _LEAST_IOR)
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


def color_of(socket: Any, found: ImageFound) -> Any:
    """A colour input, scene-linear: (3,), or (H, W, 3) where it is an image's colour.

    Raises:
        UnreadableError: it depends on something else.
    """
    output = source_of(socket)
    if output is None:
        return np.array(socket.default_value[:3], dtype=np.float64)
    node = output.node
    if node.bl_idname == "ShaderNodeRGB":
        return np.array(node.outputs[0].default_value[:3], dtype=np.float64)
    if output.type == "VALUE":
        return np.asarray(value_of(socket, found))[..., None] * np.ones(3)
    if node.bl_idname != "ShaderNodeTexImage":
        raise UnreadableError(f"the node '{node.name}'")
    pixels = _pixels(node, found)
    if pixels is None:
        return np.zeros(3)
    image = node.image
    has_alpha = pixels.shape[-1] == 4 and image.alpha_mode not in {"NONE", "CHANNEL_PACKED"}
    if has_alpha and (pixels[..., 3] < 1.0).any():
        # Which of associated and straight colours are interpolated is not told here.
        raise UnreadableError(f"the colour of the image '{image.name}', which has an alpha")
    color = pixels[..., : min(3, pixels.shape[-1])].astype(np.float64)
    color = color if color.shape[-1] == 3 else color[..., :1] * np.ones(3)
    if image.colorspace_settings.is_data or image.is_float:
        return color
    if image.colorspace_settings.name != "sRGB":
        raise UnreadableError(f"the colour space of the image '{image.name}'")
    # IEC 61966-2-1.
    low = color <= 0.04045
    return np.where(low, color / 12.92, ((np.maximum(color, 0.04045) + 0.055) / 1.055) ** 2.4)


def _image_channel(node: Any, output: str, found: ImageFound) -> NDArray[np.float32]:
    pixels = _pixels(node, found)
    if pixels is None:
        return np.zeros((1, 1), dtype=np.float32)
    image = node.image
    if output == "Alpha":
        if image.channels < 4 or image.alpha_mode == "NONE":
            return np.ones((1, 1), dtype=np.float32)
        return pixels[..., 3].copy()
    if image.colorspace_settings.is_data:
        return pixels[..., : min(3, image.channels)].mean(axis=-1, dtype=np.float32)
    raise UnreadableError(f"the colour of the image '{image.name}'")


def _pixels(node: Any, found: ImageFound) -> NDArray[np.float32] | None:
    """(H, W, C) of the image that a node shows, as it is stored; None for none, which is black and
    clear."""
    image = node.image
    if image is None or (not image.has_data and image.size[0] == 0):
        return None
    if node.projection != "FLAT":
        raise UnreadableError(f"the {node.projection.lower()}-projected image '{image.name}'")
    if image.source not in {"FILE", "GENERATED"}:
        raise UnreadableError(f"the image '{image.name}', whose source is {image.source.lower()}")
    if found.image not in (None, image):
        raise UnreadableError("more than one image")
    found.uv_map = _uv_map(node)
    found.image = image
    found.extension = cast("Extension", node.extension)
    if found.outside:
        return None
    width, height = image.size
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)


def _uv_map(node: Any) -> str:
    output = source_of(node.inputs["Vector"])
    if output is None:
        return ""
    if output.node.bl_idname == "ShaderNodeUVMap" and not output.node.from_instancer:
        return str(output.node.uv_map)
    if output.node.bl_idname == "ShaderNodeTexCoord" and output.name == "UV":
        return ""
    raise UnreadableError(f"the texture coordinates made by the node '{output.node.name}'")
