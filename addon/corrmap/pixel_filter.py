# SPDX-License-Identifier: GPL-3.0-or-later
"""Where in and around its pixel each sample of the view lies.

Cycles draws sample positions in proportion to the pixel filter and averages them evenly; the
same is done here, with a low-discrepancy sequence, so both pictures converge to one. The first 32
or 64 serve a whole picture, so that what they are off the filter's mean and variance is a shift
and a blur of it: below 0.002 of a pixel, and 6 % of the variance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.view import PixelFilter
from .sobol_points import sobol_points, sobol_points_around

_TABLE_SIZE = 1024


def pixel_offsets(pixel_filter: PixelFilter, count: int, first: int = 0) -> NDArray[np.float64]:
    """(count, 2) float64: the samples' offsets from the pixel's centre, in pixels.

    Sample 0 lies on the centre. Offsets are distributed as the filter, by inverting its
    cumulative distribution along each axis (the filters are separable).
    """
    return _filtered(pixel_filter, sobol_points(count, first))


def pixel_offsets_around(pixel_filter: PixelFilter, number: int, count: int) -> NDArray[np.float64]:
    """(count, 2) float64: the offset of sample `number` and others, of which those of all samples
    fill the filter more finely, see `sobol_points_around`."""
    return _filtered(pixel_filter, sobol_points_around(number, count))


def _filtered(pixel_filter: PixelFilter, uniform: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) offsets by evenly distributed points of the unit square."""
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
