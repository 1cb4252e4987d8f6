# SPDX-License-Identifier: GPL-3.0-or-later
"""A material as the lobes of the channel table, and what mixing and adding do to them.

Colours are weighted sums and stay exact. A mix can hold only one roughness, one normal and
one dielectric layer, so these are blended by the share that each side has in what they act
on; where the two sides differ, that is reported as an approximation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from .specialize_expression import (
    BLACK,
    ONE,
    ZERO,
    Constant,
    Expression,
    ExpressionBuilder,
    Socket,
    is_zero,
)


class Reporter(Protocol):
    """Takes one sentence on how the cached material differs from Cycles."""

    def __call__(self, effect: str) -> None: ...


@dataclass(frozen=True)
class Lobes:
    """The channels of the channel table (see there), as expressions in one node tree.

    Colours are premultiplied by the lobe's weight in the material. `transparency` is the
    share of light that passes straight through. `normal` None is the shading normal.
    """

    diffuse_color: Expression = BLACK
    layer_f0: Expression = ZERO
    layer_f90: Expression = ZERO
    specular_f0: Expression = BLACK
    specular_f90: Expression = BLACK
    roughness: Expression = ONE
    emission: Expression = BLACK
    transparency: Expression = ZERO
    normal: Expression | None = None

    @property
    def has_diffuse(self) -> bool:
        return not is_zero(self.diffuse_color)

    @property
    def has_specular(self) -> bool:
        return not (is_zero(self.specular_f0) and is_zero(self.specular_f90))


def scale(build: ExpressionBuilder, lobes: Lobes, weight: Expression) -> Lobes:
    """The same lobes with a weight, a value or a colour."""
    return replace(
        lobes,
        diffuse_color=build.multiply(lobes.diffuse_color, weight),
        specular_f0=build.multiply(lobes.specular_f0, weight),
        specular_f90=build.multiply(lobes.specular_f90, weight),
        emission=build.multiply(lobes.emission, weight),
        transparency=build.multiply(lobes.transparency, build.mean(weight)),
    )


def add(build: ExpressionBuilder, a: Lobes, b: Lobes, report: Reporter) -> Lobes:
    """Both materials' lobes together."""
    layer_f0, layer_f90 = _add_layers(build, a, b)
    return Lobes(
        diffuse_color=build.add(a.diffuse_color, b.diffuse_color),
        layer_f0=layer_f0,
        layer_f90=layer_f90,
        specular_f0=build.add(a.specular_f0, b.specular_f0),
        specular_f90=build.add(a.specular_f90, b.specular_f90),
        roughness=_add_roughness(build, a, b, report),
        emission=build.add(a.emission, b.emission),
        transparency=build.add(a.transparency, b.transparency),
        normal=_add_normals(build, a, b, report),
    )


def mix(
    build: ExpressionBuilder, a: Lobes, b: Lobes, factor: Expression, report: Reporter
) -> Lobes:
    """A (1 - factor) + b factor."""
    return add(build, scale(build, a, build.complement(factor)), scale(build, b, factor), report)


def mix_by_fresnel(
    build: ExpressionBuilder, a: Lobes, b: Lobes, f0: Expression, report: Reporter
) -> Lobes:
    """A Mix Shader whose factor is the Fresnel reflectance of a dielectric with this F0.

    The factor runs from F0 at normal incidence to 1 at grazing, as a specular lobe's own
    Fresnel term does, so the mix at these two ends gives specular_f0 and specular_f90; over
    the diffuse lobe of `a` it is a dielectric layer.
    """
    if b.has_diffuse:
        report("the diffuse part seen at grazing angles of a Fresnel mix is cached for normal view")
    facing = mix(build, a, b, f0, report)
    keep = build.complement(f0)
    under = Lobes(
        diffuse_color=a.diffuse_color,
        layer_f0=build.complement(build.multiply(build.complement(a.layer_f0), keep)),
        layer_f90=ONE,
    )
    over = replace(b, diffuse_color=build.multiply(b.diffuse_color, f0))
    layer_f0, layer_f90 = _add_layers(build, under, over)
    return replace(
        facing,
        diffuse_color=build.add(under.diffuse_color, over.diffuse_color),
        layer_f0=layer_f0,
        layer_f90=layer_f90,
        specular_f90=b.specular_f90,
    )


def _specular_energy(build: ExpressionBuilder, lobes: Lobes) -> Expression:
    """The cosine-weighted mean of Schlick's Fresnel term, (20 F0 + F90) / 21."""
    total = build.add(
        build.multiply(lobes.specular_f0, Constant((20.0 / 21.0,))),
        build.multiply(lobes.specular_f90, Constant((1.0 / 21.0,))),
    )
    return build.mean(total)


def _add_layers(build: ExpressionBuilder, a: Lobes, b: Lobes) -> tuple[Expression, Expression]:
    """One layer that keeps as much light from the sum of the diffuse lobes as both do."""
    if not b.has_diffuse:
        return a.layer_f0, a.layer_f90
    if not a.has_diffuse:
        return b.layer_f0, b.layer_f90
    if (a.layer_f0, a.layer_f90) == (b.layer_f0, b.layer_f90):
        return a.layer_f0, a.layer_f90
    share_a, share_b = build.mean(a.diffuse_color), build.mean(b.diffuse_color)
    return (
        _blend(build, a.layer_f0, b.layer_f0, share_a, share_b),
        _blend(build, a.layer_f90, b.layer_f90, share_a, share_b),
    )


def _add_roughness(build: ExpressionBuilder, a: Lobes, b: Lobes, report: Reporter) -> Expression:
    if not b.has_specular:
        return a.roughness
    if not a.has_specular or a.roughness == b.roughness:
        return b.roughness
    report("a mix of two glossy lobes is cached with one roughness between theirs")
    return _blend(
        build, a.roughness, b.roughness, _specular_energy(build, a), _specular_energy(build, b)
    )


def _add_normals(
    build: ExpressionBuilder, a: Lobes, b: Lobes, report: Reporter
) -> Expression | None:
    if a.normal == b.normal or not (b.has_diffuse or b.has_specular):
        return a.normal
    if not (a.has_diffuse or a.has_specular):
        return b.normal
    report("a mix of two normals is cached with one normal between them")
    share_a, share_b = (
        build.add(build.mean(lobes.diffuse_color), _specular_energy(build, lobes))
        for lobes in (a, b)
    )
    return _blend(
        build,
        a.normal or shading_normal(build),
        b.normal or shading_normal(build),
        share_a,
        share_b,
    )


def _blend(
    build: ExpressionBuilder, a: Expression, b: Expression, share_a: Expression, share_b: Expression
) -> Expression:
    if a == b:
        return a
    total = build.add(share_a, share_b)
    weighted = build.add(build.multiply(a, share_a), build.multiply(b, share_b))
    return build.divide(weighted, total)


def shading_normal(build: ExpressionBuilder) -> Expression:
    """The surface's own normal, bump of the displacement in it, turned to the camera."""
    node = build.tree.nodes.new("ShaderNodeNewGeometry")
    return Socket(node, "Normal", 3)


def unit_normal(build: ExpressionBuilder, normal: Expression | None) -> Expression:
    """A lobe's normal at unit length, as Cycles' closures take it."""
    if normal is None:
        return shading_normal(build)
    node = build.tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "NORMALIZE"
    build.assign(node.inputs[0], normal)
    return Socket(node, "Vector", 3)
