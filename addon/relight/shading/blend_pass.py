# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding to pictures: the passes of this room add to what is there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gpu

from ...glsl.shader import ShaderProgram


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
