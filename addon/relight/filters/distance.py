# SPDX-License-Identifier: GPL-3.0-or-later
"""How light depends on the distance: distance_filter.glsl, falloff_filter.glsl."""

from __future__ import annotations

import numpy as np

from ...glsl.uniforms import Field
from ...scene.light import Light
from .light_filter import LightFilter

# Farther than anything, and finite.
_ENDLESS = float(np.finfo(np.float32).max)

_RANGE_FIELDS = (Field("vec4", "distance_range"), Field("float", "distance_along_axis"))
_FALLOFF_FIELDS = (Field("float", "falloff_power"), Field("float", "falloff_distance"))

# Of the distance in the strength of a point light.
_PHYSICAL = 2.0


def distance_filter(light: Light) -> LightFilter | None:
    """Where the light's range begins and ends; None if it does neither."""
    ends = light.controls.distance
    if ends is None:
        return None
    begins = ends.near > 0.0 or ends.near_edge > 0.0
    if not begins and ends.far >= _ENDLESS:
        return None
    near = ends.near if begins else -_ENDLESS
    values = {
        "distance_range": (near, ends.near_edge, min(ends.far, _ENDLESS), ends.far_edge),
        "distance_along_axis": float(ends.along_axis),
    }
    return LightFilter("distance", _RANGE_FIELDS, values)


def falloff_filter(light: Light) -> LightFilter | None:
    """The light's own falloff; None if it is the physical one, and for a sun, which has none."""
    falloff = light.controls.falloff
    if falloff is None or falloff.exponent == _PHYSICAL or light.type == "SUN":
        return None
    values = {
        "falloff_power": _PHYSICAL - falloff.exponent,
        "falloff_distance": falloff.distance,
    }
    return LightFilter("falloff", _FALLOFF_FIELDS, values)
