# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that a texel's bits stand for, as the GPU's formats have them.

What is packed is rounded here, once, and not by the driver: a block that was kept aside and comes
to the GPU later is then, to the bit, what it would have been at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..caching.packing import TexelFormat

_CODES: dict[str, Any] = {"8": np.uint8, "16": np.uint16, "16F": np.float16, "32F": np.float32}


def code_type(texel_format: TexelFormat) -> np.dtype[Any]:
    """The type of a component's code."""
    return np.dtype(_CODES[texel_format.lstrip("RGBA")])


def to_texel_codes(values: NDArray[np.float32], texel_format: TexelFormat) -> NDArray[Any]:
    """float32, from 0 to 1 where the format stores shares, to codes of `code_type`."""
    kind = code_type(texel_format)
    if kind.kind == "f":
        return values.astype(kind, copy=False)
    largest = np.float32(np.iinfo(kind).max)
    return np.rint(np.clip(values, 0.0, 1.0) * largest).astype(kind)


def from_texel_codes(codes: NDArray[Any]) -> NDArray[np.float32]:
    """float32 that the GPU rounds to these codes."""
    if codes.dtype.kind == "f":
        return codes.astype(np.float32, copy=False)
    return codes.astype(np.float32) / np.float32(np.iinfo(codes.dtype).max)
