# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding to pictures: every pass of this room adds to what is there; layers are summed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gpu

from ..glsl.shader import PassShader, ShaderProgram
from ..glsl.uniforms import Field, UniformBlock


def add_fullscreen(
    program: ShaderProgram,
    target: Any,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
) -> None:
    """Run a pass over every pixel and add what it gives, alpha too, to the framebuffer."""
    gpu.state.blend_set("ADDITIVE_PREMULT")
    try:
        program.draw_fullscreen(target, textures, uniforms)
    finally:
        gpu.state.blend_set("NONE")


_SCALE_BLOCK = UniformBlock("scale", (Field("vec4", "factor"), Field("int", "stride")))

_SUM_PASS = PassShader(
    name="sum_layers",
    fragment="scaled_copy",
    blocks=(_SCALE_BLOCK,),
    samplers=(("source", "FLOAT_2D"),),
    outputs=(("VEC4", "radiance"),),
)


class SumPass:
    """Sums layers."""

    def __init__(self) -> None:
        self._program = _SUM_PASS.build()

    def add(
        self,
        layer: Any,
        target: Any,
        factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
        stride: int = 1,
    ) -> None:
        """Add `factor` (r, g, b, a) times one texture to the framebuffer.

        A pixel of the texture covers stride x stride of the framebuffer's.
        """
        scale = {"factor": factor, "stride": stride}
        add_fullscreen(self._program, target, {"source": layer}, {"scale": scale})

    def draw(self, layers: Sequence[Any], target: Any) -> None:
        """Replace the framebuffer's colour with the sum of the layers, in their order."""
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0))
        for layer in layers:
            self.add(layer, target)
