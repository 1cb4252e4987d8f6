# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of surfaces that were gathered several times."""

from __future__ import annotations

from dataclasses import replace

from ..glsl.shader import MAX_COLOR_SLOTS, PassShader, ShaderProgram, framebuffer, texture_2d
from ..glsl.uniforms import Field, UniformBlock
from .surface_buffer import SurfaceBuffer
from .surface_layout import SurfaceLayout

_MEAN_BLOCK = UniformBlock("mean", (Field("float", "share"),))


class MeanPass:
    """Turns sums of gathered surfaces into means."""

    def __init__(self, layout: SurfaceLayout) -> None:
        self._layout = layout

    def draw(self, total: SurfaceBuffer, share: float) -> SurfaceBuffer:
        """The surfaces with their values multiplied by `share`, directions unit."""
        names = self._layout.value_names
        values = tuple(texture_2d(total.width, total.height) for _ in names)
        textures = {f"sum_{name}": t for name, t in zip(names, total.values, strict=True)}
        textures["surface_geometric_normal"] = total.geometric_normal
        for start in range(0, len(names), MAX_COLOR_SLOTS):
            some = slice(start, start + MAX_COLOR_SLOTS)
            target = framebuffer(values[some])
            self._program(names[some]).draw_fullscreen(target, textures, {"mean": {"share": share}})
        return replace(total, values=values)

    def _program(self, outputs: tuple[str, ...]) -> ShaderProgram:
        names = self._layout.value_names
        unread = "".join(f"vec4 {name};\n" for name in names if name not in outputs)
        return PassShader(
            name="mean_surface",
            fragment="mean_surface",
            generated=unread + self._layout.mean_glsl(),
            blocks=(_MEAN_BLOCK,),
            samplers=(
                ("surface_geometric_normal", "FLOAT_2D"),
                *((f"sum_{name}", "FLOAT_2D") for name in names),
            ),
            outputs=tuple(("VEC4", name) for name in outputs),
        ).build()
