# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds values in node trees that change with the viewer's place.

A value cached from a caching camera is wrong for every other view where it depends on the
view. Nodes whose dependence the lobes represent are left out by the caller; all others are
named.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

from ..scene.node_use import used_nodes

# Node type -> outputs that depend on the view; None for all of them. A Light Path node's other
# outputs tell the kinds of ray apart: caching cameras and the view's camera agree on those.
_VIEW_DEPENDENT: dict[str, frozenset[str] | None] = {
    "ShaderNodeFresnel": None,
    "ShaderNodeLayerWeight": None,
    "ShaderNodeCameraData": None,
    "ShaderNodeLightPath": frozenset({"Ray Length"}),
    "ShaderNodeNewGeometry": frozenset({"Incoming"}),
    "ShaderNodeTexCoord": frozenset({"Camera", "Window", "Reflection"}),
}


def view_dependent_effects(tree: Any, exact: Collection[int]) -> Iterator[str]:
    """A sentence for each node in use, groups included, whose value is frozen by the cache.

    Args:
        tree: a shader node tree.
        exact: pointers of nodes that are represented without freezing them.
    """
    seen: set[int] = set()
    pending = [tree]
    while pending:
        current = pending.pop()
        if current is None or current.session_uid in seen:
            continue
        seen.add(current.session_uid)
        for node in used_nodes(current):
            pending.append(getattr(node, "node_tree", None))
            outputs = _used_view_outputs(node)
            if outputs and node.as_pointer() not in exact:
                yield (
                    f"the {node.bl_label} node '{node.name}' depends on the view "
                    f"({', '.join(outputs)}); its value is kept as the caching camera saw it"
                )


def _used_view_outputs(node: Any) -> list[str]:
    if node.mute or node.bl_idname not in _VIEW_DEPENDENT:
        return []
    names = _VIEW_DEPENDENT[node.bl_idname]
    return [
        output.name
        for output in node.outputs
        if output.is_linked and (names is None or output.name in names)
    ]
