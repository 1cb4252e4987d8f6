# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials whose colour comes from one node, and what the analysis says of a material."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from addon.caching.specialize import specialized

from .material_grid import empty_material, node_in

# Says what to link in a material's tree: (tree, its output node).
Maker = Callable[[Any, Any], None]


def material_of(name: str, make: Maker) -> Any:
    """A material made by `make`."""
    material, surface = empty_material(name)
    make(material.node_tree, surface.node)
    return material


def shown(tree: Any, output: Any, value: Any) -> None:
    """A diffuse surface whose colour is the value."""
    node = node_in(tree, "ShaderNodeBsdfDiffuse")
    tree.links.new(value, node.inputs["Color"])
    tree.links.new(node.outputs[0], output.inputs["Surface"])


def effects_of(material: Any) -> list[str]:
    """What is approximated of a material, but not its name."""
    with specialized([material.name], 0) as (plan, _):
        assert all(item.material == material.name for item in plan.approximations)
        return [item.effect for item in plan.approximations]


def view_effects_of(material: Any) -> list[str]:
    """Those of them that are about the view."""
    return [effect for effect in effects_of(material) if "on the view (" in effect]


def new_group(name: str, **sockets: str) -> tuple[Any, Any, Any]:
    """A node group, its input node and its output node; `Factor_IN="Float"` is a socket."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for key, kind in sockets.items():
        label, _, direction = key.rpartition("_")
        tree.interface.new_socket(
            label,
            in_out="INPUT" if direction == "IN" else "OUTPUT",
            socket_type=f"NodeSocket{kind}",
        )
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def use_group(tree: Any, group: Any) -> Any:
    """A node of `tree` that is the group."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    return node
