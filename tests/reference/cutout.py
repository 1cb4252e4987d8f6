# SPDX-License-Identifier: GPL-3.0-or-later
"""Alpha masks in plain numpy, float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def mask_alpha(
    alpha: NDArray[np.float32], uv: NDArray[np.float64], extension: str
) -> NDArray[np.float64]:
    """Bilinear alpha at (N, 2) texture coordinates; v = 0 is the first row."""
    height, width = alpha.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)

    def texel(column: NDArray[np.int_], row: NDArray[np.int_]) -> NDArray[np.float64]:
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        if extension == "REPEAT":
            column, row = column % width, row % height
        elif extension == "MIRROR":
            column, row = column % (2 * width), row % (2 * height)
            column = np.where(column < width, column, 2 * width - 1 - column)
            row = np.where(row < height, row, 2 * height - 1 - row)
        else:
            column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
        value = alpha[row, column].astype(np.float64)
        return np.where(inside, value, 0.0) if extension == "CLIP" else value

    fx, fy = x - x0, y - y0
    low = texel(x0, y0) * (1 - fx) + texel(x0 + 1, y0) * fx
    high = texel(x0, y0 + 1) * (1 - fx) + texel(x0 + 1, y0 + 1) * fx
    return low * (1 - fy) + high * fy
