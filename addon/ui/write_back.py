# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a light's controls into its node tree, for Cycles, and takes them out again.

What the controls let through (a colour for each place that is lit) is one node group, put before
the Color of every Emission node that the light has: there it multiplies whatever the artist put
there. Nothing else of the tree is touched, so that taking it out leaves the tree as it was.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from ..errors import InputError
from ..relight.filters.slide_picture import slide_picture
from ..scene.animation_reader import animation_curves
from ..scene.light_controls import LightControls
from ..scene.written_light import (
    COLOR,
    GROUP_MARK,
    OBJECT_MARK,
    before_controls,
    is_written_node,
    take_out,
)
from .moving_controls import moving_controls, with_moving
from .node_math import NodeMath, Scalar
from .write_back_filters import transmission

# Shaders that hand on what others emit.
_HANDING_ON = {"ShaderNodeAddShader", "ShaderNodeMixShader", "NodeReroute"}
# Of a slide's pixels in a digest, about.
_ROWS_TOLD = 64
_VISIBILITIES = ("visible_diffuse", "visible_glossy")


def write(data: Any, controls: LightControls) -> None:
    """Have Cycles show a light's controls, in place of any that were written before.

    Args:
        data: a `bpy.types.Light`.
        controls: as Relume shows them; neutral ones leave the light as the artist made it.

    Raises:
        InputError: see `require_writable`; the light is then as it was.
    """
    require_writable(data, controls)
    remove(data)
    if has_filters(data.type, controls):
        group = _group(data, controls)
        for emission in _emissions(data):
            _insert(data, emission, group)
    _hide(data, controls)


def require_writable(data: Any, controls: LightControls) -> None:
    """Refuse what `write` could not do; nothing is changed.

    Raises:
        InputError: the light cannot be edited, or its shader has no place for the controls.
    """
    if data.library is not None or not data.is_editable:
        raise InputError(
            f"light '{data.name}' is linked from another file; make it local, or write its "
            "controls there"
        )
    for emission in _emissions(data) if has_filters(data.type, controls) else []:
        color = emission.inputs["Color"]
        if not before_controls(color).is_linked and _is_animated(color):
            raise InputError(
                f"light '{data.name}' has an animated colour in its node '{emission.name}', which "
                "nodes before it would hide; animate a Color node that is linked to it instead"
            )


def has_filters(kind: str, controls: LightControls) -> bool:
    """Whether any of the controls becomes nodes on a light of this type."""
    return kind != "SUN" and controls.shapes_beam


def remove(data: Any) -> None:
    """Take out of a `bpy.types.Light`, and its objects, what was written into them."""
    for group in take_out(data.node_tree):
        if group.users == 0:
            _discard(group)
    for obj in _objects(data):
        for kind in str(obj.get(OBJECT_MARK, "")).split():
            setattr(obj, kind, True)
        if OBJECT_MARK in obj:
            del obj[OBJECT_MARK]


def is_written(data: Any) -> bool:
    """Whether a `bpy.types.Light` has controls written into it."""
    return _written_digest(data) is not None or any(OBJECT_MARK in obj for obj in _objects(data))


def is_current(data: Any, controls: LightControls) -> bool:
    """Whether Cycles shows these controls now, as far as it can."""
    wanted = _digest(data, controls) if has_filters(data.type, controls) else None
    hidden = _wanted_hidden(controls)
    objects = list(_objects(data))
    return _written_digest(data) == wanted and all(
        set(str(obj.get(OBJECT_MARK, "")).split()) == {k for k in hidden if _was_visible(obj, k)}
        for obj in objects
    )


def standing_still(data: Any, controls: LightControls) -> tuple[str, ...]:
    """The animated properties of a light's controls that do not move in Cycles, by their names."""
    _, rest = with_moving(controls, moving_controls(data), lambda _path, _index: 0.0)
    words = {path.removeprefix("relume.").replace("_", " ").replace(".", ", ") for path, _ in rest}
    return tuple(sorted(words))


