# SPDX-License-Identifier: GPL-3.0-or-later
"""Barn doors before a light: addon/glsl/lib/barn_doors_filter.glsl."""

from __future__ import annotations

import numpy as np

from ...glsl.uniforms import Field
from ...scene.light import Light
from .light_filter import LightFilter
from .outline import outline_sizes

_FIELDS = (
    Field("vec4", "barn_doors_placing"),
    Field("vec4", "barn_doors_outline"),
    Field("float", "barn_doors_roundness"),
    Field("float", "barn_doors_density"),
    Field("float", "barn_doors_invert"),
)


def barn_doors_filter(light: Light) -> LightFilter | None:
    """The light's barn doors; None if it has none, or they take nothing."""
    doors = light.controls.barn_doors
    if doors is None or doors.density == 0.0:
        return None
    turn = (np.cos(doors.rotation), np.sin(doors.rotation))
    values = {
        "barn_doors_placing": (*doors.shear, *turn),
        "barn_doors_outline": outline_sizes(doors.outline),
        "barn_doors_roundness": doors.outline.roundness,
        "barn_doors_density": doors.density,
        "barn_doors_invert": float(doors.invert),
    }
    return LightFilter("barn_doors", _FIELDS, values, library=("beam", "superellipse"))
