# SPDX-License-Identifier: GPL-3.0-or-later
"""Waiting for the GPU: drawing commands return before anything is drawn."""

from __future__ import annotations

from ...glsl.shader import Texture, framebuffer, read_texture, texture_2d
from .sum_pass import Addend, SumPass


class Fence:
    """Waits until a texture is drawn. Blender's `gpu` module has no call for that."""

    def __init__(self) -> None:
        self._pixel = texture_2d(1, 1)
        self._target = framebuffer([self._pixel])
        self._copy = SumPass()

    def wait(self, texture: Texture) -> None:
        """Copy one pixel of a texture and read that: it comes after all that drew the texture."""
        self._copy.draw([Addend(texture)], self._target)
        read_texture(self._pixel)
