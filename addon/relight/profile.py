# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's own nodes emit by direction: addon/glsl/lib/profile_filter.glsl."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..glsl.shader import texture_from_array
from ..glsl.uniforms import Field
from ..scene.light import Light
from ..scene.light_profile import LightProfile
from ..scene.same import is_same
from .light_filter import LightFilter

_FIELDS = (
    Field("float", "profile_half_width"),
    Field("float", "profile_exponent"),
    Field("float", "profile_smooth"),
)


class ProfileFilters:
    """Makes the filters of lights' nodes; keeps each light's, as its table is large."""

    def __init__(self) -> None:
        self._made: dict[str, tuple[LightProfile, LightFilter]] = {}

    def of(self, light: Light) -> LightFilter | None:
        """What the light's nodes emit; None if that is the same all around."""
        profile = light.profile
        if profile is None or light.type == "SUN":
            self.forget(light.name)
            return None
        known = self._made.get(light.name)
        if known is None or not is_same(known[0], profile):
            self._made[light.name] = known = (profile, _profile_filter(profile))
        return known[1]

    def forget(self, name: str) -> None:
        """A light is gone."""
        self._made.pop(name, None)


def _profile_filter(profile: LightProfile) -> LightFilter:
    return LightFilter(
        "profile",
        _FIELDS,
        {
            "profile_half_width": profile.half_width,
            "profile_exponent": profile.exponent,
            "profile_smooth": profile.smooth,
        },
        samplers=(("profile_picture", "FLOAT_2D"),),
        textures={"profile_picture": _upload(profile)},
    )


def _upload(profile: LightProfile) -> Any:
    alpha = np.ones_like(profile.pixels[..., :1])
    return texture_from_array(np.concatenate([profile.pixels, alpha], axis=-1), "RGBA32F")
