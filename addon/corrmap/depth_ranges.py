# SPDX-License-Identifier: GPL-3.0-or-later
"""Between which depths a rectangle of a caching camera's picture has texels, in four look-ups.

Each picture has a pyramid of its blocks: the least and the greatest depth of a block's texels, then
of two by two blocks, and so on up to the whole picture. A tile of the view that lies before or
behind all that a camera shows in its direction need not try that camera.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Samplers, Texture, texture_from_array
from .tile_layout import BLOCK, BlockNumbers

# Texels along a row of the texture; each camera's pyramid begins a row.
RANGE_BITS = 9

# What a pass declares that includes depth_ranges.glsl.
RANGE_SAMPLERS: Samplers = (("depth_ranges", "FLOAT_2D"),)
RANGE_DEFINES = (("RANGE_BITS", str(RANGE_BITS)),)


def range_rows(numbers: BlockNumbers) -> NDArray[np.int64]:
    """(N + 1,) the row where each camera's pyramid begins, and where the last one ends."""
    side = _padded(numbers.across)
    texels = (4 * side * side - 1) // 3
    return np.concatenate([[0], np.cumsum(-(-texels >> RANGE_BITS))])


class DepthRanges:
    """The pyramids of a cache's cameras."""

    def __init__(self) -> None:
        self._pyramids: dict[int, NDArray[np.float32]] = {}
        self._texture: Texture | None = None

    @property
    def bytes(self) -> int:
        """What they take on the GPU."""
        rows = sum(-(-len(texels) >> RANGE_BITS) for texels in self._pyramids.values())
        return 8 * rows << RANGE_BITS

    def put(self, index: int, depth: NDArray[np.float32], kept: NDArray[np.bool_]) -> None:
        """Take a camera's depth (R, R), 0 where nothing is hit, and (B, B) which blocks are held.
        Cameras behind this one are forgotten, unless they are put again."""
        self._pyramids = {k: v for k, v in self._pyramids.items() if k < index}
        self._pyramids[index] = depth_pyramid(depth, kept)
        self._texture = None

    def texture(self) -> Texture:
        """RG32F: the least and the greatest depth; the least is the greater where there is none."""
        if self._texture is None:
            width = 1 << RANGE_BITS
            rows = [
                np.pad(texels, ((0, -len(texels) % width), (0, 0))).reshape(-1, width, 2)
                for _, texels in sorted(self._pyramids.items())
            ]
            self._texture = texture_from_array(np.concatenate(rows), "RG32F")
        return self._texture


def depth_pyramid(depth: NDArray[np.float32], kept: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(texels, 2) least and greatest depths: the blocks of a picture, on a side that is a power of
    two, row by row, then each coarser level. (1, 0) where nothing is held or hit."""
    across = len(kept)
    side = int(_padded(np.array(across)))
    whole = np.zeros((side * BLOCK, side * BLOCK), dtype=np.float32)
    whole[: len(depth), : len(depth)] = depth
    whole[: across * BLOCK, : across * BLOCK] *= kept.repeat(BLOCK, 0).repeat(BLOCK, 1)
    least, greatest = np.where(whole > 0.0, whole, np.float32(np.inf)), whole
    levels = []
    while True:
        cell = len(whole) // side
        least, greatest = (
            reduce(pixels.reshape(side, cell, side, cell), axis=(1, 3))
            for reduce, pixels in ((np.min, least), (np.max, greatest))
        )
        held = greatest > 0.0
        texels = np.stack([np.where(held, least, np.float32(1.0)), greatest], axis=-1)
        levels.append(texels.reshape(-1, 2))
        if side == 1:
            return np.concatenate(levels)
        whole, side = greatest, side // 2


def _padded(across: NDArray[np.int64]) -> NDArray[np.int64]:
    """The powers of two that are no less."""
    return np.asarray(1 << np.ceil(np.log2(across)).astype(np.int64))
