# SPDX-License-Identifier: GPL-3.0-or-later
"""A material as a sum of the lobes of the channel table, and what mixing and adding do to it.

Colours are weighted sums. Lobes of two materials that agree in all other parameters become one,
with the sum of their colours; others stay beside each other. So the result is exact whatever the
depth of Mix and Add trees, until a material has more lobes than a deep framebuffer can hold: the
last two are then blended into one, and that is reported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

from .channels import MAX_LOBES
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
class ViewWeight:
    """A lobe's weight by the angle of view, as the channel table's W: expressions in one tree."""

    base: Expression = ONE
    slope: Expression = ZERO
    curve: Expression = ZERO
    parameter: Expression = ZERO
    roughness: Expression = ZERO


FULL_VIEW = ViewWeight()


@dataclass(frozen=True)
class Lobe:
    """The fields of one lobe in the channel table (see there), as expressions in one node tree.

    Colours are premultiplied by the lobe's weight in the material. `normal` None is the shading
    normal.
    """

    diffuse_color: Expression = BLACK
    diffuse_roughness: Expression = ZERO
    diffuse_model: Expression = ZERO
    diffuse_share: Expression = ONE
    layer_f0: Expression = ZERO
    layer_f90: Expression = ZERO
    specular_f0: Expression = BLACK
    specular_f90: Expression = BLACK
    dielectric: Expression = ZERO
    specular_dip: Expression = BLACK
    roughness: Expression = ONE
    specular_share: Expression = ONE
    distribution: Expression = ZERO
    aspect: Expression = ONE
    tangent: Expression | None = None
    translucent_color: Expression = BLACK
    sheen_color: Expression = BLACK
    sheen_roughness: Expression = ZERO
    normal: Expression | None = None
    view: ViewWeight = FULL_VIEW

    @property
    def has_diffuse(self) -> bool:
        return not is_zero(self.diffuse_color)

    @property
    def has_specular(self) -> bool:
        return not (is_zero(self.specular_f0) and is_zero(self.specular_f90))

    @property
    def has_layer(self) -> bool:
        return not (is_zero(self.layer_f0) and is_zero(self.layer_f90))

    @property
    def has_translucent(self) -> bool:
        return not is_zero(self.translucent_color)

    @property
    def has_sheen(self) -> bool:
        return not is_zero(self.sheen_color)

    @property
    def is_black(self) -> bool:
        return not (self.has_diffuse or self.has_specular or self.has_translucent or self.has_sheen)


COLORS = (
    "diffuse_color",
    "specular_f0",
    "specular_f90",
    "specular_dip",
    "translucent_color",
    "sheen_color",
)


@dataclass(frozen=True)
class Lobes:
    """A whole material: its lobes, what it emits, and the share of light that passes straight
    through it."""

    each: tuple[Lobe, ...] = ()
    emission: Expression = BLACK
    transparency: Expression = ZERO

    @classmethod
    def of(cls, lobe: Lobe) -> Lobes:
        """One lobe and nothing else."""
        return cls((lobe,))

    def map(self, carry: Callable[[Expression], Expression]) -> Lobes:
        """The same with each expression carried over; equal ones once."""
        carried: dict[Expression, Expression] = {}

        def once(value: Expression) -> Expression:
            if value not in carried:
                carried[value] = carry(value)
            return carried[value]

        def whole(lobe: Lobe) -> Lobe:
            changes = {
                name: once(value)
                for name, value in vars(lobe).items()
                if value is not None and name != "view"
            }
            view = ViewWeight(**{name: once(value) for name, value in vars(lobe.view).items()})
            return replace(lobe, **changes, view=view)

        return Lobes(
            tuple(whole(lobe) for lobe in self.each), once(self.emission), once(self.transparency)
        )


# Weights beside the colours.
_SHARES = ("dielectric", "diffuse_share", "specular_share")


def scale(build: ExpressionBuilder, lobes: Lobes, weight: Expression) -> Lobes:
    """The same lobes with a weight, a value or a colour."""
    return Lobes(
        tuple(_scaled(build, lobe, weight) for lobe in lobes.each),
        build.multiply(lobes.emission, weight),
        build.multiply(lobes.transparency, build.mean(weight)),
    )


def _scaled(build: ExpressionBuilder, lobe: Lobe, weight: Expression) -> Lobe:
    scaled: dict[str, Any] = {name: build.multiply(getattr(lobe, name), weight) for name in COLORS}
    share = build.mean(weight)
    for name in _SHARES:
        scaled[name] = build.multiply(getattr(lobe, name), share)
    return replace(lobe, **scaled)


def add(build: ExpressionBuilder, a: Lobes, b: Lobes, report: Reporter) -> Lobes:
    """Both materials' lobes together."""
    each = list(a.each)
    for lobe in b.each:
        _join(build, each, lobe)
    if len(each) > MAX_LOBES:
        report(f"of its {len(each)} lobes the last ones are blended into one")
    while len(each) > MAX_LOBES:
        last = each.pop()
        each[-1] = _blended(build, each[-1], last)
    return Lobes(
        tuple(each),
        build.add(a.emission, b.emission),
        build.add(a.transparency, b.transparency),
    )


