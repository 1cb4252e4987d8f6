# SPDX-License-Identifier: GPL-3.0-or-later
"""Which nodes of a tree have a say in what it shows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

_OUTPUTS = {
    "ShaderNodeOutputMaterial",
    "ShaderNodeOutputWorld",
    "ShaderNodeOutputLight",
    "NodeGroupOutput",
}


def used_nodes(tree: Any) -> list[Any]:
    """The nodes that an output node of `tree`, a `bpy.types.NodeTree`, depends on, in its order.

    Nodes that are linked to nothing, and chains that end nowhere, are left out. Groups are
    given as one node.
    """
    feeding: dict[str, set[str]] = defaultdict(set)
    for link in tree.links:
        if not link.is_muted:
            feeding[link.to_node.name].add(link.from_node.name)
    pending = [node.name for node in tree.nodes if node.bl_idname in _OUTPUTS]
    used = set(pending)
    while pending:
        new = feeding[pending.pop()] - used
        used |= new
        pending.extend(new)
    return [node for node in tree.nodes if node.name in used]


def nodes_within(tree: Any, seen: set[int] | None = None) -> Iterator[Any]:
    """The nodes that have a say in what a tree shows, those of its groups included, each group's
    once; `seen` holds the trees to leave out."""
    seen = set() if seen is None else seen
    if tree.session_uid in seen:
        return
    seen.add(tree.session_uid)
    for node in used_nodes(tree):
        yield node
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            yield from nodes_within(inner, seen)
