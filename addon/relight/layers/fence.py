# SPDX-License-Identifier: GPL-3.0-or-later
"""Waiting for the GPU: drawing commands return before anything is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...glsl.shader import Texture, framebuffer, read_texture, texture_2d
from .sum_pass import Addend, SumPass


class Fence:
    """Waits until a texture is drawn. Blender's `gpu` module has no call for that."""

    def __init__(self) -> None:
        self._pixel = texture_2d(1, 1)
        self._target = framebuffer([self._pixel])
        self._copy = SumPass()

    def begin(self) -> None:
        """Let the GPU begin with what was drawn into other targets, and go on meanwhile.

        Nothing more is added to a target that is bound no more. Reading its texture would wait for
        it where a program stands for the GPU, even in a shader.
        """
        with self._target.bind():
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))

    def wait(self, texture: Texture) -> None:
        """Copy one pixel of a texture and read that: it comes after all that drew the texture."""
        self._copy.draw([Addend(texture)], self._target)
        read_texture(self._pixel)


@dataclass
class Begun:
    """Layers that were begun and not waited for.

    Attributes:
        names: theirs.
        start: when the first was begun, seconds of some clock.
    """

    names: list[str] = field(default_factory=list)
    start: float = float("inf")

    def mean(self, now: float) -> float:
        """Seconds that each of them took."""
        return (now - self.start) / len(self.names)
