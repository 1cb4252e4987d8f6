# SPDX-License-Identifier: GPL-3.0-or-later
"""Long rows of numbered values as textures: value n lies at column n mod 4096 of row n / 4096.

A texture may be only so wide; so many columns every GPU's have. `lib/row_texture.glsl` finds a
value again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .shader import Texture, TextureFormat, max_texture_width, texture_from_array

# Texels in a row, as a power of two.
ROW_BITS = 12
ROW_WIDTH = 1 << ROW_BITS

# What a pass includes and declares that asks for `row_texel`.
ROW_LIBRARY = ("row_texture",)
ROW_DEFINES = (("ROW_BITS", str(ROW_BITS)),)


def empty_rows(count: int, components: int, what: str) -> NDArray[np.float32]:
    """(rows * ROW_WIDTH, components) zeros: whole rows with a texel for each of `count` values, and
    one row at least.

    Args:
        count: of the values.
        components: of each.
        what: they are, in the plural, for the message.

    Raises:
        InputError: they take more rows than the GPU's textures have.
    """
    rows, most = max(-(-count // ROW_WIDTH), 1), max_texture_width()
    if rows > most:
        raise InputError(
            f"the table of {what} takes {count} texels, and this GPU's textures have room for "
            f"{most * ROW_WIDTH}; leave objects out of the render, or choose a smaller size"
        )
    return np.zeros((rows * ROW_WIDTH, components), dtype=np.float32)


def upload_rows(texels: NDArray[np.float32], texture_format: TextureFormat) -> Texture:
    """Whole rows, as of `empty_rows`."""
    rows = texels.reshape(-1, ROW_WIDTH, texels.shape[1])
    return texture_from_array(rows, texture_format)


def row_texture(values: NDArray[np.generic], texture_format: TextureFormat, what: str) -> Texture:
    """(N, C) values, then zeros to the end of the last row.

    Args:
        values: C is what the format has.
        texture_format: of the texture.
        what: they are, in the plural, for the message.

    Raises:
        InputError: they take more rows than the GPU's textures have.
    """
    texels = empty_rows(len(values), values.shape[1], what)
    texels[: len(values)] = values
    return upload_rows(texels, texture_format)
