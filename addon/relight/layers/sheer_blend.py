# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures without lists: what lies behind sheer layers is shaded, dimmed by them, and added."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import PassShader, Texture, framebuffer, texture_2d
from ...glsl.uniforms import Field, UniformBlock
from ..shading.blend_pass import add_fullscreen
from .layer_stack import LightLayer

_PASS = PassShader(
    name="let_through",
    fragment="let_through",
    blocks=(UniformBlock("part", (Field("int", "stride"), Field("float", "cover"))),),
    samplers=(("shaded", "FLOAT_2D"), ("through", "FLOAT_2D")),
    outputs=(("VEC4", "radiance"),),
)


class SheerBlend:
    """Adds samples of a view with sheer layers to a light's layer."""

    def __init__(self) -> None:
        self._shaded: tuple[Texture, ...] = ()
        self._target: Any = None

    def draw(
        self,
        layer: LightLayer,
        surface: SurfaceBuffer,
        shade: Callable[[SurfaceBuffer, Any], None],
        *,
        stride: int,
        cover: float,
    ) -> None:
        """Shade what is opaque and the layers before it.

        Args:
            layer: what is added to.
            surface: what is opaque.
            shade: adds what a surface sends out to a framebuffer as large as the layer.
            stride: view pixels along the side of one of the layer's.
            cover: 1 if the layer's alpha says what is covered, else 0.
        """
        for each in (*surface.before, surface):
            if each.through is None:
                shade(each, layer.target)
                continue
            target = self._cleared(layer)
            shade(each, target)
            share = 0.0 if each.is_layer else cover
            for shaded, texture in zip(self._shaded, layer.textures, strict=True):
                one = layer.target if len(layer.textures) == 1 else framebuffer([texture])
                add_fullscreen(
                    _PASS.build(),
                    one,
                    {"shaded": shaded, "through": each.through},
                    {"part": {"stride": stride, "cover": share}},
                )

    def _cleared(self, layer: LightLayer) -> Any:
        """A framebuffer of the layer's form."""
        first = layer.textures[0]
        size = (first.width, first.height, len(layer.textures))
        known = self._shaded[0] if self._shaded else None
        if known is None or (known.width, known.height, len(self._shaded)) != size:
            self._shaded = tuple(texture_2d(*size[:2]) for _ in range(size[2]))
            self._target = framebuffer(self._shaded)
        with self._target.bind():
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))
        return self._target
