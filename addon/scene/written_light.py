# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light carries of its controls for Cycles, and how to see the light without it.

The controls are written into a light as one node group before the colour of each of its Emission
nodes, and as ray visibility of its objects (addon/ui/write_back.py). Relume applies controls
itself: whoever reads a light for Relume takes it as it was before.
"""

from __future__ import annotations

from typing import Any

from .node_reader import linked_node

# A custom property of the node group: the digest of what it was written from.
GROUP_MARK = "relume_light_controls"
# A custom property of a light's object: the ray visibilities that were switched off, with spaces.
OBJECT_MARK = "relume_light_controls"
# The group's only input, and output.
COLOR = "Color"


def is_written_node(node: Any) -> bool:
    """Whether a `bpy.types.Node` has a light's controls written by Relume."""
    group = getattr(node, "node_tree", None)
    return node.bl_idname == "ShaderNodeGroup" and group is not None and GROUP_MARK in group


def is_visible(obj: Any, kind: str) -> bool:
    """A light object's `visible_diffuse` or `visible_glossy` as the artist has it."""
    if kind in str(obj.get(OBJECT_MARK, "")).split():
        return True
    return bool(getattr(obj, kind))


def before_controls(socket: Any) -> Any:
    """An Emission's colour input, or the group's that was put before it."""
    node = linked_node(socket)
    return node.inputs[COLOR] if node is not None and is_written_node(node) else socket


def take_out(tree: Any) -> set[Any]:
    """Takes what was written out of a light's node tree; gives the groups that it was.

    Args:
        tree: a `bpy.types.NodeTree`, or None.
    """
    groups = set()
    for node in [n for n in tree.nodes if is_written_node(n)] if tree is not None else []:
        groups.add(node.node_tree)
        before = node.inputs[COLOR]
        for link in list(node.outputs[COLOR].links):
            after = link.to_socket
            tree.links.remove(link)
            if before.is_linked:
                tree.links.new(before.links[0].from_socket, after)
            else:
                # An artist may have changed it meanwhile.
                after.default_value = before.default_value
        tree.nodes.remove(node)
    return groups
