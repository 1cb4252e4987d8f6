# SPDX-License-Identifier: GPL-3.0-or-later
"""The tiles of a picture that a pass has anything to do in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...glsl.triangles import triangle_batch

# Pixels along the side of a tile.
TILE = 8

# A rectangle's two triangles, by its corners: left or right, bottom or top.
_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]])


@dataclass(frozen=True)
class PictureTiles:
    """Some tiles of a picture. Passes that shade pixels over them cost nothing beside them, also
    where a shader's own branches are not skipped, as in software.

    Attributes:
        batch: triangles over them, each pixel once, for `ShaderProgram.draw_batch`; None for no
            tile at all.
    """

    batch: Any

    @classmethod
    def around(cls, chosen: NDArray[np.bool_]) -> PictureTiles:
        """The tiles that hold a pixel of those chosen, (H, W)."""
        rectangles = tile_rectangles(chosen)
        if not len(rectangles):
            return cls(None)
        height, width = chosen.shape
        corners = np.where(_CORNERS == 0, rectangles[:, :1], rectangles[:, 1:])
        # On pixels' borders: float32's rounding of these is far below what rasterizers resolve.
        clip = corners * (2.0 / np.array([width, height])) - 1.0
        return cls(triangle_batch({"corner": clip.reshape(-1, 2)}))


def tile_rectangles(chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(R, 2, 2) stretches of tiles side by side: (column, row) of the first pixel, and of the one
    after the last, along both axes."""
    height, width = chosen.shape
    rows, columns = np.arange(0, height, TILE), np.arange(0, width, TILE)
    tiles = np.logical_or.reduceat(np.logical_or.reduceat(chosen, rows), columns, axis=1)
    padded = np.pad(tiles, ((0, 0), (1, 1)))
    row, change = np.nonzero(padded[:, 1:] != padded[:, :-1])
    first, last = change[::2], change[1::2]
    low = np.stack([first, row[::2]], axis=-1) * TILE
    high = np.minimum(np.stack([last, row[::2] + 1], axis=-1) * TILE, [width, height])
    return np.stack([low, high], axis=1)
