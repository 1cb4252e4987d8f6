# SPDX-License-Identifier: GPL-3.0-or-later
"""Formulas as shader nodes: arithmetic on sockets adds the nodes that compute it.

What is known beforehand (Python numbers) is computed at once, so that only what varies over the
light becomes nodes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

# How far apart collapsed nodes, and frames, are placed in the editor, its units.
_COLUMN, _ROW, _BETWEEN_FRAMES = 180.0, 50.0, 120.0

# The least width of a smooth step, a rounding of what is about 1.
_STEEPEST = 1e-7

# A number, or a socket that gives one.
type Number = float | Scalar


class Scalar:
    """A number that nodes compute."""

    def __init__(self, nodes: NodeMath, socket: Any) -> None:
        self.nodes = nodes
        self.socket = socket

    def __add__(self, other: Number) -> Scalar:
        return self.nodes.math("ADD", self, other)

    def __radd__(self, other: float) -> Scalar:
        return self.nodes.math("ADD", other, self)

    def __sub__(self, other: Number) -> Scalar:
        return self.nodes.math("SUBTRACT", self, other)

    def __rsub__(self, other: float) -> Scalar:
        return self.nodes.math("SUBTRACT", other, self)

    def __mul__(self, other: Number) -> Scalar:
        return self.nodes.math("MULTIPLY", self, other)

    def __rmul__(self, other: float) -> Scalar:
        return self.nodes.math("MULTIPLY", self, other)

    def __truediv__(self, other: Number) -> Scalar:
        """0 where the divisor is 0, as Blender's Math node has it."""
        return self.nodes.math("DIVIDE", self, other)

    def __rtruediv__(self, other: float) -> Scalar:
        return self.nodes.math("DIVIDE", other, self)

    def __pow__(self, other: Number) -> Scalar:
        return self.nodes.math("POWER", self, other)

    def __neg__(self) -> Scalar:
        return self.nodes.math("MULTIPLY", self, -1.0)

    def __abs__(self) -> Scalar:
        return self.nodes.math("ABSOLUTE", self)

    def __lt__(self, other: Number) -> Scalar:
        """1 where it is less, else 0."""
        return self.nodes.math("LESS_THAN", self, other)

    def __gt__(self, other: Number) -> Scalar:
        """1 where it is greater, else 0."""
        return self.nodes.math("GREATER_THAN", self, other)


class Vector:
    """Three numbers that nodes compute."""

    def __init__(self, nodes: NodeMath, socket: Any) -> None:
        self.nodes = nodes
        self.socket = socket

    def __add__(self, other: Vector | tuple[float, float, float]) -> Vector:
        return self.nodes.vector_math("ADD", self, other)

    def __sub__(self, other: Vector | tuple[float, float, float]) -> Vector:
        return self.nodes.vector_math("SUBTRACT", self, other)

    def __mul__(self, other: Vector | tuple[float, float, float]) -> Vector:
        """Component by component."""
        return self.nodes.vector_math("MULTIPLY", self, other)

    def scaled(self, factor: Number) -> Vector:
        node = self.nodes.node("ShaderNodeVectorMath", operation="SCALE")
        self.nodes.feed(node.inputs["Vector"], self)
        self.nodes.feed(node.inputs["Scale"], factor)
        return Vector(self.nodes, node.outputs["Vector"])

    def dot(self, other: Vector | tuple[float, float, float]) -> Scalar:
        node = self.nodes.vector_math("DOT_PRODUCT", self, other).socket.node
        return Scalar(self.nodes, node.outputs[1])

    def cross(self, other: Vector) -> Vector:
        return self.nodes.vector_math("CROSS_PRODUCT", self, other)

    def normalized(self) -> Vector:
        return self.nodes.vector_math("NORMALIZE", self)

    def length(self) -> Scalar:
        node = self.nodes.vector_math("LENGTH", self).socket.node
        return Scalar(self.nodes, node.outputs[1])

    def parts(self) -> tuple[Scalar, Scalar, Scalar]:
        node = self.nodes.node("ShaderNodeSeparateXYZ")
        self.nodes.feed(node.inputs[0], self)
        x, y, z = (Scalar(self.nodes, socket) for socket in node.outputs)
        return x, y, z


