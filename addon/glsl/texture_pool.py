# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures that nobody holds any more, for who needs some like them.

A program that stands for the GPU fills each new texture with zeros, page by page of new memory: a
millisecond for one of 640x480, of which a camera move needs twenty. A GPU does not need this.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

# Bytes that may lie idle: what a picture of 1280x960 needs.
IDLE_BUDGET = 256 << 20


@dataclass(frozen=True)
class _Shape:
    """What makes textures alike."""

    width: int
    height: int
    texture_format: str

    @cached_property
    def nbytes(self) -> int:
        components = sum(self.texture_format.startswith("RGBA"[: n + 1]) for n in range(4))
        bits = int("".join(c for c in self.texture_format if c.isdigit()))
        return self.width * self.height * max(components, 1) * bits // 8


def _holders(things: list[Any], index: int) -> int:
    return sys.getrefcount(things[index])


# Of what only a list holds.
_NOBODY = _holders([object()], 0)


class TexturePool:
    """Holds on to textures, and gives those again that only it holds.

    Args:
        budget: bytes of textures that may lie idle; beyond that the oldest are let go.
    """

    def __init__(self, budget: int = IDLE_BUDGET) -> None:
        self._budget = budget
        self._shapes: list[_Shape] = []
        self._textures: list[Any] = []
        self._lock = threading.Lock()

    def take(self, width: int, height: int, texture_format: str, make: Callable[[], Any]) -> Any:
        """An idle texture of that size and format, with whatever is in it; or what `make` gives."""
        shape = _Shape(width, height, texture_format)
        with self._lock:
            found = self._idle(shape)
            if found is None:
                found = make()
            self._shapes.append(shape)
            self._textures.append(found)
            return found

    def clear(self) -> None:
        """Let go of all."""
        with self._lock:
            self._shapes.clear()
            self._textures.clear()

    def _idle(self, wanted: _Shape) -> Any:
        """One to be given again, taken out; what is too much is let go."""
        found, idle = None, 0
        for index in reversed(range(len(self._textures))):
            if _holders(self._textures, index) > _NOBODY:
                continue
            shape = self._shapes[index]
            if found is None and shape == wanted:
                found = self._textures[index]
            else:
                idle += shape.nbytes
                if idle <= self._budget:
                    continue
            del self._textures[index], self._shapes[index]
        return found
