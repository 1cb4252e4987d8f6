# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the plainest parts of node trees: what feeds an output, and constant inputs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def output_source(tree: Any, output_type: str) -> Any:
    """The node that feeds the Surface of the tree's output for Cycles; None if there is none."""
    outputs = [n for n in tree.nodes if n.bl_idname == output_type and n.target != "EEVEE"]
    # Cycles takes its own output before one for all engines, and the active one of several.
    outputs.sort(key=lambda n: (n.target == "CYCLES", n.is_active_output), reverse=True)
    return linked_node(outputs[0].inputs["Surface"]) if outputs else None


def source_of(socket: Any) -> Any:
    """The output that feeds an input, through reroutes and muted nodes; None if there is none."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted or not link.is_valid:
            return None
        node = link.from_node
        if node.bl_idname == "NodeReroute":
            socket = node.inputs[0]
        elif node.mute:
            through = [pair for pair in node.internal_links if pair.to_socket == link.from_socket]
            if not through:
                return None
            socket = through[0].from_socket
        else:
            return link.from_socket
    return None


def linked_node(socket: Any) -> Any:
    """The node that feeds an input, through reroutes and muted nodes; None if nothing does."""
    output = source_of(socket)
    return output.node if output is not None else None


def constant_value(socket: Any) -> float | None:
    """A number input's value, if it is the same everywhere; else None."""
    node = linked_node(socket)
    if node is None:
        return float(socket.default_value)
    if node.bl_idname == "ShaderNodeValue":
        return float(node.outputs[0].default_value)
    return None


def constant_color(socket: Any) -> NDArray[np.float64] | None:
    """(3,) a colour input's value, if it is the same everywhere; else None."""
    node = linked_node(socket)
    if node is None:
        return np.array(socket.default_value[:3], dtype=np.float64)
    if node.bl_idname == "ShaderNodeRGB":
        return np.array(node.outputs[0].default_value[:3], dtype=np.float64)
    return None
