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


def linked_node(socket: Any) -> Any:
    """The node that feeds an input, through reroutes; None if nothing does."""
    link = _link(socket)
    while link is not None and link.from_node.bl_idname == "NodeReroute":
        link = _link(link.from_node.inputs[0])
    return link.from_node if link is not None else None


def constant_value(socket: Any) -> float | None:
    """A number input's value, if it is the same everywhere; else None."""
    node = linked_node(socket)
    if node is None:
        return float(socket.default_value)
    if node.bl_idname == "ShaderNodeValue" and not node.mute:
        return float(node.outputs[0].default_value)
    return None


def constant_color(socket: Any) -> NDArray[np.float64] | None:
    """(3,) a colour input's value, if it is the same everywhere; else None."""
    node = linked_node(socket)
    if node is None:
        return np.array(socket.default_value[:3], dtype=np.float64)
    if node.bl_idname == "ShaderNodeRGB" and not node.mute:
        return np.array(node.outputs[0].default_value[:3], dtype=np.float64)
    return None


def _link(socket: Any) -> Any:
    return next((link for link in socket.links if link.is_valid and not link.is_muted), None)