def _digest(data: Any, controls: LightControls) -> str:
    """Digits that tell controls apart in what becomes nodes.

    Blockers follow their objects, and what is animated its curves.
    """
    moving = moving_controls(data)
    c, _ = with_moving(controls, moving, lambda _path, _index: 0.0)
    digest = hashlib.sha256(repr(sorted(moving)).encode())
    for part in (c.barn_doors, c.distance, c.falloff, c.noise):
        digest.update(repr(part).encode())
    if c.slide is not None:
        slide = c.slide
        digest.update(f"{slide.pixels.shape}".encode())
        # Panels ask at every drawing: some rows tell most edits of a picture.
        step = max(1, len(slide.pixels) // _ROWS_TOLD)
        digest.update(np.ascontiguousarray(slide.pixels[::step, ::step]))
        digest.update(repr(replace(slide, pixels=slide.pixels[:0])).encode())
    for blocker in c.blockers:
        digest.update(repr(replace(blocker, world_from_blocker=np.eye(4))).encode())
    return digest.hexdigest()[:16]


# Inside -----------------------------------------------------------------------------------


def _objects(data: Any) -> Iterator[Any]:
    return (obj for obj in bpy.data.objects if obj.data == data)


def _written_digest(data: Any) -> str | None:
    if data.node_tree is None:
        return None
    for node in data.node_tree.nodes:
        if is_written_node(node):
            return str(node.node_tree[GROUP_MARK])
    return None


def _emissions(data: Any) -> list[Any]:
    """The Emission nodes that the light's outputs show."""
    found: dict[str, Any] = {}
    tree = data.node_tree
    pending = [n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputLight"]
    seen = {node.name for node in pending}
    while pending:
        for socket in pending.pop().inputs:
            if socket.type != "SHADER" and socket.node.bl_idname != "NodeReroute":
                continue
            for link in socket.links:
                node = link.from_node
                if node.bl_idname == "ShaderNodeEmission":
                    found[node.name] = node
                elif node.bl_idname not in _HANDING_ON:
                    raise InputError(
                        f"light '{data.name}' shines through its node '{node.name}', which hides "
                        "what it emits; use Emission nodes in the light's own tree"
                    )
                elif node.name not in seen:
                    seen.add(node.name)
                    pending.append(node)
    return list(found.values())


def _group(data: Any, controls: LightControls) -> Any:
    group = bpy.data.node_groups.new(f"Relume Light: {data.name}", "ShaderNodeTree")
    group[GROUP_MARK] = _digest(data, controls)
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket(COLOR, in_out=in_out, socket_type="NodeSocketColor")
    nodes = NodeMath(group)
    before = nodes.node("NodeGroupInput")
    slide = controls.slide
    picture = None if slide is None else slide_picture(replace(slide, scale=(1.0, 1.0)))

    def driven(path: str, index: int) -> Scalar:
        is_number = isinstance(data.path_resolve(path), float)
        return nodes.driven(data, path if is_number else f"{path}[{index}]")

    live, _ = with_moving(controls, moving_controls(data), driven)
    through = transmission(nodes, live, picture)
    product = nodes.vector(before, COLOR) * through
    nodes.feed(nodes.node("NodeGroupOutput").inputs[COLOR], product)
    nodes.arrange()
    return group


def _insert(data: Any, emission: Any, group: Any) -> None:
    """Put the group before an Emission's colour."""
    tree = data.node_tree
    color = emission.inputs["Color"]
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree, node.parent = group, emission.parent
    node.location = (emission.location.x - 160.0, emission.location.y - 120.0)
    node.select = False
    if color.is_linked:
        tree.links.new(color.links[0].from_socket, node.inputs[COLOR])
    else:
        node.inputs[COLOR].default_value = color.default_value
    tree.links.new(node.outputs[COLOR], color)


def _is_animated(socket: Any) -> bool:
    path = socket.path_from_id("default_value")
    return any(curve.data_path == path for curve in animation_curves(socket.id_data))


def _discard(group: Any) -> None:
    """Remove a group, and pictures that were made for it alone."""
    images = [n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage"]
    bpy.data.node_groups.remove(group)
    for image in images:
        if image is not None and image.users == 0 and GROUP_MARK in image:
            bpy.data.images.remove(image)


def _wanted_hidden(controls: LightControls) -> list[str]:
    weights = (controls.diffuse, controls.specular)
    return [kind for kind, weight in zip(_VISIBILITIES, weights, strict=True) if weight == 0.0]


def _was_visible(obj: Any, kind: str) -> bool:
    return kind in str(obj.get(OBJECT_MARK, "")).split() or bool(getattr(obj, kind))


def _hide(data: Any, controls: LightControls) -> None:
    for obj in _objects(data):
        hidden = [kind for kind in _wanted_hidden(controls) if getattr(obj, kind)]
        for kind in hidden:
            setattr(obj, kind, False)
        if hidden:
            obj[OBJECT_MARK] = " ".join(hidden)
