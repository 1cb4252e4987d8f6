# SPDX-License-Identifier: GPL-3.0-or-later
"""Between which depths a rectangle of a caching camera's picture has texels, in four look-ups.

Each picture has a pyramid of its blocks: the least and the greatest depth of a block's texels, then
of two by two blocks, and so on up to the whole picture. A tile of the view that lies before or
behind all that a camera shows in its direction need not try that camera.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..glsl.shader import Samplers, Texture, max_texture_width, texture_from_array
from .tile_layout import BLOCK, BlockNumbers

# Texels across a column of the texture, as a power of two; each camera's pyramid begins a row of a
# column. All lie in one column unless they are more than a texture has rows.
RANGE_BITS = 9

# What a pass declares that includes depth_ranges.glsl.
RANGE_SAMPLERS: Samplers = (("depth_ranges", "FLOAT_2D"),)
RANGE_DEFINES = (("RANGE_BITS", str(RANGE_BITS)),)


def range_places(numbers: BlockNumbers) -> NDArray[np.int64]:
    """(N, 2) the column and the row where each camera's pyramid begins.

    Raises:
        InputError: they do not fit one texture of the GPU.
    """
    side = _padded(numbers.across)
    return _places(_rows((4 * side * side - 1) // 3))


class DepthRanges:
    """The pyramids of a cache's cameras."""

    def __init__(self) -> None:
        self._pyramids: dict[int, NDArray[np.float32]] = {}
        self._texture: Texture | None = None

    @property
    def bytes(self) -> int:
        """What they take on the GPU."""
        return 8 * int(self._heights.sum()) << RANGE_BITS

    def put(self, index: int, depth: NDArray[np.float32], kept: NDArray[np.bool_]) -> None:
        """Take a camera's depth (R, R), 0 where nothing is hit, and (B, B) which blocks are held.
        Cameras behind this one are forgotten, unless they are put again."""
        self.keep(index)
        self._pyramids[index] = depth_pyramid(depth, kept)

    def keep(self, count: int) -> None:
        """Forget all but the first cameras."""
        self._pyramids = {k: v for k, v in self._pyramids.items() if k < count}
        self._texture = None

    @property
    def _heights(self) -> NDArray[np.int64]:
        """(N,) rows of each camera."""
        texels = [len(texels) for _, texels in sorted(self._pyramids.items())]
        return _rows(np.array(texels, dtype=np.int64))

    def texture(self) -> Texture:
        """RG32F: the least and the greatest depth; the least is the greater where there is none.

        Raises:
            InputError: they do not fit one texture of the GPU.
        """
        if self._texture is None:
            width, heights = 1 << RANGE_BITS, self._heights
            places = _places(heights)
            size = (int((places[:, 1] + heights).max()), int(places[:, 0].max()) + 1, width, 2)
            pixels = np.zeros(size, dtype=np.float32)
            pyramids = (texels for _, texels in sorted(self._pyramids.items()))
            for texels, (column, row) in zip(pyramids, places, strict=True):
                padded = np.pad(texels, ((0, -len(texels) % width), (0, 0)))
                rows = padded.reshape(-1, width, 2)
                pixels[row : row + len(rows), column] = rows
            self._texture = texture_from_array(pixels.reshape(len(pixels), -1, 2), "RG32F")
        return self._texture


def _rows(texels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows of a column that so many texels take."""
    return -(-texels >> RANGE_BITS)


def _places(heights: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N, 2) columns and rows of pyramids of so many rows (N,), one below the other in as few
    columns as there may be; the last of a column may reach beyond the end of the others.

    Raises:
        InputError: they do not fit one texture of the GPU.
    """
    most = max_texture_width()
    start, total = np.cumsum(heights) - heights, int(heights.sum())
    for columns in range(max(-(-total // most), 1), (most >> RANGE_BITS) + 1):
        column, row = np.divmod(start, max(-(-total // columns), 1))
        if (row + heights <= most).all():
            return np.stack([column, row], axis=1)
    raise InputError(
        f"the cache has {len(heights)} pictures, with those behind sheer surfaces, more than this "
        "GPU can search at once; place fewer cameras or bake at a lower preset"
    )


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
