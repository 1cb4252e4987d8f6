# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's own nodes emit by direction: addon/glsl/lib/profile_filter.glsl."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...glsl.shader import texture_from_array
from ...glsl.uniforms import Field
from ...scene.light import Light
from ...scene.light_profile import LightProfile
from ...scene.same import is_same
from ..light_points.light_sample import light_sample
from .light_filter import LightFilter

_FIELDS = (
    Field("float", "profile_half_width"),
    Field("float", "profile_exponent"),
    Field("float", "profile_smooth"),
)
_AREA_FIELDS = (
    Field("vec4", "area_profile_u"),
    Field("vec4", "area_profile_v"),
    Field("vec4", "area_profile_evened"),
    Field("float", "area_profile_level"),
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
    """The same with where the light's sides lie, in light space, and what its samples see."""
    sides = light.extents @ light.axes.T / np.sum(light.extents**2, axis=1)[:, None]
    place = {
        "area_profile_u": np.append(sides[0], 0.0),
        "area_profile_v": np.append(sides[1], 0.0),
    }

    @cache
    def by_count(count: int) -> Mapping[str, Any]:
        level, factor = evened_samples(light, count)
        return {
            "area_profile_evened": np.append(factor, 0.0),
            "area_profile_level": float(level),
        }

    return replace(made, values={**made.values, **place}, by_count=by_count)


def evened_samples(light: Light, count: int) -> tuple[int, NDArray[np.float64]]:
    """How an area light's samples read what it emits at its places.

    Returns:
        level of the pyramid whose texels are about what one of `count` samples stands for, and
        (3,) what brings the mean of all of them to the picture's.
    """
    assert light.profile is not None
    assert light.profile.over_area is not None
    levels = _levels(light.profile.over_area.astype(np.float64))
    level = int(np.clip(np.floor(np.log2(len(levels[0]) / np.sqrt(count))), 0, len(levels) - 1))
    if count == 1:
        level = len(levels) - 1
    points = np.stack([light_sample(light, k, count).position for k in range(count)])
    from_centre = points - light.position
    uv = 0.5 + from_centre @ light.extents.T / np.sum(light.extents**2, axis=1)
    seen = _bilinear(levels[level], uv).mean(axis=0)
    mean = levels[-1][0, 0] if not light.is_round else _mean_of_disk(levels[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(seen > 0.0, mean / seen, 1.0)
    # A small bright spot that no sample is near is not made up for by another.
    return level, np.clip(factor, 0.5, 2.0)


def _mean_of_disk(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    place = (np.arange(len(pixels)) + 0.5) / len(pixels) - 0.5
    inside = np.hypot(*np.meshgrid(place, place)) <= 0.5
    return np.asarray(pixels[inside].mean(axis=0))


def _bilinear(pixels: NDArray[np.float64], uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 3) at (K, 2) places from 0 to 1."""
    side = len(pixels)
    at = np.clip(uv, 0.0, 1.0) * side - 0.5
    low = np.floor(at).astype(np.int64)
    total = np.zeros((len(uv), 3))
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.abs(1 - dx - (at - low)[:, 0]) * np.abs(1 - dy - (at - low)[:, 1])
            texel = np.clip(low + np.array([dx, dy]), 0, side - 1)
            total += weight[:, None] * pixels[texel[:, 1], texel[:, 0]]
    return total


def _levels(pixels: NDArray[Any]) -> list[NDArray[Any]]:
    """The picture, one of half the size, and so on up to its mean."""
    levels = [pixels]
    while len(levels[-1]) > 1:
        half = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(half, 2, half, 2, 3).mean(axis=(1, 3)))
    return levels


def _pyramid(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """(2 N - 1, N, 3): the levels above each other."""
    side = len(pixels)
    widened = [np.pad(level, ((0, 0), (0, side - len(level)), (0, 0))) for level in _levels(pixels)]
    return np.concatenate(widened).astype(np.float32)


def _upload(pixels: NDArray[np.float32]) -> Any:
    alpha = np.ones_like(pixels[..., :1])
    return texture_from_array(np.concatenate([pixels, alpha], axis=-1), "RGBA32F")
