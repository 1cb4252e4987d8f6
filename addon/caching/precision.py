# SPDX-License-Identifier: GPL-3.0-or-later
"""Which channels of a deep framebuffer half precision would not hold.

Half precision keeps 11 bits of numbers from 2^-14 to 65504. The channel table names it for what
usually lies there; a channel that does not, in one caching camera's picture, is *wide*: it is
stored as float32 for that camera, and for all of them on the GPU. So nothing is clamped or
flushed to zero, and a scene pays for extremes only where it has them.

A value matters as far as it can be seen beside what it is seen with: the other components of its
texel, and the brightest texel of its material in the picture. A loss of less than 2^-11 of those
is what half precision means; a black corner of a bright texture needs no more. Normals,
roughness and occlusion are measured against 1, their neutral value.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .channels import CHANNEL_BY_NAME

# The largest relative error of a number that is rounded to half precision.
ROUNDING = np.float32(2.0**-11)

# Half precision keeps all of its bits from here on.
_SMALLEST = np.float32(2.0**-14)
_LARGEST = np.float32(65504.0)

# What is darker than this share of its material's brightest texel is black beside it: a
# thousandth, which the sRGB curve shows as three levels of 255.
_FAINT = np.float32(2.0**-10)


def wide_channels(channels: Mapping[str, NDArray[np.float32]]) -> frozenset[str]:
    """Names of the channels that half precision is named for, but does not hold.

    Args:
        channels: (R, R, components) float32 by name, all finite.
    """
    halves = [
        name
        for name in channels
        if CHANNEL_BY_NAME[name].precision == "half" and not CHANNEL_BY_NAME[name].is_direction
    ]
    return frozenset(name for name in halves if _is_wide(name, channels))


def _is_wide(name: str, channels: Mapping[str, NDArray[np.float32]]) -> bool:
    values = channels[name]
    if name == "material_id":
        # A number that is off by one is another material.
        largest_exact = 1.0 / ROUNDING
        return bool(values.max(initial=0.0) > largest_exact)
    size = np.abs(values)
    if size.max(initial=0.0) > _LARGEST:
        return True
    if any(CHANNEL_BY_NAME[name].neutral):
        # Rounding moves numbers below 2^-14 by 2^-25 at the most, which is nothing beside 1.
        return False
    tiny = ((size > 0.0) & (size < _SMALLEST)).any(axis=-1)
    if not tiny.any():
        return False
    brightest = _brightest_of_material(size, channels.get("material_id"))
    exact = values[tiny]
    error = np.abs(exact.astype(np.float16).astype(np.float32) - exact).max(axis=-1)
    beside = np.maximum(size[tiny].max(axis=-1), _FAINT * brightest[tiny])
    return bool((error > ROUNDING * beside).any())


def _brightest_of_material(
    size: NDArray[np.float32], material_id: NDArray[np.float32] | None
) -> NDArray[np.float32]:
    """(R, R): for each texel of (R, R, components), the largest value that its material has."""
    if material_id is None:
        return np.broadcast_to(size.max(), size.shape[:2])
    number = material_id[..., 0].astype(np.int64)
    largest = np.zeros(int(number.max()) + 1, dtype=np.float32)
    np.maximum.at(largest, number.ravel(), size.max(axis=-1).ravel())
    return largest[number]