class NodeMath:
    """Adds nodes to a shader node tree, in rows of what belongs together."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self._frame: Any = None
        self._nodes: list[Any] = []

    @contextmanager
    def framed(self, label: str) -> Iterator[None]:
        """What is added meanwhile stands in a frame of that name."""
        self._frame = self.tree.nodes.new("NodeFrame")
        self._frame.label = label
        self._frame.select = False
        try:
            yield
        finally:
            self._frame = None

    def node(self, kind: str, **settings: Any) -> Any:
        """A new node with these properties."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        node.parent, node.hide, node.select = self._frame, True, False
        self._nodes.append(node)
        return node

    def arrange(self) -> None:
        """Place the nodes: frames below each other, and in them what feeds a node left of it."""
        top, rows = 0.0, 0
        for number, node in enumerate(self._nodes):
            if number and node.parent != self._nodes[number - 1].parent:
                top -= rows * _ROW + _BETWEEN_FRAMES
            if not number or node.parent != self._nodes[number - 1].parent:
                columns: dict[str, int] = {}
                taken: dict[int, int] = {}
                rows = 0
            before = (link.from_node.name for socket in node.inputs for link in socket.links)
            column = 1 + max((columns.get(name, -1) for name in before), default=-1)
            columns[node.name] = column
            row = taken.get(column, 0)
            taken[column] = row + 1
            rows = max(rows, row + 1)
            node.location = (column * _COLUMN, top - row * _ROW)
            for socket in node.outputs:
                socket.hide = not socket.is_linked

    def feed(self, socket: Any, value: Any) -> None:
        """Let an input have a number, three of them, or what a socket gives."""
        if isinstance(value, Scalar | Vector):
            self.tree.links.new(value.socket, socket)
        else:
            socket.default_value = value

    def scalar(self, node: Any, name: str) -> Scalar:
        return Scalar(self, node.outputs[name])

    def vector(self, node: Any, name: str) -> Vector:
        return Vector(self, node.outputs[name])

    def math(self, operation: str, *values: Number) -> Scalar:
        node = self.node("ShaderNodeMath", operation=operation)
        for socket, value in zip(node.inputs, values, strict=False):
            self.feed(socket, value)
        return Scalar(self, node.outputs[0])

    def vector_math(self, operation: str, *values: Vector | tuple[float, float, float]) -> Vector:
        node = self.node("ShaderNodeVectorMath", operation=operation)
        for socket, value in zip(node.inputs, values, strict=False):
            self.feed(socket, value)
        # Outputs that an operation lacks are not found by name.
        return Vector(self, node.outputs[0])

    def combined(self, x: Number, y: Number, z: Number) -> Vector:
        node = self.node("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, (x, y, z), strict=True):
            self.feed(socket, value)
        return Vector(self, node.outputs[0])

    def maximum(self, a: Number, b: Number) -> Scalar:
        return self.math("MAXIMUM", a, b)

    def minimum(self, a: Number, b: Number) -> Scalar:
        return self.math("MINIMUM", a, b)

    def clamped(self, value: Scalar) -> Scalar:
        """Within [0, 1]."""
        return self.minimum(self.maximum(value, 0.0), 1.0)

    def smoothstep(self, low: Number, high: Number, value: Number) -> Scalar:
        """GLSL's; where high is no more than low, as steep a step as there can be."""
        width = self.maximum(high - low, _STEEPEST)
        t = self.clamped(self.math("DIVIDE", value - low, width))
        return t * t * (3.0 - 2.0 * t)

    def cosine_and_sine(self, angle: Number) -> tuple[Number, Number]:
        if isinstance(angle, Scalar):
            return self.math("COSINE", angle), self.math("SINE", angle)
        return math.cos(angle), math.sin(angle)

    def driven(self, target: bpy.types.ID, data_path: str) -> Scalar:
        """A number that follows a property of a data-block."""
        node = self.node("ShaderNodeValue")
        # Until it is evaluated.
        node.outputs[0].default_value = target.path_resolve(data_path)
        driver = node.outputs[0].driver_add("default_value").driver
        # The sum of one variable needs no Python, which files may not be allowed to run.
        driver.type = "SUM"
        variable = driver.variables.new()
        if isinstance(target, bpy.types.Light):
            variable.targets[0].id_type = "LIGHT"
        variable.targets[0].id = target
        variable.targets[0].data_path = data_path
        return Scalar(self, node.outputs[0])
