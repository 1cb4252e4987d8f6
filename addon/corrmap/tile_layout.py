# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the deep framebuffers' square tiles lie in pages of one size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TileLayout:
    """Where each tile lies.

    Attributes:
        page_size: texels along a page's side.
        page_count: pages.
        page: (N,) int64, each tile's page.
        corner: (N, 2) int64, x and y of its lower left texel.
    """

    page_size: int
    page_count: int
    page: NDArray[np.int64]
    corner: NDArray[np.int64]


def lay_out_tiles(resolutions: Sequence[int]) -> TileLayout:
    """Pack square tiles without gaps between tiles of powers of two.

    Tiles in falling size fill each page along a Z-order curve: a tile of side s starts at a
    multiple of s*s texels along the curve, which is always a square's corner.

    Raises:
        ValueError: no tile, or one without a texel.
    """
    if not len(resolutions) or min(resolutions) < 1:
        raise ValueError("tiles need at least one texel")
    sides = 1 << np.ceil(np.log2(np.asarray(resolutions, dtype=np.float64))).astype(np.int64)
    page_size = int(sides.max())
    order = np.argsort(-sides, kind="stable")
    areas = sides[order] ** 2
    start = np.concatenate([[0], np.cumsum(areas)[:-1]])
    page = np.empty(len(sides), dtype=np.int64)
    corner = np.empty((len(sides), 2), dtype=np.int64)
    page[order] = start // page_size**2
    offset = start % page_size**2
    corner[order] = np.stack([_even_bits(offset), _even_bits(offset >> 1)], axis=-1)
    return TileLayout(page_size, int(page.max()) + 1, page, corner)


def _even_bits(code: NDArray[np.int64]) -> NDArray[np.int64]:
    """Every second bit of a Z-order code, drawn together: one coordinate."""
    result = np.zeros_like(code)
    for bit in range(31):
        result |= ((code >> (2 * bit)) & 1) << bit
    return result
