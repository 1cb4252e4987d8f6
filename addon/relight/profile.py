# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's own nodes emit by direction: addon/glsl/lib/profile_filter.glsl."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
_AREA_FIELDS = (
    Field("vec4", "profile_u"),
    Field("vec4", "profile_v"),
    Field("float", "profile_area"),
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
        made = known[1]
        return made if profile.over_area is None else _placed(made, light)

    def forget(self, name: str) -> None:
        """A light is gone."""
        self._made.pop(name, None)


def _profile_filter(profile: LightProfile) -> LightFilter:
    textures = {"profile_picture": _upload(profile.pixels)}
    if profile.over_area is not None:
        textures["profile_over_area"] = _upload(_pyramid(profile.over_area))
    return LightFilter(
        "profile" if profile.over_area is None else "area_profile",
        _FIELDS if profile.over_area is None else (*_FIELDS, *_AREA_FIELDS),
        {
            "profile_half_width": profile.half_width,
            "profile_exponent": profile.exponent,
            "profile_smooth": profile.smooth,
        },
        samplers=tuple((name, "FLOAT_2D") for name in textures),
        textures=textures,
        library=() if profile.over_area is None else ("profile_filter",),
    )


def _placed(made: LightFilter, light: Light) -> LightFilter:
    """The same with where the light's sides lie, in light space."""
    sides = light.extents @ light.axes.T / np.sum(light.extents**2, axis=1)[:, None]
    place = {
        "profile_u": np.append(sides[0], 0.0),
        "profile_v": np.append(sides[1], 0.0),
        "profile_area": light.area,
    }
    return replace(made, values={**made.values, **place})


def _pyramid(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """(2 N - 1, N, 3): the picture, above it one of half the size, and so on up to its mean."""
    side = len(pixels)
    levels = [pixels]
    while len(levels[-1]) > 1:
        half = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(half, 2, half, 2, 3).mean(axis=(1, 3)))
    widened = [np.pad(level, ((0, 0), (0, side - len(level)), (0, 0))) for level in levels]
    return np.concatenate(widened).astype(np.float32)


def _upload(pixels: NDArray[np.float32]) -> Any:
    alpha = np.ones_like(pixels[..., :1])
    return texture_from_array(np.concatenate([pixels, alpha], axis=-1), "RGBA32F")