def mix(
    build: ExpressionBuilder, a: Lobes, b: Lobes, factor: Expression, report: Reporter
) -> Lobes:
    """A (1 - factor) + b factor."""
    return add(build, scale(build, a, build.complement(factor)), scale(build, b, factor), report)


def mix_by_view(  # noqa: PLR0917 - two materials, one curve
    build: ExpressionBuilder,
    a: Lobes,
    b: Lobes,
    curve: ViewWeight,
    front: Expression,
    report: Reporter,
) -> Lobes:
    """A Mix Shader whose factor is a curve of the view, shaded at run time.

    Args:
        build: of the tree that the mix is in.
        a: seen with 1 - factor.
        b: seen with the factor.
        curve: `base` and `slope` of it are not read.
        front: the factor where the surface is looked at straight on. What has no weight by the
            view takes it: emission, transparency, and lobes that have another curve already.
        report: takes what is kept from the front.
    """
    falling = replace(curve, base=ONE, slope=Constant((-1.0,)))
    rising = replace(curve, base=ZERO, slope=ONE)
    away = seen_through(build, a, falling, build.complement(front), report)
    toward = seen_through(build, b, rising, front, report)
    return add(build, away, toward, report)


def seen_through(
    build: ExpressionBuilder, lobes: Lobes, view: ViewWeight, front: Expression, report: Reporter
) -> Lobes:
    """Lobes with a weight by the view; `front` is that weight's value looked at straight on."""
    each = []
    frozen = not (is_zero(lobes.emission) and is_zero(lobes.transparency))
    for lobe in lobes.each:
        if lobe.view == FULL_VIEW:
            each.append(replace(lobe, view=view))
        else:
            frozen = True
            each.append(_scaled(build, lobe, front))
    if frozen:
        report("a second weight that depends on the view is kept as it is seen from the front")
    return Lobes(
        tuple(each),
        build.multiply(lobes.emission, front),
        build.multiply(lobes.transparency, front),
    )


# Parameters in which lobes agree, or are not one: those of what they hold.
_OF_SPECULAR = ("roughness", "distribution", "aspect", "tangent")
_OF_DIFFUSE = ("diffuse_roughness", "diffuse_model", "layer_f0", "layer_f90")


def _join(build: ExpressionBuilder, each: list[Lobe], lobe: Lobe) -> None:
    """Add a lobe to the first one that it agrees with, or behind them."""
    if lobe.is_black:
        return
    for index, other in enumerate(each):
        if _agree(other, lobe):
            each[index] = _sum(build, other, lobe)
            return
    each.append(lobe)


def _agree(a: Lobe, b: Lobe) -> bool:
    same_layer = all(getattr(a, name) == getattr(b, name) for name in _OF_DIFFUSE)
    same_shape = all(getattr(a, name) == getattr(b, name) for name in _OF_SPECULAR)
    return (
        a.view == b.view
        and a.normal == b.normal
        # A layer is over the diffuse base, and is the part of the specular lobe that follows
        # Fresnel's curve; its albedo is that of its own lobe's roughness.
        and (same_layer or not all(x.has_diffuse or x.has_layer for x in (a, b)))
        and (a.sheen_roughness == b.sheen_roughness or not (a.has_sheen and b.has_sheen))
        and (same_shape or not all(x.has_specular or x.has_layer for x in (a, b)))
    )


