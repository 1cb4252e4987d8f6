# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows links through a material's node tree and its groups, as Cycles does.

Values stay in the tree that they are made in; an expression that is needed on the other side
of a group's boundary is carried there by a new interface socket. Only copies of trees are
changed: a group is replaced by a copy of its own before anything is added to it.
"""

from __future__ import annotations

from typing import Any

from ..scene.node_reader import source_of
from .specialize_expression import (
    Constant,
    Expression,
    ExpressionBuilder,
    Socket,
    find_socket,
    is_zero,
)
from .specialize_lobes import Lobes

_SINGLE_TYPES = {"VALUE", "INT", "BOOLEAN"}


def components_of(socket: Any) -> int:
    """How many values a node socket carries."""
    return 1 if socket.type in _SINGLE_TYPES else 3


def default_value(socket: Any) -> Constant:
    """The value of an unlinked input."""
    value: Any = getattr(socket, "default_value", 0.0)
    if components_of(socket) == 1:
        return Constant((float(value),))
    return Constant(tuple(float(x) for x in value[:3]))


class TreeContext:
    """One node tree of a material copy: the material's own, or a group inside it.

    Attributes:
        tree: the node tree; free to be changed.
        build: makes expressions in it.
        parent, group_node: where the group stands; None for the material's own tree.
        children: the groups that were entered, by the name of their node.
    """

    def __init__(
        self,
        tree: Any,
        copies: list[Any],
        parent: TreeContext | None = None,
        group_node: Any = None,
    ) -> None:
        self.tree = tree
        self.build = ExpressionBuilder(tree)
        self.parent = parent
        self.group_node = group_node
        self.children: dict[str, TreeContext] = {}
        self._copies = copies
        # Expressions of the other side of the boundary, by those of this tree, and back.
        self._exported: dict[Socket, Socket] = {}
        self._fetched: dict[Socket, Socket] = {}

    def enter(self, node: Any) -> TreeContext:
        """The inside of a group node, made this material's own on the first call."""
        if node.name not in self.children:
            node.node_tree = node.node_tree.copy()
            node.node_tree.use_fake_user = False
            self._copies.append(node.node_tree)
            self.children[node.name] = TreeContext(node.node_tree, self._copies, self, node)
        return self.children[node.name]

    def value(self, socket: Any) -> Expression:
        """What an input receives, with as many components as the input takes."""
        source = source_of(socket)
        if source is None:
            return default_value(self._last_unlinked(socket))
        return self.output(source, components_of(socket))

    def output(self, source: Any, components: int) -> Expression:
        """What an output gives to an input of so many components."""
        node = source.node
        if node.bl_idname in {"ShaderNodeValue", "ShaderNodeRGB"}:
            return self.build.convert(default_value(source), components, source.type)
        if node.bl_idname == "NodeGroupInput" and self.parent is not None:
            outside = find_socket(self.group_node.inputs, source.identifier)
            expression = self.parent.value(outside)
            if isinstance(expression, Constant):
                return self.build.convert(expression, components, source.type)
        expression = Socket(node, source.identifier, components_of(source))
        return self.build.convert(expression, components, source.type)

    def is_linked(self, socket: Any) -> bool:
        """Whether a value comes in from another node, here or outside the group."""
        source = source_of(socket)
        if source is None:
            return False
        if source.node.bl_idname == "NodeGroupInput" and self.parent is not None:
            return self.parent.is_linked(find_socket(self.group_node.inputs, source.identifier))
        return True

    def normal(self, socket: Any) -> Expression | None:
        """What an input for a normal receives, None for the surface's own.

        Cycles takes the value of a group's input for one where nothing is linked from outside,
        unless that value is hidden or zero.
        """
        context, end = self, socket
        source = source_of(socket)
        while source is not None:
            if source.node.bl_idname != "NodeGroupInput" or context.parent is None:
                return self.value(socket)
            end = find_socket(context.group_node.inputs, source.identifier)
            context, source = context.parent, source_of(end)
        value = default_value(end)
        if context is self or end.hide_value or is_zero(value):
            return None
        return self.build.normalize(value)

    def origin(self, socket: Any) -> tuple[TreeContext, Any] | None:
        """The node output that a value comes from, followed out of (not into) groups."""
        source = source_of(socket)
        if source is None:
            return None
        if source.node.bl_idname == "NodeGroupInput" and self.parent is not None:
            return self.parent.origin(find_socket(self.group_node.inputs, source.identifier))
        return self, source

    def export(self, lobes: Lobes) -> Lobes:
        """Lobes of this group, for the tree that the group stands in."""
        return lobes.map(self._export)

    def fetch(self, lobes: Lobes) -> Lobes:
        """Lobes of the tree that this group stands in, for use inside the group."""
        return lobes.map(self._fetch)

    def _export(self, expression: Expression) -> Expression:
        if isinstance(expression, Constant):
            return expression
        if expression not in self._exported:
            socket = self._interface_socket("OUTPUT", expression.components)
            output = group_output(self.tree)
            self.tree.links.new(expression.output, find_socket(output.inputs, socket.identifier))
            self._exported[expression] = Socket(
                self.group_node, socket.identifier, expression.components
            )
        return self._exported[expression]

    def _fetch(self, expression: Expression) -> Expression:
        if isinstance(expression, Constant):
            return expression
        assert self.parent is not None
        if expression not in self._fetched:
            socket = self._interface_socket("INPUT", expression.components)
            self.parent.tree.links.new(
                expression.output, find_socket(self.group_node.inputs, socket.identifier)
            )
            inside = self.tree.nodes.new("NodeGroupInput")
            self._fetched[expression] = Socket(inside, socket.identifier, expression.components)
        return self._fetched[expression]

    def _interface_socket(self, direction: str, components: int) -> Any:
        kind = "NodeSocketFloat" if components == 1 else "NodeSocketVector"
        return self.tree.interface.new_socket("relume", in_out=direction, socket_type=kind)

    @staticmethod
    def _last_unlinked(socket: Any) -> Any:
        """The input at the end of a chain of reroutes and muted nodes, whose value counts."""
        while socket.is_linked:
            link = socket.links[0]
            node = link.from_node
            if link.is_muted or not node.mute or node.bl_idname == "NodeReroute":
                return socket
            through = [pair for pair in node.internal_links if pair.to_socket == link.from_socket]
            if not through:
                return socket
            socket = through[0].from_socket
        return socket


def group_output(tree: Any) -> Any:
    """The group's active output node, or None."""
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next((node for node in outputs if node.is_active_output), None)
