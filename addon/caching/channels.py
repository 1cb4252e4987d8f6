# SPDX-License-Identifier: GPL-3.0-or-later
"""The channel table: everything that a deep framebuffer can hold, said once.

The AOV set-up, the EXR files, the GPU textures, the GLSL that unpacks them and the manual's
table are made from it.

A material is cached as a sum of lobes. A lobe is a diffuse base under one microfacet lobe, both
on one shading normal, seen through a weight that depends on the view:

    f = W(NoV) [diffuse_color R(diffuse_roughness) (1 - layer(NoV))
                + D G F(LoH) / (4 NoV NoL) * multiscatter
                + translucent_color / pi (from behind) + sheen]
    F(LoH)     = specular_f0 + (specular_f90 - specular_f0) s(LoH) - specular_dip LoH (1 - LoH)^6
    layer(NoV) = layer_f0 A(NoV, roughness) + layer_f90 B(NoV, roughness)
    W(NoV)     = view_base + view_slope C(NoV)

D and G are those of `distribution`, with alpha = roughness^2, divided by `aspect` along the tangent
and multiplied with it across. A and B are the two terms of the
split-sum directional albedo. s is the Schlick weight (1 - LoH)^5, but for the part of the
specular lobe that is the dielectric layer itself (its weight is `dielectric`), which follows the
exact Fresnel equations, as in Cycles. `specular_dip` is the edge tint of metals (the F82-tint
model of Kutz et al. 2021, in which it is linear). `layer` is the light that a dielectric over the
diffuse base keeps from it (Principled BSDF). R is 1 / pi, or the rough diffuse of Cycles. C is the
curve that `view_curve` names: what a Fresnel or Layer Weight node gives as a mix factor, or what a
coat or a sheen reflects; it is shaded at run time, because a cached value would be the caching
camera's.

`multiscatter` and R depend on a colour: that of the lobe without the weight that it has in the
material, which is the quotient of `specular_f0`, … by `specular_share`, and of `diffuse_color` by
`diffuse_share`.

All colours are linear in what is stored, so a mix of materials is the mix of their colours
where the other parameters agree, and a further lobe where they do not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Literal

Space = Literal["linear Rec.709", "world", "camera", "none"]
Precision = Literal["float32", "half"]

# Lobes of one material. A further one is blended into those that are there, and reported.
MAX_LOBES = 4


class Distribution(IntEnum):
    """Values of the channel `distribution`: Cycles' microfacet models, and those of the papers."""

    MULTI_GGX = 0
    GGX = 1
    BECKMANN = 2
    ASHIKHMIN_SHIRLEY = 3
    PHONG = 4
    BLINN = 5
    COOK_TORRANCE = 6


class DiffuseModel(IntEnum):
    """Values of the channel `diffuse_model`."""

    OREN_NAYAR = 0
    MINNAERT = 1


class ViewCurve(IntEnum):
    """Values of the channel `view_curve`: what C(NoV) is."""

    NONE = 0
    FRESNEL = 1
    FACING = 2
    COAT = 3
    SHEEN = 4


@dataclass(frozen=True)
class Channel:
    """One quantity of the surface seen at a texel's centre.

    Attributes:
        name: used in Python, in GLSL, on disk and in the manual. Channels of a second, third, …
            lobe have its number behind it: `roughness_2`.
        components: 1 or 3.
        space: the colour or vector space of the values.
        unit: physical unit, "1" for pure numbers.
        precision: on disk, where it holds the values (see `precision`; normals: `octahedral`).
        part: the part of a material that reads it, or "" for those that every scene needs.
        neutral: the value that makes the channel do nothing.
        meaning: one line for the manual.
        lobe: 0 for a channel of the whole surface, else the number of the lobe that it is of.
        field: of its lobe, the name without the number.
    """

    name: str
    components: int
    space: Space
    unit: str
    precision: Precision
    part: Literal[
        "", "diffuse", "rough diffuse", "layer", "specular", "bounces", "tangent", "translucent",
        "sheen", "view", "emission", "ambient"
    ]  # fmt: skip
    neutral: tuple[float, ...]
    meaning: str
    lobe: int = 0
    field: str = ""

    @property
    def is_direction(self) -> bool:
        """Whether the values are unit vectors."""
        return self.space == "world"


_SURFACE = (
    Channel("depth", 1, "camera", "m", "float32", "", (0.0,),
            "distance along the caching camera's view axis; 0 where nothing is hit"),
    Channel("material_id", 1, "none", "1", "half", "", (0.0,),
            "1 + index into the manifest's material names; 0 where nothing is hit"),
    Channel("emission", 3, "linear Rec.709", "W/(m2 sr)", "half", "emission", (0.0, 0.0, 0.0),
            "radiance that the surface sends out by itself"),
    Channel("ambient_occlusion", 1, "none", "1", "half", "ambient", (1.0,),
            "share of the cosine-weighted hemisphere about the shading normal that is open"),
)  # fmt: skip