def _sums(build: ExpressionBuilder, a: Lobe, b: Lobe) -> dict[str, Any]:
    names = (*COLORS, *_SHARES)
    sums: dict[str, Any] = {n: build.add(getattr(a, n), getattr(b, n)) for n in names}
    # What is not there has no share.
    if not (a.has_specular and b.has_specular):
        sums["specular_share"] = (a if a.has_specular else b).specular_share
    if not (a.has_diffuse and b.has_diffuse):
        sums["diffuse_share"] = (a if a.has_diffuse else b).diffuse_share
    return sums


def _sum(build: ExpressionBuilder, a: Lobe, b: Lobe) -> Lobe:
    """Lobes that agree: the sums of their colours, and the parameters of that which has any."""
    sums = _sums(build, a, b)
    specular = a if a.has_specular or a.has_layer else b
    diffuse = a if a.has_diffuse else b
    layer = a if a.has_diffuse or a.has_layer else b
    return replace(
        a,
        **sums,
        roughness=specular.roughness,
        distribution=specular.distribution,
        aspect=specular.aspect,
        tangent=specular.tangent,
        diffuse_roughness=diffuse.diffuse_roughness,
        diffuse_model=diffuse.diffuse_model,
        sheen_roughness=(a if a.has_sheen else b).sheen_roughness,
        layer_f0=layer.layer_f0,
        layer_f90=layer.layer_f90,
    )


def _blended(build: ExpressionBuilder, a: Lobe, b: Lobe) -> Lobe:
    """One lobe for two that differ: parameters by the share of what they act on."""
    diffuse = [build.mean(lobe.diffuse_color) for lobe in (a, b)]
    specular = [_specular_energy(build, lobe) for lobe in (a, b)]
    both = [build.add(d, s) for d, s in zip(diffuse, specular, strict=True)]
    shares = dict.fromkeys(_OF_DIFFUSE, diffuse) | {"roughness": specular}
    blended: dict[str, Any] = {
        name: _blend(build, getattr(a, name), getattr(b, name), *share)
        for name, share in shares.items()
    }
    normal = a.normal
    if a.normal != b.normal:
        normals = [lobe.normal or shading_normal(build) for lobe in (a, b)]
        normal = _blend(build, normals[0], normals[1], *both)
    sums = _sums(build, a, b)
    return replace(a, **sums, **blended, normal=normal)


def _specular_energy(build: ExpressionBuilder, lobe: Lobe) -> Expression:
    """The cosine-weighted mean of Schlick's Fresnel term, (20 F0 + F90) / 21."""
    total = build.add(
        build.multiply(lobe.specular_f0, Constant((20.0 / 21.0,))),
        build.multiply(lobe.specular_f90, Constant((1.0 / 21.0,))),
    )
    return build.mean(total)


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
    return build.normalize(normal)


# Where a field of the channel table is in a lobe.
_VIEW_FIELDS = {f"view_{field.name}": field.name for field in fields(ViewWeight)}


def expression_of(lobe: Lobe, field: str) -> Expression | None:
    """A field of the channel table; None for the shading normal."""
    if field in _VIEW_FIELDS:
        value: Expression | None = getattr(lobe.view, _VIEW_FIELDS[field])
    else:
        value = getattr(lobe, field)
    return value


def reads(lobe: Lobe, part: str) -> bool:
    """Whether a lobe reads the fields of a part (see `Channel.part`)."""
    has_specular = lobe.has_specular or lobe.has_layer
    parts = {
        "diffuse": lobe.has_diffuse,
        "rough diffuse": lobe.has_diffuse and not is_zero(lobe.diffuse_roughness),
        # Of a diffuse base without one it is told that there is none.
        "layer": has_specular or lobe.has_diffuse,
        "specular": has_specular,
        "bounces": (
            lobe.has_specular and is_zero(lobe.distribution) and not is_zero(lobe.roughness)
        ),
        "tangent": lobe.has_specular and lobe.tangent is not None,
        "translucent": lobe.has_translucent,
        "sheen": lobe.has_sheen,
    }
    return parts.get(part, not lobe.is_black)
