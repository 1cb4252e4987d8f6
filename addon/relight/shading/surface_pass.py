# SPDX-License-Identifier: GPL-3.0-or-later
"""How this room's passes read a `SurfaceBuffer`, and the pass that shows what glows by itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import PassShader
from ...glsl.uniforms import Field, UniformBlock
from .blend_pass import add_fullscreen

VIEW_BLOCK = UniformBlock("view", (Field("vec4", "eye"), Field("int", "stride")))


def view_uniforms(surface: SurfaceBuffer, stride: int) -> dict[str, Any]:
    """The values of VIEW_BLOCK; a pixel of the target covers stride x stride of the surfaces'."""
    return {"eye": np.append(surface.eye, float(surface.perspective)), "stride": stride}


_SCALE_BLOCK = UniformBlock("scale", (Field("vec4", "factor"), Field("int", "stride")))


# What reads a `SurfaceBuffer`, before what shades it.
SURFACE_LIBRARY = ("material_table", "surface_texel", "surface", "angle")


class EmissionPass:
    """Adds the radiance that surfaces send out by themselves.

    Args:
        layout: of the surfaces.
    """

    def __init__(self, layout: SurfaceLayout) -> None:
        self._program = PassShader(
            name="emission",
            fragment="emission",
            library=SURFACE_LIBRARY,
            generated=layout.read_glsl(),
            blocks=(_SCALE_BLOCK,),
            samplers=layout.samplers,
            outputs=(("VEC4", "radiance"),),
            defines=layout.defines,
        ).build()

    def draw(
        self, surface: SurfaceBuffer, target: Any, weight: float = 1.0, stride: int = 1
    ) -> None:
        """Add `weight` times the emission to the framebuffer; alpha is left as it is."""
        scale = {"factor": (weight, weight, weight, 0.0), "stride": stride}
        add_fullscreen(self._program, target, surface.textures(), {"scale": scale})
