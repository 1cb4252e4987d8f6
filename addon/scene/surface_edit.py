# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist changes about finished surfaces while they are relit, without a new bake.

Each number multiplies (or adds to) what the cache holds, and so does to a material what the same
change of its nodes would do:

    gain, tint        Base Color and Color of every shader: diffuse and translucent colour, sheen,
                      metals and glossy reflection. Not the gloss of dielectrics, not emission.
                      A metal's reflectance at the front ends at 1, as in Cycles.
    roughness         Roughness of every glossy lobe, coats too: roughness * factor + offset, held
                      in [0, 1], where Blender's roughness ends. Not that of diffuse and sheen.
    specular, and     Of dielectrics (coats too) their reflectance at the front, as Specular IOR
    its tint          Level and Specular Tint have it: it ends at 1, and at 0 there is no gloss at
                      all. Of metals and glossy reflection their weight, without an end.
    emission          Emission Strength, as it is seen and as it lights others.

Those of a material and of an object multiply; an object's roughness is changed after its
material's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from ..errors import InputError

# Factors go up to here, so that a material's times an object's times a light's stay far from
# float32's end.
LARGEST_FACTOR = 1e9

Tint = tuple[float, float, float]

WHITE: Tint = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class SurfaceEdit:
    """The edits of one material or one object. As it is made it changes nothing.

    Attributes:
        gain: factor on its colours.
        tint: the same for each of red, green and blue, scene-linear Rec.709.
        roughness: factor on its roughness.
        roughness_offset: is added to that, -1 to 1.
        specular: factor on its gloss.
        specular_tint: the same for each of red, green and blue.
        emission: factor on the light that it sends out.

    Raises:
        InputError: a number that is not finite, or beyond its bounds.
    """

    gain: float = 1.0
    tint: Tint = WHITE
    roughness: float = 1.0
    roughness_offset: float = 0.0
    specular: float = 1.0
    specular_tint: Tint = WHITE
    emission: float = 1.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            low = -1.0 if each.name == "roughness_offset" else 0.0
            high = 1.0 if each.name == "roughness_offset" else LARGEST_FACTOR
            numbers = value if isinstance(value, tuple) else (value,)
            # Written so that NaN fails.
            if not all(low <= number <= high for number in numbers):
                raise InputError(
                    f"'{each.name}' of a surface edit must be from {low:g} to {high:g}, not {value}"
                )

    @property
    def color_factor(self) -> Tint:
        """Gain and tint as one."""
        return _times(self.tint, self.gain)

    @property
    def specular_factor(self) -> Tint:
        """Specular and its tint as one."""
        return _times(self.specular_tint, self.specular)

    @property
    def is_neutral(self) -> bool:
        """Whether it changes nothing."""
        return (
            self.color_factor == WHITE
            and self.specular_factor == WHITE
            and (self.roughness, self.roughness_offset, self.emission) == (1.0, 0.0, 1.0)
        )


NO_EDIT = SurfaceEdit()


def _times(tint: Tint, factor: float) -> Tint:
    red, green, blue = tint
    return red * factor, green * factor, blue * factor


@dataclass(frozen=True)
class SurfaceEdits:
    """The edits of a scene, by the names of materials and of objects."""

    materials: Mapping[str, SurfaceEdit] = field(default_factory=dict)
    objects: Mapping[str, SurfaceEdit] = field(default_factory=dict)

    @property
    def is_neutral(self) -> bool:
        """Whether they change nothing."""
        return all(e.is_neutral for of in (self.materials, self.objects) for e in of.values())


NO_EDITS = SurfaceEdits()
