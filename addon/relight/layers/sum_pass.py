# SPDX-License-Identifier: GPL-3.0-or-later
"""The sum of pictures, each times a factor, with as few passes as there can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gpu
import numpy as np

from ...glsl.shader import PassShader, Samplers, ShaderProgram, Texture
from ...glsl.uniforms import Field, UniformBlock
from ..shading.blend_pass import add_fullscreen

# Pictures that one pass adds up: few enough for every GPU, and each pass more reads and writes the
# target once more.
_AT_ONCE = 8

_SUM_BLOCK = UniformBlock(
    "sums", (Field("vec4", "factor", _AT_ONCE), Field("ivec4", "shift", _AT_ONCE))
)


@dataclass(frozen=True)
class Addend:
    """One picture in a sum.

    Attributes:
        texture: any float format.
        factor: (r, g, b, a) that it is multiplied with.
        stride: pixels of the sum along the side of one of its pixels; a power of two.
    """

    texture: Texture
    factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    stride: int = 1


class SumPass:
    """Sums pictures."""

    def __init__(self) -> None:
        self._programs: dict[int, ShaderProgram] = {}

    def draw(self, addends: Sequence[Addend], target: Any) -> None:
        """Replace a framebuffer's colour and alpha with the sum, added in the order given."""
        if not addends:
            with target.bind():
                target.clear(color=(0.0, 0.0, 0.0, 0.0))
        for start in range(0, len(addends), _AT_ONCE):
            some = addends[start : start + _AT_ONCE]
            program = self._program(len(some))
            textures = {f"layer_{k}": each.texture for k, each in enumerate(some)}
            shift = np.zeros((len(some), 4), dtype=np.int32)
            shift[:, 0] = [each.stride.bit_length() - 1 for each in some]
            uniforms = {
                "sums": {"factor": np.array([each.factor for each in some]), "shift": shift}
            }
            if start:
                add_fullscreen(program, target, textures, uniforms)
            else:
                gpu.state.blend_set("NONE")
                program.draw_fullscreen(target, textures, uniforms)

    def _program(self, count: int) -> ShaderProgram:
        if count not in self._programs:
            self._programs[count] = _describe(count).build()
        return self._programs[count]


def _describe(count: int) -> PassShader:
    samplers: Samplers = tuple((f"layer_{k}", "FLOAT_2D") for k in range(count))
    return PassShader(
        name=f"sum_{count}",
        fragment="sum_layers",
        blocks=(_SUM_BLOCK,),
        samplers=samplers,
        outputs=(("VEC4", "radiance"),),
        generated="\n".join(
            [
                "vec4 sum_of_layers(ivec2 pixel)",
                "{",
                "  vec4 sum = vec4(0.0);",
                *(
                    f"  sum += sums.factor[{k}] * "
                    f"texelFetch(layer_{k}, pixel >> sums.shift[{k}].x, 0);"
                    for k in range(count)
                ),
                "  return sum;",
                "}",
                "",
            ]
        ),
    )