_LOBE = (
    Channel("normal", 3, "world", "1", "half", "", (0.0, 0.0, 1.0),
            "unit shading normal, bump and normal maps in it"),
    Channel("diffuse_color", 3, "linear Rec.709", "1", "half", "diffuse", (0.0, 0.0, 0.0),
            "albedo of the diffuse base"),
    Channel("diffuse_roughness", 1, "none", "1", "half", "diffuse", (0.0,),
            "roughness of the diffuse base; 0 is Lambert's. Minnaert's exponent where that is it"),
    Channel("diffuse_model", 1, "none", "1", "half", "diffuse", (0.0,),
            "model of the diffuse base: 0 Cycles' (Oren-Nayar), 1 Minnaert"),
    Channel("diffuse_share", 1, "none", "1", "half", "rough diffuse", (1.0,),
            "weight in diffuse_color; what bounces in a rough base depends on the colour without"),
    Channel("layer_f0", 1, "none", "1", "half", "layer", (0.0,),
            "reflectance at normal incidence of the dielectric layer over the diffuse base"),
    Channel("layer_f90", 1, "none", "1", "half", "layer", (0.0,),
            "the same layer's reflectance at grazing incidence"),
    Channel("specular_f0", 3, "linear Rec.709", "1", "half", "specular", (0.0, 0.0, 0.0),
            "microfacet reflectance at normal incidence"),
    Channel("specular_f90", 3, "linear Rec.709", "1", "half", "specular", (0.0, 0.0, 0.0),
            "microfacet reflectance at grazing incidence"),
    Channel("dielectric", 1, "none", "1", "half", "specular", (0.0,),
            "weight of the layer itself in the specular lobe: that part follows Fresnel's curve"),
    Channel("specular_dip", 3, "linear Rec.709", "1", "half", "specular", (0.0, 0.0, 0.0),
            "how much a metal's edge tint takes from the reflectance near grazing incidence"),
    Channel("roughness", 1, "none", "1", "half", "specular", (1.0,),
            "Blender's roughness; alpha is its square"),
    Channel("specular_share", 1, "none", "1", "half", "bounces", (1.0,),
            "weight in the specular colours; what bounces between facets depends on them without"),
    Channel("distribution", 1, "none", "1", "half", "specular", (0.0,),
            "microfacet distribution: 0 multiscatter GGX, 1 GGX, 2 Beckmann, 3 Ashikhmin-Shirley; "
            "4 Phong, 5 Blinn, 6 Cook-Torrance"),
    Channel("aspect", 1, "none", "1", "half", "specular", (1.0,),
            "what alpha is divided by along the tangent, and multiplied with across it"),
    Channel("tangent", 3, "world", "1", "half", "tangent", (1.0, 0.0, 0.0),
            "unit vector along the surface, of an anisotropic lobe"),
    Channel("translucent_color", 3, "linear Rec.709", "1", "half", "translucent", (0.0, 0.0, 0.0),
            "albedo of light that comes diffusely through from behind"),
    Channel("sheen_color", 3, "linear Rec.709", "1", "half", "sheen", (0.0, 0.0, 0.0),
            "weight of the microfiber sheen"),
    Channel("sheen_roughness", 1, "none", "1", "half", "sheen", (0.0,),
            "its roughness"),
    Channel("view_base", 1, "none", "1", "half", "view", (1.0,),
            "weight of the lobe where the view's curve is 0"),
    Channel("view_slope", 1, "none", "1", "half", "view", (0.0,),
            "how much the view's curve adds to that weight where it is 1"),
    Channel("view_curve", 1, "none", "1", "half", "view", (0.0,),
            "the view's curve: 0 none, 1 Fresnel, 2 facing, 3 the albedo of a coat, 4 of a sheen"),
    Channel("view_parameter", 1, "none", "1", "half", "view", (0.0,),
            "the curve's F0 (Fresnel, coat) or exponent (facing)"),
    Channel("view_roughness", 1, "none", "1", "half", "view", (0.0,),
            "roughness of the coat or sheen whose albedo is the curve"),
)  # fmt: skip


def lobe_channel(field: str, lobe: int) -> str:
    """The name of a lobe's channel; lobes count from 1."""
    return field if lobe == 1 else f"{field}_{lobe}"


def _of_lobe(lobe: int) -> tuple[Channel, ...]:
    return tuple(
        replace(channel, name=lobe_channel(channel.name, lobe), lobe=lobe, field=channel.name)
        for channel in _LOBE
    )


def channels_of(lobes: int) -> tuple[Channel, ...]:
    """The table for materials of so many lobes, in the order in which channels are stored."""
    first, second = _SURFACE[:2], _SURFACE[2:]
    return (*first, *(c for lobe in range(1, lobes + 1) for c in _of_lobe(lobe)), *second)


# The table for one lobe, as the manual has it, and all that there can be.
CHANNELS = channels_of(1)
ALL_CHANNELS = channels_of(MAX_LOBES)

CHANNEL_BY_NAME = {channel.name: channel for channel in ALL_CHANNELS}

# Fields of a lobe in the table's order.
LOBE_FIELDS = tuple(channel.name for channel in _LOBE)
