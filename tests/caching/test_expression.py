# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: constants fold to closed forms; the rest becomes as few nodes as it needs."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from addon.caching.specialize_closures import f0_from_ior
from addon.caching.specialize_expression import (
    BLACK,
    ONE,
    ZERO,
    Constant,
    ExpressionBuilder,
    Socket,
    is_zero,
)

numbers = st.floats(-8.0, 8.0)


@pytest.fixture
def build() -> Iterator[ExpressionBuilder]:
    tree = bpy.data.node_groups.new("expressions", "ShaderNodeTree")
    yield ExpressionBuilder(tree)
    bpy.data.node_groups.remove(tree)


def varying(build: ExpressionBuilder, components: int = 3) -> Socket:
    node = build.tree.nodes.new("ShaderNodeNewGeometry")
    return Socket(node, "Normal", components)


@given(numbers, numbers, st.floats(0.0, 1.0))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
def test_constants_fold_without_a_node(
    build: ExpressionBuilder, x: float, y: float, t: float
) -> None:
    a, b = Constant((x,)), Constant((y, x, 1.0))
    assert build.add(a, b) == Constant((x + y, x + x, x + 1.0))
    assert build.multiply(a, b) == Constant((x * y, x * x, x))
    assert build.subtract(b, a) == Constant((y - x, 0.0, 1.0 - x))
    assert build.largest(b) == Constant((max(x, y, 1.0),))
    mixed = build.mix(Constant((x,)), Constant((y,)), Constant((t,)))
    assert isinstance(mixed, Constant)
    # Three roundings of numbers up to 8.
    assert mixed.values[0] == pytest.approx(x + (y - x) * t, abs=1e-14)
    assert not build.tree.nodes


def test_division_by_zero_is_zero_as_in_blender(build: ExpressionBuilder) -> None:
    assert build.divide(Constant((1.0, 2.0, 3.0)), Constant((0.0, 4.0, 0.0))) == Constant(
        (0.0, 0.5, 0.0)
    )


def test_neutral_operands_add_no_nodes(build: ExpressionBuilder) -> None:
    x = varying(build)
    assert build.add(x, ZERO) == x
    assert build.add(BLACK, x) == x
    assert build.multiply(x, ONE) == x
    assert build.divide(x, ONE) == x
    assert is_zero(build.multiply(x, ZERO))
    assert build.mix(x, Constant((1.0, 2.0, 3.0)), ZERO) == x
    assert len(build.tree.nodes) == 1


def test_a_value_becomes_a_colour_where_a_colour_is_needed(build: ExpressionBuilder) -> None:
    value = varying(build, 1)
    result = build.multiply(value, Constant((1.0, 2.0, 3.0)))
    assert isinstance(result, Socket)
    assert result.components == 3
    assert result.node.operation == "MULTIPLY"


def test_colours_become_values_as_by_a_link(build: ExpressionBuilder) -> None:
    grey = build.convert(Constant((1.0, 0.0, 0.0)), 1, "RGBA")
    assert isinstance(grey, Constant)
    # Rec.709 luma of red.
    assert grey.values[0] == pytest.approx(0.2126, abs=1e-4)
    mean = build.convert(Constant((1.0, 0.0, 0.5)), 1, "VECTOR")
    assert isinstance(mean, Constant)
    assert mean.values[0] == pytest.approx(0.5, rel=1e-15)


@pytest.mark.parametrize(("ior", "f0"), [(1.0, 0.0), (1.5, 0.04), (1 / 1.5, 0.04), (2.0, 1 / 9)])
def test_reflectance_at_normal_incidence(build: ExpressionBuilder, ior: float, f0: float) -> None:
    found = f0_from_ior(build, Constant((ior,)))
    assert isinstance(found, Constant)
    assert found.values[0] == pytest.approx(f0, rel=1e-12)


def test_the_same_operation_is_one_node(build: ExpressionBuilder) -> None:
    x, y = varying(build), varying(build)
    assert build.multiply(x, y) == build.multiply(x, y)
    assert build.multiply(x, y) != build.multiply(y, x)
    assert build.clamp(build.mean(x)) == build.clamp(build.mean(x))
    assert build.largest(x) == build.largest(x)
    assert build.convert(x, 1, "VECTOR") == build.convert(x, 1, "VECTOR")
