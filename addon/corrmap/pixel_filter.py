# SPDX-License-Identifier: GPL-3.0-or-later
"""Where in and around its pixel each sample of the view lies.

Cycles draws sample positions in proportion to the pixel filter and averages them evenly; the
same is done here, with a low-discrepancy sequence, so both pictures converge to one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.view import PixelFilter

# The R_d sequence's generator for four dimensions: the root of x^5 = x + 1 (M. Roberts, "The
# Unreasonable Effectiveness of Quasirandom Sequences", 2018). Two dimensions place the sample
# in the pixel; the other two are left to the lights, so that the two never run in step.
_ROOT = 1.1673039782614187
SAMPLE_GENERATOR = _ROOT ** -np.arange(1.0, 5.0)

_TABLE_SIZE = 1024


def sample_points(count: int, first: int = 0) -> NDArray[np.float64]:
    """(count, 4) float64 in [0, 1): points of the R_4 sequence; point 0 is the centre."""
    index = np.arange(first, first + count, dtype=np.float64)[:, None]
    return np.asarray((0.5 + index * SAMPLE_GENERATOR) % 1.0)


def pixel_offsets(pixel_filter: PixelFilter, count: int, first: int = 0) -> NDArray[np.float64]:
    """(count, 2) float64: the samples' offsets from the pixel's centre, in pixels.

    Sample 0 lies on the centre. Offsets are distributed as the filter, by inverting its
    cumulative distribution along each axis (the filters are separable).
    """
    uniform = sample_points(count, first)[:, :2]
    if pixel_filter.kind == "BOX":
        return (uniform - 0.5) * pixel_filter.width
    # Cycles' tables reach one width to each side, or one and a half (src/scene/film.cpp).
    reach = pixel_filter.width * (1.5 if pixel_filter.kind == "GAUSSIAN" else 1.0)
    x = np.linspace(-reach, reach, _TABLE_SIZE)
    weight = _filter_weight(pixel_filter, x)
    cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (weight[1:] + weight[:-1]))])
    return np.interp(uniform, cumulative / cumulative[-1], x)


def _filter_weight(pixel_filter: PixelFilter, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cycles' one-dimensional filters, up to a factor; `x` in pixels from the centre."""
    if pixel_filter.kind == "GAUSSIAN":
        return np.asarray(np.exp(-8.0 * (x / pixel_filter.width) ** 2))
    phase = np.pi * (x / pixel_filter.width + 1.0)
    # The four-term Blackman-Harris window (F. J. Harris, 1978).
    amplitudes = np.array([0.35875, -0.48829, 0.14128, -0.01168])
    return np.asarray(np.cos(phase[:, None] * np.arange(4)) @ amplitudes)
