# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's nodes emit: a constant, or what has to be measured and when it was.

A constant is read off the tree. Everything else Cycles itself evaluates, once for each state of
the nodes (light_profile_reader.py); what it found is kept here by a key of all that it depends on,
so that edits of the light's other attributes cost nothing.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .light import Light
from .light_profile import LightProfile
from .node_reader import constant_color, constant_value, output_source
from .node_use import nodes_within
from .tree_lines_reader import tree_lines
from .written_light import before_controls

# Tables are some megabytes each; this many states of nodes are remembered, and each light's last
# one however many lights there are.
_MOST_KEPT = 64

# Nodes, and outputs of nodes, that depend on where in the world the light is or how it is turned.
_OF_WORLD = {
    "ShaderNodeNewGeometry": {"Position", "Normal", "True Normal", "Incoming", "Tangent"},
    "ShaderNodeTexCoord": {"Camera", "Window", "Reflection"},
    "ShaderNodeVectorTransform": {"Vector"},
    "ShaderNodeCameraData": {"View Vector", "View Z Depth", "View Distance"},
    "ShaderNodeObjectInfo": {"Location"},
}
# Those that depend on the place on an area light or in a spot's cone.
_OF_EXTENT = {
    "ShaderNodeTexCoord": {"UV", "Generated", "Object"},
    "ShaderNodeNewGeometry": {"Position", "Parametric"},
    "ShaderNodeUVMap": {"UV"},
}
# And those that depend on the direction of what is lit.
_OF_DIRECTION = {
    "ShaderNodeNewGeometry": {"Incoming", "Backfacing"},
    "ShaderNodeTexCoord": {"Camera", "Window", "Reflection"},
    "ShaderNodeCameraData": {"View Vector", "View Z Depth", "View Distance"},
    "ShaderNodeTexIES": {"Factor"},
    "ShaderNodeLayerWeight": {"Fresnel", "Facing"},
    "ShaderNodeFresnel": {"Factor"},
}
# Textures take their place from there when nothing is linked to them.
_TEXTURES = {
    "ShaderNodeTexBrick", "ShaderNodeTexChecker", "ShaderNodeTexGabor", "ShaderNodeTexGradient",
    "ShaderNodeTexImage", "ShaderNodeTexMagic", "ShaderNodeTexNoise", "ShaderNodeTexVoronoi",
    "ShaderNodeTexWave", "ShaderNodeTexWhiteNoise",
}  # fmt: skip
# What says how far the lit place is.
_OF_DISTANCE = {"ShaderNodeLightFalloff", "ShaderNodeLightPath"}


@dataclass(frozen=True)
class MeasuredNodes:
    """What Cycles makes of a light's nodes.

    Attributes:
        color: (3,) float64: what the light's power is multiplied with.
        profile: and this, where that is not all.
        problems: a phrase for each thing that neither tells.
    """

    color: NDArray[np.float64]
    profile: LightProfile | None = None
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class UnmeasuredLight:
    """A light whose nodes wait to be measured.

    Attributes:
        key: as of `measuring_key`.
        data: the original `bpy.types.Light`.
        light: as it was read.
    """

    key: str
    data: Any
    light: Light


_known: OrderedDict[str, MeasuredNodes] = OrderedDict()
# By the lights' names, the key that was measured last.
_latest: dict[str, str] = {}


def remember(key: str, name: str, measured: MeasuredNodes) -> None:
    """Keep what was measured of the light of a name under its key."""
    _known[key] = measured
    _known.move_to_end(key)
    _latest[name] = key
    needed = set(_latest.values())
    past = [old for old in _known if old not in needed]
    for old in past[: max(len(_known) - _MOST_KEPT, 0)]:
        del _known[old]


def measured_before(name: str) -> MeasuredNodes | None:
    """What was measured last of the light of a name; None if nothing is left of it."""
    return _known.get(_latest.get(name, ""))


def forget_names() -> None:
    """Another file was opened, whose lights may have the same names."""
    _latest.clear()


def known(key: str) -> MeasuredNodes | None:
    """What was measured under a key; None if nothing was."""
    return _known.get(key)


