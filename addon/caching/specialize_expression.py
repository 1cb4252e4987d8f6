# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader expressions: constants are folded here, the rest becomes nodes in a tree.

An expression is a `Constant` or a `Socket`. The builder's operations fold what is constant
and emit Math and Vector Math nodes for what is not, so a plain material adds no nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

# Rec.709 luma, with which Blender turns a colour into a value.
_LUMA = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True)
class Constant:
    """One value or three."""

    values: tuple[float, ...]

    @property
    def components(self) -> int:
        return len(self.values)


@dataclass(frozen=True)
class Socket:
    """An output of a node, kept by identifier because sockets move when a tree is updated."""

    node: Any
    identifier: str
    components: int

    @property
    def output(self) -> Any:
        """The node socket itself."""
        return find_socket(self.node.outputs, self.identifier)


Expression = Constant | Socket

ZERO = Constant((0.0,))
ONE = Constant((1.0,))
BLACK = Constant((0.0, 0.0, 0.0))


def find_socket(sockets: Any, identifier: str) -> Any:
    """The socket of a node's inputs or outputs that has this identifier."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def is_zero(expression: Expression) -> bool:
    """Whether it is the constant 0 in every component."""
    return isinstance(expression, Constant) and not any(expression.values)


def is_constant(expression: Expression, value: float) -> bool:
    """Whether it is this constant in every component."""
    return isinstance(expression, Constant) and all(x == value for x in expression.values)


class ExpressionBuilder:
    """Makes expressions in one node tree; the same operation on the same operands, once."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self._made: dict[tuple[str, Expression, Expression | None], Socket] = {}

    def add(self, a: Expression, b: Expression) -> Expression:
        if is_zero(a) and b.components >= a.components:
            return b
        if is_zero(b) and a.components >= b.components:
            return a
        return self._apply("ADD", lambda x, y: x + y, a, b)

    def subtract(self, a: Expression, b: Expression) -> Expression:
        if is_zero(b) and a.components >= b.components:
            return a
        return self._apply("SUBTRACT", lambda x, y: x - y, a, b)

    def multiply(self, a: Expression, b: Expression) -> Expression:
        components = max(a.components, b.components)
        if is_zero(a) or is_zero(b):
            return Constant((0.0,) * components)
        if is_constant(a, 1.0) and b.components >= a.components:
            return b
        if is_constant(b, 1.0) and a.components >= b.components:
            return a
        return self._apply("MULTIPLY", lambda x, y: x * y, a, b)

    def divide(self, a: Expression, b: Expression) -> Expression:
        """A / b, and 0 where b is 0, as Blender's nodes have it."""
        if is_constant(b, 1.0) and a.components >= b.components:
            return a
        return self._apply("DIVIDE", lambda x, y: x / y if y else 0.0, a, b)

    def minimum(self, a: Expression, b: Expression) -> Expression:
        return self._apply("MINIMUM", min, a, b)

    def maximum(self, a: Expression, b: Expression) -> Expression:
        return self._apply("MAXIMUM", max, a, b)

    def clamp(self, a: Expression) -> Expression:
        """Into [0, 1]."""
        return self.minimum(self.maximum(a, ZERO), ONE)

    def complement(self, a: Expression) -> Expression:
        """1 - a."""
        return self.subtract(ONE, a)

    def mix(self, a: Expression, b: Expression, factor: Expression) -> Expression:
        """A (1 - factor) + b factor: exact at both ends."""
        return self.add(self.multiply(a, self.complement(factor)), self.multiply(b, factor))

    def greater(self, a: Expression, threshold: float) -> Expression:
        """1 where the value a > threshold, else 0."""
        return self._apply(
            "GREATER_THAN", lambda x, y: float(x > y), self._scalar(a), Constant((threshold,))
        )

    def at_least(self, a: Expression, threshold: float) -> Expression:
        """1 where the value a >= threshold, else 0."""
        below = self._apply(
            "LESS_THAN", lambda x, y: float(x < y), self._scalar(a), Constant((threshold,))
        )
        return self.complement(below)

    def power(self, a: Expression, b: Expression) -> Expression:
        """A to the power of b, for a >= 0 and b > 0."""
        return self._apply("POWER", lambda x, y: x**y, a, b)

    def normalize(self, a: Expression) -> Expression:
        """A at unit length; the zero vector for none."""
        if isinstance(a, Constant):
            size = math.hypot(*a.values)
            return Constant(tuple(x / size if size else 0.0 for x in a.values))
        return self._made_once("ShaderNodeVectorMath", "NORMALIZE", "Vector", a, ZERO)

    def mean(self, a: Expression) -> Expression:
        """The mean of the components."""
        if a.components == 1:
            return a
        if isinstance(a, Constant):
            return Constant((math.fsum(a.values) / 3.0,))
        third = Constant((1.0 / 3.0,) * 3)
        return self._made_once("ShaderNodeVectorMath", "DOT_PRODUCT", "Value", a, third)

    def largest(self, a: Expression) -> Expression:
        """The largest of the components."""
        if a.components == 1:
            return a
        if isinstance(a, Constant):
            return Constant((max(a.values),))
        key = ("largest", a, None)
        if key not in self._made:
            split = self.tree.nodes.new("ShaderNodeSeparateXYZ")
            self._feed(split.inputs[0], a)
            x, y, z = (Socket(split, socket.identifier, 1) for socket in split.outputs)
            largest = self.maximum(self.maximum(x, y), z)
            assert isinstance(largest, Socket)
            self._made[key] = largest
        return self._made[key]

    def convert(self, a: Expression, components: int, source_type: str) -> Expression:
        """What a link from a socket of `source_type` ('RGBA', 'VECTOR', …) makes of a value."""
        if a.components == components:
            return a
        if components == 3:
            if isinstance(a, Constant):
                return Constant(a.values * 3)
            return Socket(a.node, a.identifier, 3)
        if isinstance(a, Constant):
            weights = _LUMA if source_type == "RGBA" else (1.0 / 3.0,) * 3
            return Constant((math.sumprod(a.values, weights),))
        # A Math node's input makes the same conversion as the input that was linked.
        return self._made_once("ShaderNodeMath", "ADD", "Value", a, ZERO)

    def assign(self, socket: Any, a: Expression) -> None:
        """Link, or set, an input of a node of this tree."""
        self._feed(socket, a)

    def _scalar(self, a: Expression) -> Expression:
        if a.components != 1:
            raise ValueError("a comparison takes single values")
        return a

    def _apply(
        self, operation: str, fold: Callable[[float, float], float], a: Expression, b: Expression
    ) -> Expression:
        components = max(a.components, b.components)
        if isinstance(a, Constant) and isinstance(b, Constant):
            left, right = (_spread(x.values, components) for x in (a, b))
            return Constant(tuple(fold(x, y) for x, y in zip(left, right, strict=True)))
        if components == 1:
            return self._made_once("ShaderNodeMath", operation, "Value", a, b)
        return self._made_once("ShaderNodeVectorMath", operation, "Vector", a, b)

    def _made_once(
        self, kind: str, operation: str, output: str, a: Expression, b: Expression
    ) -> Socket:
        key = (f"{kind} {operation}", a, b)
        if key not in self._made:
            node = self.tree.nodes.new(kind)
            node.operation = operation
            self._feed(node.inputs[0], a)
            self._feed(node.inputs[1], b)
            self._made[key] = Socket(node, output, 3 if output == "Vector" else 1)
        return self._made[key]

    def _feed(self, socket: Any, a: Expression) -> None:
        if isinstance(a, Socket):
            self.tree.links.new(a.output, socket)
        elif socket.type == "VALUE":
            socket.default_value = a.values[0]
        else:
            size = len(socket.default_value)
            socket.default_value = (*_spread(a.values, 3), 1.0)[:size]


def _spread(values: Sequence[float], components: int) -> Sequence[float]:
    return tuple(values) * components if len(values) == 1 else values
