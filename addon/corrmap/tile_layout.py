# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep framebuffers cut into square blocks of texels, and the pages that hold those worth keeping.

A block is named by its number: the cameras' blocks follow one another, each camera's row by row
from the bottom. Where it lies on the GPU is its *place*: the pages' places follow one another,
each page's row by row from the bottom. A table gives the place of each block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

# Texels along a block's side. Of the pictures of a classroom a fifth of the texels could be
# dropped by themselves, a sixth in blocks of 8, an eighth in blocks of 16, a twelfth in blocks of
# 32; the smaller the block, the more footprints lie across its border, and cost more fetches.
BLOCK_BITS = 4
BLOCK = 1 << BLOCK_BITS

# Blocks along the table's side: a power of two that every GPU's textures have.
TABLE_BITS = 11

# Blocks along a page's side, unless the GPU has too few pages: with 512 texels, the empty places
# of the last page are few.
_PAGE_BITS = 5

# The table holds places as float32, and so does the camera table the numbers of blocks.
_MOST_PLACES = 1 << 24


@dataclass(frozen=True)
class BlockNumbers:
    """How the blocks of square pictures are numbered.

    Attributes:
        resolutions: texels along each picture's side.
    """

    resolutions: tuple[int, ...]

    def __post_init__(self) -> None:
        if not self.resolutions or min(self.resolutions) < 1:
            raise ValueError("pictures need at least one texel")

    @cached_property
    def across(self) -> NDArray[np.int64]:
        """(N,) blocks along each picture's side; the last ones may reach over its edge."""
        return -(-np.array(self.resolutions, dtype=np.int64) // BLOCK)

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """(N,) the number of each picture's first block."""
        return np.concatenate([[0], np.cumsum(self.across**2)[:-1]])

    @property
    def count(self) -> int:
        """Blocks of all pictures."""
        return int((self.across**2).sum())

    def of(self, picture: int) -> slice:
        """The numbers of a picture's blocks."""
        first = int(self.first[picture])
        return slice(first, first + int(self.across[picture]) ** 2)

    def shown(self, found: NDArray[np.float32]) -> NDArray[np.bool_]:
        """(count,) whether a correspondence map (H, W, 4) reads a texel of each block."""
        result = np.zeros(self.count, dtype=bool)
        points = found.reshape(-1, 4)
        points = points[points[:, 0] >= 0.0]
        picture = points[:, 0].astype(np.int64)
        side = np.array(self.resolutions, dtype=np.int64)[picture]
        position = points[:, 1:3].astype(np.float64) * side[:, None] - 0.5
        # The shader multiplies in float32: where a footprint begins at a texel's very centre it
        # may take the one before.
        slack = side[:, None] * 2.0**-22
        ends = [np.floor(position - slack), np.floor(position + slack) + 1.0]
        rows, columns = [], []
        for end in ends:
            texel = np.clip(end.astype(np.int64), 0, side[:, None] - 1) >> BLOCK_BITS
            columns.append(texel[:, 0])
            rows.append(texel[:, 1])
        for row in rows:
            for column in columns:
                result[self.first[picture] + row * self.across[picture] + column] = True
        return result


def block_numbers(resolutions: Sequence[int]) -> BlockNumbers:
    """Of pictures that are to be held.

    Raises:
        InputError: they have more blocks than can be told apart.
    """
    numbers = BlockNumbers(tuple(resolutions))
    if numbers.count > _MOST_PLACES:
        raise InputError(
            f"the cache has {len(resolutions)} pictures, with those behind sheer surfaces, of "
            f"{numbers.count * BLOCK**2 / 1e6:.0f} million texels, and "
            f"{_MOST_PLACES * BLOCK**2 / 1e6:.0f} million can be searched; place fewer cameras or "
            "bake at a lower preset"
        )
    return numbers


@dataclass(frozen=True)
class PageShape:
    """Square pages of blocks.

    Attributes:
        bits: the pages have 2^bits blocks along a side.
        count: pages.
    """

    bits: int
    count: int

    @property
    def side(self) -> int:
        """Texels along a page's side."""
        return BLOCK << self.bits

    @property
    def places(self) -> int:
        """Blocks that the pages hold."""
        return self.count << (2 * self.bits)

    @property
    def texels(self) -> int:
        """Texels of all pages."""
        return self.count * self.side**2

    def with_places(self, places: int) -> PageShape:
        """Pages of the same side for at least as many places."""
        return PageShape(self.bits, max(-(-places >> (2 * self.bits)), 1))

    def corners(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """(N, 3) page, x and y of the lower left texels of places."""
        mask = (1 << self.bits) - 1
        column, row = places & mask, (places >> self.bits) & mask
        return np.stack([places >> (2 * self.bits), column * BLOCK, row * BLOCK], axis=-1)


def page_shape(blocks: int, largest_side: int, most_pages: int) -> PageShape:
    """Pages for some blocks.

    Args:
        blocks: that they have to hold.
        largest_side: texels that a texture of the GPU may have along a side.
        most_pages: layers that it may have.

    Raises:
        InputError: no pages hold so many.
    """
    bits = 0
    while bits < _PAGE_BITS and 4 ** (bits + 1) <= blocks:
        bits += 1
    while (count := -(-blocks // 4**bits)) > most_pages and BLOCK << (bits + 1) <= largest_side:
        bits += 1
    if count > most_pages or count << (2 * bits) > _MOST_PLACES:
        raise InputError(
            f"the caching cameras have {blocks * BLOCK**2 / 1e6:.0f} million texels that a view "
            "may need, which do not fit this GPU's textures; place fewer cameras or bake at a "
            "lower preset"
        )
    return PageShape(bits, max(count, 1))


def block_table(
    depth_place: NDArray[np.int64], packed_place: NDArray[np.int64]
) -> NDArray[np.float32]:
    """(rows, 2^bits, 2) float32: the places of every block's depth and other channels, negative
    where they are not held; the bits are TABLE_BITS."""
    width = 1 << TABLE_BITS
    rows = -(-len(depth_place) // width)
    table = np.full((rows * width, 2), -1.0, dtype=np.float32)
    table[: len(depth_place)] = np.stack([depth_place, packed_place], axis=-1)
    return table.reshape(rows, width, 2)
