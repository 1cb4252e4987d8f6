# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides where each channel of a scene lives, from the lobes of its materials.

A channel that no material reads is left out. One that is constant over the scene, or over each
material, is a number of the plan; one that equals another in every material is that one; what is
left is stored in each texel, its components once where they are equal.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..errors import InputError
from .channels import CHANNEL_BY_NAME, Channel, channels_of
from .plan import Approximation, ChannelPlan, Values
from .specialize_expression import Constant, Expression, is_constant
from .specialize_lobes import Lobes, expression_of, reads

# What a material has in a channel: its expression, or None where it does not read it. A lobe's
# own shading normal is one more expression.
_Use = Expression | str | None
_SHADING_NORMAL = "shading normal"

# Of float32, in which shaders have them.
_LARGEST = 3.4028234e38

_ALWAYS_STORED = ("depth", "material_id", "normal", "ambient_occlusion")


def plan_channels(
    names: Sequence[str],
    materials: Sequence[Lobes],
    effects: Sequence[Sequence[str]],
    *,
    has_ambient: bool,
    bent: Collection[int] = (),
) -> ChannelPlan:
    """Where each channel lives.

    Args:
        names: of the materials.
        materials: their lobes.
        effects: of each, a sentence for everything that is approximated.
        has_ambient: whether ambient occlusion is wanted.
        bent: which materials have a displacement, whose bump is in all of their normals.

    Raises:
        InputError: a material has a constant that is not finite.
    """
    lobes = max([1, *(len(material.each) for material in materials)])
    places = _Places(names, materials)
    for channel in channels_of(lobes):
        if channel.name != "ambient_occlusion" or has_ambient:
            places.add(channel)
    return ChannelPlan(
        stored=tuple(places.stored),
        constants=places.constants,
        material_names=tuple(names),
        approximations=tuple(
            Approximation(name or "(none)", effect)
            for name, sentences in zip(names, effects, strict=True)
            for effect in sentences
        ),
        material_constants=places.material_constants,
        same=places.same,
        grey=frozenset(places.grey),
        lobes=lobes,
        mesh_normals={
            name: tuple(
                number not in bent and use in (None, _SHADING_NORMAL)
                for number, use in enumerate(uses)
            )
            for name, uses in places.stored.items()
            if CHANNEL_BY_NAME[name].field == "normal"
        },
    )


class _Places:
    """Where the channels live that were looked at so far; the fields are `ChannelPlan`'s."""

    def __init__(self, names: Sequence[str], materials: Sequence[Lobes]) -> None:
        self._names = names
        self._materials = materials
        self.stored: dict[str, list[_Use]] = {}
        self.constants: dict[str, Values] = {}
        self.material_constants: dict[str, tuple[Values, ...]] = {}
        self.same: dict[str, str] = {}
        self.grey: set[str] = set()

    def add(self, channel: Channel) -> None:
        if channel.name == "material_id" and len(self._materials) < 2:
            self.constants[channel.name] = (1.0,)
        elif channel.name in _ALWAYS_STORED:
            # A texel's normal also tells whose surface it is of.
            reads_normal = channel.field == "normal"
            self.stored[channel.name] = (
                [_use(channel, material) for material in self._materials] if reads_normal else []
            )
        else:
            uses = [_use(channel, material) for material in self._materials]
            values = _constants(channel, uses)
            if values is None:
                self._add_varying(channel, uses)
            else:
                self._check_finite(channel, values)
                self._add_constant(channel, values)

    def _check_finite(self, channel: Channel, values: Sequence[Values | None]) -> None:
        for name, value in zip(self._names, values, strict=True):
            if not all(abs(x) <= _LARGEST for x in value or ()):
                raise InputError(
                    f"material '{name}' gives '{channel.name}' that is not finite; mend its nodes"
                )

    def _add_constant(self, channel: Channel, values: Sequence[Values | None]) -> None:
        distinct = {value for value in values if value is not None}
        if len(distinct) > 1:
            self.material_constants[channel.name] = tuple(
                channel.neutral if value is None else value for value in values
            )
        elif distinct and channel.neutral not in distinct:
            self.constants[channel.name] = distinct.pop()

    def _add_varying(self, channel: Channel, uses: list[_Use]) -> None:
        is_grey = channel.components == 3 and all(_is_grey(use) for use in uses)
        for name, others in self.stored.items():
            alike = CHANNEL_BY_NAME[name]
            if (alike.space, alike.components) != (channel.space, channel.components) or not others:
                continue
            if all(use is None or use == other for use, other in zip(uses, others, strict=True)):
                self.same[channel.name] = name
                return
        self.stored[channel.name] = uses
        if is_grey:
            self.grey.add(channel.name)


def _use(channel: Channel, material: Lobes) -> _Use:
    if not channel.lobe:
        return expression_of_surface(material, channel)
    if channel.lobe > len(material.each):
        # Colours of lobes that are not there are 0; nothing reads the rest.
        return Constant(channel.neutral) if _is_color(channel) else None
    lobe = material.each[channel.lobe - 1]
    if not (_is_color(channel) or reads(lobe, channel.part)):
        return None
    if channel.field == "normal" and lobe.normal is None:
        return _SHADING_NORMAL
    return expression_of(lobe, channel.field)


def expression_of_surface(material: Lobes, channel: Channel) -> Expression:
    """What a material has in a channel that is of no lobe."""
    value: Expression = getattr(material, channel.name)
    return value


def _is_color(channel: Channel) -> bool:
    return channel.space == "linear Rec.709"


def _constants(channel: Channel, uses: Sequence[_Use]) -> list[Values | None] | None:
    """The value in each material, None where it is not read; None if one is no constant."""
    values: list[Values | None] = []
    for use in uses:
        if use is None:
            values.append(None)
        elif isinstance(use, Constant):
            values.append(_widened(use, channel))
        else:
            return None
    return values


def _is_grey(use: _Use) -> bool:
    if use is None:
        return True
    if isinstance(use, Constant):
        return is_constant(use, use.values[0])
    return not isinstance(use, str) and use.components == 1


def _widened(constant: Constant, channel: Channel) -> Values:
    values = tuple(float(x) for x in constant.values)
    return values if len(values) == channel.components else values[:1] * channel.components
