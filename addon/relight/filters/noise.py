# SPDX-License-Identifier: GPL-3.0-or-later
"""Uneven light: addon/glsl/lib/noise_filter.glsl."""

from __future__ import annotations

from ...glsl.uniforms import Field
from ...scene.light import Light
from .light_filter import LightFilter

_FIELDS = (
    Field("vec4", "noise_placing"),
    Field("float", "noise_amount"),
    Field("float", "noise_detail"),
    Field("float", "noise_roughness"),
    Field("float", "noise_projected"),
)


def noise_filter(light: Light) -> LightFilter | None:
    """The light's noise; None if it has none."""
    noise = light.controls.noise
    if noise is None or noise.amount == 0.0:
        return None
    values = {
        "noise_placing": (*noise.offset, noise.scale),
        "noise_amount": noise.amount,
        "noise_detail": min(max(noise.detail, 0.0), 15.0),
        "noise_roughness": max(noise.roughness, 0.0),
        "noise_projected": float(noise.projected),
    }
    return LightFilter("noise", _FIELDS, values, library=("perlin",))
