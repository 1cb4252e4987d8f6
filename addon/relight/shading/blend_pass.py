# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding to pictures: the passes of this room add to what is there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...glsl.shader import ShaderProgram, adding


def add_fullscreen(
    program: ShaderProgram,
    target: Any,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
) -> None:
    """Run a pass over every pixel and add what it gives, alpha too, to the framebuffer."""
    with adding():
        program.draw_fullscreen(target, textures, uniforms)