def constant_emission(data: Any) -> NDArray[np.float64] | None:
    """(3,) what the nodes of a `bpy.types.Light` multiply its power with; None if they vary."""
    if not _has_nodes(data):
        return np.ones(3)
    node = output_source(data.node_tree, "ShaderNodeOutputLight")
    if node is None:
        return np.zeros(3)
    if node.bl_idname != "ShaderNodeEmission":
        return None
    color = constant_color(before_controls(node.inputs["Color"]))
    strength = constant_value(node.inputs["Strength"])
    return None if color is None or strength is None else color * strength


def _has_nodes(data: Any) -> bool:
    return data.node_tree is not None and bool(data.use_nodes)


def measuring_key(data: Any, light: Light) -> str:
    """Digits of all that the emission of a light with varying nodes depends on.

    Args:
        data: the evaluated `bpy.types.Light`.
        light: as it was read, without its nodes.
    """
    digest = hashlib.sha256(light.type.encode())
    for line in tree_lines(data.node_tree):
        digest.update(line.encode())
    nodes = list(nodes_within(data.node_tree))
    for node in nodes:
        image, user = getattr(node, "image", None), getattr(node, "image_user", None)
        if image is not None and user is not None and image.source in {"SEQUENCE", "MOVIE"}:
            digest.update(f"{node.name} {user.frame_current}".encode())
    matrix = light.world_from_light if of_world(nodes) else stretch(light)
    # Matrices that are turned differ in their last bits, and in the sign of their zeros.
    digest.update((np.round(matrix, 5) + 0.0).tobytes())
    digest.update(repr(framing(light)).encode())
    if light.type in ("SPOT", "AREA") and of_extent(nodes):
        digest.update(repr((light.spot_size, light.shape, light.size, light.size_y)).encode())
    return digest.hexdigest()


def of_world(nodes: list[Any]) -> bool:
    """Whether emission depends on how the light is placed in the world."""
    relative = any(getattr(n, "object", None) is not None for n in nodes)
    return relative or any(_uses(node, _OF_WORLD) for node in nodes)


def of_extent(nodes: list[Any]) -> bool:
    """Whether emission depends on the place on the light."""
    return any(_uses(node, _OF_EXTENT) or _is_unplaced(node) for node in nodes)


def of_direction(nodes: list[Any]) -> bool:
    """Whether an area light's emission at one of its places depends on the direction."""
    return any(_uses(node, _OF_DIRECTION) for node in nodes)


def is_fine(nodes: list[Any]) -> bool:
    """Whether emission may vary within small angles, as pictures and textures do."""
    return any(node.bl_idname in _TEXTURES for node in nodes)


def of_distance(nodes: list[Any]) -> bool:
    """Whether emission may depend on the distance of what is lit."""
    return any(node.bl_idname in _OF_DISTANCE for node in nodes)


def _uses(node: Any, outputs: dict[str, set[str]]) -> bool:
    names = outputs.get(node.bl_idname, set())
    return any(socket.is_linked and socket.name in names for socket in node.outputs)


def _is_unplaced(node: Any) -> bool:
    vector = node.inputs.get("Vector") if node.bl_idname in _TEXTURES else None
    return vector is not None and not vector.is_linked


def stretch(light: Light) -> NDArray[np.float64]:
    """(4, 4) the light's scale, shear and mirroring, in light space."""
    matrix = np.eye(4)
    matrix[:3, :3] = light.axes @ light.world_from_light[:3, :3]
    return matrix


# A picture across the beam is no wider: there its texels would lie 2.6 times closer in the middle
# than at its edge than those of a picture all around.
_WIDEST = 1.6


def framing(light: Light) -> float:
    """Half the width of the picture across a spot's beam that shows all of its cone, at one
    metre; 0 where a picture all around the light is better.

    In steps of a half stop, so that a change of the cone mostly leaves it as it is.
    """
    if light.type != "SPOT" or light.spot_size >= np.pi:
        return 0.0
    around = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    tangent = np.tan(0.5 * light.spot_size)
    cone = np.stack([tangent * np.cos(around), tangent * np.sin(around), -np.ones(64)])
    x, y, z = stretch(light)[:3, :3] @ cone
    if (z >= 0.0).any():
        return 0.0
    reach = float(np.abs(np.stack([x, y]) / z).max())
    if not 1e-6 < reach < _WIDEST:
        return 0.0
    return float(2.0 ** (0.5 * np.ceil(2.0 * np.log2(reach * 1.02))))
