# SPDX-License-Identifier: GPL-3.0-or-later
"""From shaded samples to pixels: each pixel's list, weighted and added up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...corrmap.pixel_list_pass import PixelListTextures
from ...glsl.shader import PassShader, Texture, framebuffer, texture_2d
from ...glsl.uniforms import Field, UniformBlock
from ..shading.blend_pass import add_fullscreen
from .layer_stack import LightLayer

_RESOLVE = PassShader(
    name="resolve",
    fragment="resolve",
    samplers=(
        ("shaded", "FLOAT_2D"),
        ("list_place", "FLOAT_2D"),
        ("list_entries", "FLOAT_2D"),
    ),
    outputs=(("VEC4", "radiance"),),
)
_LAYERED = replace(
    _RESOLVE,
    name="resolve_layers",
    blocks=(UniformBlock("layers", (Field("float", "cover"),)),),
    defines=(("HAS_LAYERS", "1"),),
)


class ResolvePass:
    """Adds samples to layers by way of the indirect framebuffer.

    Attributes:
        shaded: the atlas that was shaded last, RGBA32F, one texture for each part of its layer.
    """

    def __init__(self) -> None:
        self.shaded: tuple[Texture, ...] = ()
        self._target: Any = None

    def draw(
        self,
        layer: LightLayer,
        lists: PixelListTextures,
        height: int,
        shade: Callable[[Any], None],
        *,
        cover: float = 0.0,
    ) -> None:
        """Shade the atlas of a view and add what its pixels make of it to a layer.

        Args:
            layer: what is added to, as large as the picture.
            lists: the pixels' lists.
            height: of the atlas; it is as wide as the picture.
            shade: adds to a framebuffer of the atlas' size with as many textures as the layer.
            cover: 1 if the layer's alpha says what is covered, else 0.
        """
        tinted = lists.lists.is_tinted
        program = (_LAYERED if tinted else _RESOLVE).build()
        uniforms = {"layers": {"cover": cover}} if tinted else {}
        size = (lists.lists.width, height, len(layer.textures))
        known = self.shaded[0] if self.shaded else None
        if known is None or (known.width, known.height, len(self.shaded)) != size:
            self.shaded = tuple(texture_2d(*size[:2]) for _ in range(size[2]))
            self._target = framebuffer(self.shaded)
        with self._target.bind():
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))
        shade(self._target)
        for shaded, texture in zip(self.shaded, layer.textures, strict=True):
            target = layer.target if len(layer.textures) == 1 else framebuffer([texture])
            textures = {"shaded": shaded, **lists.textures()}
            add_fullscreen(program, target, textures, uniforms)
