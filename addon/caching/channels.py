# SPDX-License-Identifier: GPL-3.0-or-later
"""The channel table: everything that a deep framebuffer can hold, said once.

The AOV set-up, the EXR files, the GPU textures, the GLSL that unpacks them and the manual's
table are made from it.

A material is cached as one sum of lobes that is linear in what is stored, so that a mix of
materials is the mix of their channels:

    f = diffuse_color / pi * (1 - layer(NoV)) + D G F(LoH) / (4 NoV NoL) * multiscatter
    F(LoH)     = specular_f0 + (specular_f90 - specular_f0) * s(LoH)
    layer(NoV) = layer_f0 * A(NoV, roughness) + layer_f90 * B(NoV, roughness)

with D and G of GGX, alpha = roughness^2, and A, B the two terms of the split-sum directional
albedo. s is the Schlick weight (1 - LoH)^5, but for the share of the specular lobe that is the
dielectric layer, where it follows the exact Fresnel equations, as in Cycles. `layer` is the
light that a dielectric coat over the diffuse lobe keeps from it (Principled BSDF; zero under a
plain Diffuse BSDF).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Space = Literal["linear Rec.709", "world", "camera", "none"]
Precision = Literal["float32", "half"]


@dataclass(frozen=True)
class Channel:
    """One quantity of the surface seen at a texel's centre.

    Attributes:
        name: used in Python, in GLSL, on disk and in the manual.
        components: 1 or 3.
        space: the colour or vector space of the values.
        unit: physical unit, "1" for pure numbers.
        precision: on disk and on the GPU, where it holds the values (see `precision`).
        lobe: the lobe that reads it, or "" for those that every scene needs.
        neutral: the value that makes the channel do nothing.
        meaning: one line for the manual.
    """

    name: str
    components: int
    space: Space
    unit: str
    precision: Precision
    lobe: Literal["", "diffuse", "layer", "specular", "emission", "ambient"]
    neutral: tuple[float, ...]
    meaning: str


CHANNELS: tuple[Channel, ...] = (
    Channel("depth", 1, "camera", "m", "float32", "", (0.0,),
            "distance along the caching camera's view axis; 0 where nothing is hit"),
    Channel("material_id", 1, "none", "1", "half", "", (0.0,),
            "1 + index into the manifest's material names; 0 where nothing is hit"),
    Channel("normal", 3, "world", "1", "half", "", (0.0, 0.0, 1.0),
            "unit shading normal, bump and normal maps in it"),
    Channel("diffuse_color", 3, "linear Rec.709", "1", "half", "diffuse", (0.0, 0.0, 0.0),
            "albedo of the Lambert lobe"),
    Channel("layer_f0", 1, "none", "1", "half", "layer", (0.0,),
            "reflectance at normal incidence of the dielectric layer over the diffuse lobe"),
    Channel("layer_f90", 1, "none", "1", "half", "layer", (0.0,),
            "the same layer's reflectance at grazing incidence"),
    Channel("specular_f0", 3, "linear Rec.709", "1", "half", "specular", (0.0, 0.0, 0.0),
            "microfacet reflectance at normal incidence"),
    Channel("specular_f90", 3, "linear Rec.709", "1", "half", "specular", (0.0, 0.0, 0.0),
            "microfacet reflectance at grazing incidence"),
    Channel("roughness", 1, "none", "1", "half", "specular", (1.0,),
            "Blender's roughness; alpha is its square"),
    Channel("emission", 3, "linear Rec.709", "W/(m2 sr)", "float32", "emission", (0.0, 0.0, 0.0),
            "radiance that the surface sends out by itself"),
    Channel("ambient_occlusion", 1, "none", "1", "half", "ambient", (1.0,),
            "share of the cosine-weighted hemisphere about the shading normal that is open"),
)  # fmt: skip

CHANNEL_BY_NAME = {channel.name: channel for channel in CHANNELS}
