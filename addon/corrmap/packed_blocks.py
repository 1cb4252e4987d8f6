# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of packed texels, compressed in memory, for caches that the GPU does not hold whole."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..caching.packing import PackedTexture
from .texel_codes import code_type
from .tile_layout import BLOCK

# zlib's quickest: its best takes five times as long for a tenth less.
_LEVEL = 1


class PackedBlocks:
    """Blocks by their number (see `BlockNumbers`).

    They are kept here, and not read again from the cache's folder, because a bake may put other
    pictures there while this cache is still shown.
    """

    def __init__(self, textures: Sequence[PackedTexture]) -> None:
        self._textures = tuple(textures)
        self._held: dict[int, bytes] = {}

    @property
    def bytes(self) -> int:
        """What they take in memory."""
        return sum(len(data) for data in self._held.values())

    def add(self, numbers: NDArray[np.int64], codes: Sequence[NDArray[Any]]) -> None:
        """Take blocks: for each texture (N, BLOCK, BLOCK, components) of its `code_type`."""
        for index, number in enumerate(numbers):
            data = b"".join(texture[index].tobytes() for texture in codes)
            self._held[int(number)] = zlib.compress(data, _LEVEL)

    def drop(self, first: int) -> None:
        """Let the blocks from number `first` on go."""
        for number in [number for number in self._held if number >= first]:
            del self._held[number]

    def take(self, numbers: NDArray[np.int64]) -> list[NDArray[Any]]:
        """The codes of blocks, as `add` took them.

        Raises:
            KeyError: a block was never added.
        """
        codes: list[NDArray[Any]] = [
            np.empty((len(numbers), BLOCK, BLOCK, t.width), dtype=code_type(t.texture_format))
            for t in self._textures
        ]
        for index, number in enumerate(numbers):
            data, start = zlib.decompress(self._held[int(number)]), 0
            for texture in codes:
                block = texture[index]
                values = np.frombuffer(data, block.dtype, block.size, start)
                texture[index] = values.reshape(block.shape)
                start += block.nbytes
        return codes
