# SPDX-License-Identifier: GPL-3.0-or-later
"""How this room's passes read a `SurfaceBuffer`, and the pass that shows what glows by itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..corrmap.surface_buffer import SurfaceBuffer
from ..glsl.shader import PassShader, SamplerType
from ..glsl.uniforms import Field, UniformBlock
from .blend_pass import add_fullscreen

VIEW_BLOCK = UniformBlock("view", (Field("vec4", "eye"),))

# All that lights a surface needs; what it emits by itself has a pass of its own.
LIT_SAMPLERS: tuple[tuple[str, SamplerType], ...] = (
    ("surface_position", "FLOAT_2D"),
    ("surface_geometric_normal", "FLOAT_2D"),
    ("surface_shading", "FLOAT_2D"),
    ("surface_diffuse", "FLOAT_2D"),
    ("surface_specular_f0", "FLOAT_2D"),
    ("surface_specular_f90", "FLOAT_2D"),
)


def lit_textures(surface: SurfaceBuffer) -> dict[str, Any]:
    """The textures of LIT_SAMPLERS."""
    textures = surface.textures()
    return {name: textures[name] for name, _ in LIT_SAMPLERS}


def view_uniforms(surface: SurfaceBuffer) -> dict[str, Any]:
    """The values of VIEW_BLOCK."""
    return {"eye": np.append(surface.eye, float(surface.perspective))}


_SCALE_BLOCK = UniformBlock("scale", (Field("vec4", "factor"),))

_EMISSION_PASS = PassShader(
    name="emission",
    fragment="emission",
    blocks=(_SCALE_BLOCK,),
    samplers=(("surface_position", "FLOAT_2D"), ("surface_emission", "FLOAT_2D")),
    outputs=(("VEC4", "radiance"),),
)


class EmissionPass:
    """Adds the radiance that surfaces send out by themselves."""

    def __init__(self) -> None:
        self._program = _EMISSION_PASS.build()

    def draw(self, surface: SurfaceBuffer, target: Any, weight: float = 1.0) -> None:
        """Add `weight` times the emission to the framebuffer; alpha is left as it is."""
        textures = {
            "surface_position": surface.position,
            "surface_emission": surface.emission,
        }
        scale = {"factor": (weight, weight, weight, 0.0)}
        add_fullscreen(self._program, target, textures, {"scale": scale})
