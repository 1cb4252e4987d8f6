# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixing and adding lobes: exact as long as there is room for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import bpy
import pytest

from addon.caching.channels import MAX_LOBES, ViewCurve
from addon.caching.specialize_expression import ONE, ZERO, Constant, ExpressionBuilder
from addon.caching.specialize_lobes import (
    FULL_VIEW,
    Lobe,
    Lobes,
    ViewWeight,
    add,
    mix,
    mix_by_view,
    scale,
)


class Reports:
    """Keeps what is reported."""

    def __init__(self) -> None:
        self.effects: list[str] = []

    def __call__(self, effect: str) -> None:
        self.effects.append(effect)


@pytest.fixture
def build() -> Iterator[ExpressionBuilder]:
    tree = bpy.data.node_groups.new("lobes", "ShaderNodeTree")
    yield ExpressionBuilder(tree)
    bpy.data.node_groups.remove(tree)


def number(value: float) -> Constant:
    return Constant((value,))


def colour(value: float) -> Constant:
    return Constant((value,) * 3)


def glossy(value: float, roughness: float) -> Lobes:
    return Lobes.of(
        Lobe(specular_f0=colour(value), specular_f90=colour(value), roughness=number(roughness))
    )


def matte(value: float) -> Lobes:
    return Lobes.of(Lobe(diffuse_color=colour(value)))


PRINCIPLED = Lobes.of(
    Lobe(
        diffuse_color=colour(0.8),
        layer_f0=number(0.04),
        layer_f90=ONE,
        specular_f0=number(0.04),
        specular_f90=ONE,
        roughness=number(0.5),
    )
)
FRESNEL = ViewWeight(curve=number(float(ViewCurve.FRESNEL)), parameter=number(0.04))


def values(constant: object) -> tuple[float, ...]:
    assert isinstance(constant, Constant)
    return constant.values


def test_lobes_that_agree_become_one(build: ExpressionBuilder) -> None:
    reports = Reports()
    result = mix(build, matte(0.8), glossy(0.9, 0.2), number(0.25), reports)
    (lobe,) = result.each
    assert values(lobe.diffuse_color) == pytest.approx([0.6] * 3)
    assert values(lobe.specular_f0) == pytest.approx([0.225] * 3)
    assert lobe.roughness == number(0.2)
    assert not reports.effects


def test_lobes_that_differ_stay_apart(build: ExpressionBuilder) -> None:
    reports = Reports()
    result = mix(build, glossy(0.9, 0.1), glossy(0.3, 0.5), number(0.5), reports)
    assert [lobe.roughness for lobe in result.each] == [number(0.1), number(0.5)]
    assert [values(lobe.specular_f0)[0] for lobe in result.each] == pytest.approx([0.45, 0.15])
    assert not reports.effects


def test_a_base_without_a_layer_is_not_put_under_one(build: ExpressionBuilder) -> None:
    result = mix(build, PRINCIPLED, matte(0.5), number(0.5), Reports())
    assert [lobe.layer_f0 for lobe in result.each] == [number(0.04), ZERO]
    assert [values(lobe.diffuse_color)[0] for lobe in result.each] == pytest.approx([0.4, 0.25])


@pytest.mark.parametrize("glossy_first", [True, False])
def test_gloss_beside_a_layer_keeps_the_layer(build: ExpressionBuilder, glossy_first: bool) -> None:
    both = (glossy(0.1, 0.5), PRINCIPLED)
    first, second = both if glossy_first else both[::-1]
    (lobe,) = mix(build, first, second, number(0.5), Reports()).each
    assert (lobe.layer_f0, lobe.layer_f90) == (number(0.04), ONE)
    assert values(lobe.diffuse_color) == pytest.approx([0.4] * 3)
    assert values(lobe.specular_f0) == pytest.approx([0.07] * 3)


def test_depth_does_not_matter(build: ExpressionBuilder) -> None:
    """Sixteen leaves of two kinds, whose weights are 1/16 each."""
    reports = Reports()
    level = [matte(0.8) if i % 2 else glossy(1.0, 0.3) for i in range(16)]
    while len(level) > 1:
        level = [
            mix(build, level[i], level[i + 1], number(0.5), reports)
            for i in range(0, len(level), 2)
        ]
    (lobe,) = level[0].each
    assert values(lobe.diffuse_color) == pytest.approx([0.4] * 3)
    assert values(lobe.specular_f90) == pytest.approx([0.5] * 3)
    assert not reports.effects


def test_the_lobe_too_many_is_blended_by_energy_and_said(build: ExpressionBuilder) -> None:
    reports = Reports()
    result = glossy(0.1, 0.0)
    for k in range(1, MAX_LOBES + 1):
        result = add(build, result, glossy(0.1 * (k + 1), 0.1 * k), reports)
    assert len(result.each) == MAX_LOBES
    assert len(reports.effects) == 1
    # Energies 4 : 5 of roughness 0.3 and 0.4.
    assert values(result.each[-1].roughness)[0] == pytest.approx((4 * 0.3 + 5 * 0.4) / 9)
    assert values(result.each[-1].specular_f0) == pytest.approx([0.9] * 3)


def test_a_mix_by_the_view_weights_both_sides(build: ExpressionBuilder) -> None:
    reports = Reports()
    result = mix_by_view(build, matte(0.5), glossy(1.0, 0.1), FRESNEL, number(0.04), reports)
    under, over = result.each
    assert under.view == replace(FRESNEL, base=ONE, slope=number(-1.0))
    assert over.view == replace(FRESNEL, base=ZERO, slope=ONE)
    assert (under.diffuse_color, over.specular_f0) == (colour(0.5), colour(1.0))
    assert not reports.effects


def test_a_second_weight_by_the_view_is_kept_from_the_front(build: ExpressionBuilder) -> None:
    reports = Reports()
    inner = mix_by_view(build, matte(0.5), glossy(1.0, 0.1), FRESNEL, number(0.04), reports)
    facing = ViewWeight(curve=number(float(ViewCurve.FACING)), parameter=ONE)
    result = mix_by_view(build, inner, matte(0.2), facing, number(0.25), reports)
    assert values(result.each[0].diffuse_color) == pytest.approx([0.375] * 3)
    assert values(result.each[2].diffuse_color) == pytest.approx([0.2] * 3)
    assert len(reports.effects) == 1


def test_what_is_black_takes_no_lobe(build: ExpressionBuilder) -> None:
    emission = Lobes(emission=colour(2.0))
    result = add(build, emission, scale(build, matte(0.5), ZERO), Reports())
    assert result == emission
    assert Lobe().view == FULL_VIEW
