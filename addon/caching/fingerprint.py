# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints of what a cache depends on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ..scene.geometry import SceneGeometry
from ..scene.node_use import nodes_within
from ..scene.tree_lines_reader import tree_lines
from .material_model import material_model
from .scene_state import SceneState
from .surfaces import MaterialState, Surfaces, object_states, short_digest

# Nodes whose value depends on the shapes about the shaded place.
_FEEL_NEAR = {"ShaderNodeBevel", "ShaderNodeAmbientOcclusion", "ShaderNodeRaycast"}


def scene_fingerprint(geometry: SceneGeometry, frame: int | None = None) -> str:
    """64 hexadecimal digits for the open file's geometry and the materials that it uses.

    `frame` is that at which the geometry was read; None for the open scene's.
    """
    return read_state(geometry, frame).fingerprint


def read_state(
    geometry: SceneGeometry, frame: int | None = None, depsgraph: Any = None
) -> SceneState:
    """The states of the open file's objects and of the materials that they use.

    Args:
        geometry: as it was read.
        frame: as in `scene_fingerprint`.
        depsgraph: at whose frame materials are read; None for the open scene's own.
    """
    if frame is None:
        frame = int(bpy.context.scene.frame_current)
    materials = {
        material.name_full: material if depsgraph is None else material.evaluated_get(depsgraph)
        for material in bpy.data.materials
    }
    states = object_states(geometry)
    sheer = {geometry.material_names[each.material_id] for each in geometry.sheers}
    surfaces = Surfaces(
        {state.digest: state for state in states},
        {
            name: _material_state(materials.get(name), frame, is_sheer=name in sheer)
            for name in sorted(set(geometry.material_names))
        },
    )
    return SceneState(frame, geometry, states, surfaces)


def _material_state(material: Any, frame: int, *, is_sheer: bool) -> MaterialState:
    if material is None:
        return MaterialState(short_digest("none"))
    model = material_model(material)
    lines = [f"{material.pass_index} {tuple(material.diffuse_color)} {model}\n"]
    # What is baked as a layer is another picture than a cut-out.
    lines += ["sheer\n"] * is_sheer
    feels_near = False
    if material.node_tree is not None:
        lines += tree_lines(material.node_tree)
        for node in nodes_within(material.node_tree):
            feels_near |= node.bl_idname in _FEEL_NEAR
            lines += _frame_lines(node, frame)
    return MaterialState(short_digest(*lines), feels_near)


def _frame_lines(node: Any, frame: int) -> Iterator[str]:
    """What a node takes from the frame by itself; drivers and keyed values are in the sockets.

    An age of particles, or what is read of the scene by name, may be another at any frame.
    """
    kind, of_scene = node.bl_idname, getattr(node, "attribute_type", "") == "VIEW_LAYER"
    if kind == "ShaderNodeParticleInfo" or (kind == "ShaderNodeAttribute" and of_scene):
        yield f"{node.name} at {frame}\n"
    image, user = getattr(node, "image", None), getattr(node, "image_user", None)
    if image is not None and user is not None and image.source in {"SEQUENCE", "MOVIE"}:
        shown = _shown_picture(user, frame) if user.use_auto_refresh else user.frame_current
        yield f"{node.name} picture {shown}\n"


def _shown_picture(user: Any, frame: int) -> int:
    """Which picture of a sequence is shown, as Blender counts (`BKE_image_user_frame_get`)."""
    count = int(user.frame_duration)
    number = frame - int(user.frame_start) + 1
    number = (number - 1) % count + 1 if user.use_cyclic else min(max(number, 0), count)
    return number + int(user.frame_offset)
