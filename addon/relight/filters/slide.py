# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture in a light's beam: addon/glsl/lib/slide_filter.glsl."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...glsl.shader import max_texture_width, texture_from_array
from ...glsl.uniforms import Field
from ...scene.light import Light
from ...scene.light_controls import Slide
from ...scene.same import is_same
from .light_filter import LightFilter
from .slide_picture import slide_picture

_FIELDS = (
    Field("vec4", "slide_u"),
    Field("vec4", "slide_v"),
    Field("float", "slide_repeat"),
    Field("float", "slide_outside"),
    Field("float", "slide_behind"),
)

# The largest number that half precision holds, with room for rounding.
_LARGEST_HALF = 6.5e4


class SlideFilters:
    """Makes the filters of lights' slides; keeps each light's, as its picture takes a while."""

    def __init__(self) -> None:
        self._made: dict[str, tuple[Slide, LightFilter]] = {}

    def of(self, light: Light) -> LightFilter | None:
        """The light's slide; None if it has none, or one that lets all through."""
        slide = light.controls.slide
        if slide is None or slide.density == 0.0 or slide.pixels.size == 0:
            self.forget(light.name)
            return None
        known = self._made.get(light.name)
        if known is None or not is_same(known[0], slide):
            self._made[light.name] = known = (slide, _slide_filter(slide))
        return known[1]

    def forget(self, name: str) -> None:
        """A light is gone."""
        self._made.pop(name, None)


def _slide_filter(slide: Slide) -> LightFilter:
    picture = slide_picture(slide)
    cosine, sine = np.cos(slide.rotation), np.sin(slide.rotation)
    u = np.array([cosine, sine]) / picture.scale[0]
    v = np.array([-sine, cosine]) / picture.scale[1]
    values = {
        "slide_u": (*u, 0.5 - u @ slide.offset, 0.0),
        "slide_v": (*v, 0.5 - v @ slide.offset, 0.0),
        "slide_repeat": float(slide.repeat),
        "slide_outside": picture.outside,
        "slide_behind": picture.behind,
    }
    return LightFilter(
        "slide",
        _FIELDS,
        values,
        samplers=(("slide_picture", "FLOAT_2D"),),
        textures={"slide_picture": _upload(picture.pixels)},
        library=("beam",),
    )


def _upload(pixels: NDArray[np.float32]) -> Any:
    """As a texture. One that is larger than this GPU's textures loses its finest detail."""
    most = max_texture_width()
    while max(pixels.shape[:2]) > most:
        even = pixels[: pixels.shape[0] // 2 * 2, : pixels.shape[1] // 2 * 2]
        halves = (even[y::2, x::2] for y in (0, 1) for x in (0, 1))
        pixels = 0.25 * np.add.reduce(list(halves))
    rgba = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=-1)
    return texture_from_array(rgba, "RGBA16F" if pixels.max() < _LARGEST_HALF else "RGBA32F")
