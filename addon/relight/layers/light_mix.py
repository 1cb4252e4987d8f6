# SPDX-License-Identifier: GPL-3.0-or-later
"""The sum of layers that is the picture, and the part of it that an edit leaves alone.

While one light is edited, the sum of all others is kept: the picture is that sum and the one
layer (Gershbein and Hanrahan 2000, 4.3: one new light over the image of the others). The kept sum
is never subtracted from: when another light is edited, it is added up anew from the layers, so
that rounding does not pile up however many edits there are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...glsl.shader import Texture, framebuffer, texture_2d
from .sum_pass import Addend, SumPass

# With fewer layers than this, adding them all costs no more than keeping a sum.
_WORTH_KEEPING = 3


@dataclass(frozen=True)
class MixPart:
    """One layer as it counts in the picture.

    Attributes:
        textures: RGBA32F, one for each part of a layer that is split by lobes.
        factor: (r, g, b, a) that they are multiplied with.
        stride: view pixels along the side of one of theirs.
        stamp: tells contents apart: equal stamps are equal textures.
    """

    textures: tuple[Texture, ...]
    factor: tuple[float, float, float, float]
    stride: int
    stamp: tuple[int, int]

    @property
    def _key(self) -> object:
        return (self.factor, self.stride, self.stamp)


class LightMix:
    """Sums the layers of a view."""

    def __init__(self) -> None:
        self._pass = SumPass()
        self._drawn: dict[str, object] = {}
        self._rest: Texture | None = None
        self._rest_keys: dict[str, object] = {}
        self._hot = ""
        self._picture: Texture | None = None
        self._target: Any = None

    @property
    def hot(self) -> str:
        """The layer that is added to the kept sum of all others; "" when none is kept."""
        return self._hot if self._rest is not None else ""

    def clear(self) -> None:
        """Forget what was summed: the view or its size changed."""
        self._drawn.clear()
        self._rest = None

    def draw(
        self, parts: Mapping[str, MixPart], width: int, height: int, *, keep: bool = True
    ) -> Texture:
        """The sum, RGBA32F, by a kept sum where only one layer changed since the last call.

        It is good until the next call, which draws into the same texture.

        Args:
            parts: the layers by name, in the order in which they are added.
            width: of the picture, pixels.
            height: of the picture, pixels.
            keep: False adds all layers in their order, so that equal layers give equal bits.
        """
        keys: dict[str, object] = {name: part._key for name, part in parts.items()}  # noqa: SLF001
        picture, target = self._picture_of(width, height)
        if not keep:
            self._sum(parts, target)
            return picture
        if not self._rest_serves(keys, width, height):
            self._rest = None
            changed = [name for name, key in keys.items() if self._drawn.get(name) != key]
            same = set(self._drawn) == set(keys)
            if same and len(changed) == 1 and len(keys) >= _WORTH_KEEPING:
                self._hot = changed[0]
                others = {name: part for name, part in parts.items() if name != self._hot}
                self._rest = texture_2d(width, height)
                self._sum(others, framebuffer([self._rest]))
                self._rest_keys = {name: keys[name] for name in others}
        self._drawn = keys
        if self._rest is None:
            self._sum(parts, target)
        else:
            kept = MixPart((self._rest,), (1.0, 1.0, 1.0, 1.0), 1, (0, 0))
            self._sum({"": kept, self._hot: parts[self._hot]}, target)
        return picture

    def _picture_of(self, width: int, height: int) -> tuple[Texture, Any]:
        """The texture for the sum and the framebuffer over it, kept while the size stays."""
        if self._picture is None or (self._picture.width, self._picture.height) != (width, height):
            self._picture = texture_2d(width, height)
            self._target = framebuffer([self._picture])
        return self._picture, self._target

    def _rest_serves(self, keys: Mapping[str, object], width: int, height: int) -> bool:
        if self._rest is None or (self._rest.width, self._rest.height) != (width, height):
            return False
        return {n: k for n, k in keys.items() if n != self._hot} == self._rest_keys and (
            self._hot in keys
        )

    def _sum(self, parts: Mapping[str, MixPart], target: Any) -> None:
        addends = [
            Addend(texture, part.factor, part.stride)
            for part in parts.values()
            for texture in part.textures
        ]
        self._pass.draw(addends, target)
