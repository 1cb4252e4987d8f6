# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample positions follow Cycles' pixel filters."""

from __future__ import annotations

import numpy as np
import pytest

from addon.corrmap.pixel_filter import pixel_offsets
from addon.corrmap.sobol_points import sobol_points
from addon.scene.view import PixelFilter


@pytest.mark.parametrize("kind", ["BOX", "GAUSSIAN", "BLACKMAN_HARRIS"])
def test_the_first_sample_is_the_centre(kind: str) -> None:
    offset = pixel_offsets(PixelFilter(kind, 1.5), 1)  # type: ignore[arg-type]
    assert np.allclose(offset, 0.0, atol=1e-9)


def test_the_box_fills_its_width_evenly() -> None:
    offset = pixel_offsets(PixelFilter("BOX", 1.0), 4096)
    assert np.abs(offset).max() <= 0.5
    # A box of width 1 has variance 1/12; a low-discrepancy mean of n points errs by ~log(n)/n.
    assert np.allclose(offset.var(axis=0), 1.0 / 12.0, rtol=0.01)


def test_blackman_harris_has_its_closed_form_variance() -> None:
    # w(t) = sum_m a_m cos(2 pi m t), t in [-1/2, 1/2], over a support of 2 x width. The mean of
    # t^2 under it: (a0 / 12 + sum_m a_m (-1)^m / (2 pi^2 m^2)) / a0, signs of the centred form.
    a = np.array([0.35875, 0.48829, 0.14128, 0.01168])
    m = np.arange(1, 4)
    mean_square = (a[0] / 12.0 + (a[1:] * (-1.0) ** m / (2.0 * np.pi**2 * m**2)).sum()) / a[0]
    width = 1.5
    offset = pixel_offsets(PixelFilter("BLACKMAN_HARRIS", width), 8192)
    assert np.allclose(offset.var(axis=0), mean_square * (2.0 * width) ** 2, rtol=0.01)
    assert np.abs(offset).max() <= width


@pytest.mark.parametrize("count", [32, 64])
def test_a_pictures_samples_neither_shift_nor_blur_it(count: int) -> None:
    offset = pixel_offsets(PixelFilter("BLACKMAN_HARRIS", 1.5), count)
    wanted = pixel_offsets(PixelFilter("BLACKMAN_HARRIS", 1.5), 1 << 16)
    # A pattern of one pixel moved by 0.002 of it has errors of a hundredth of its contrast (38 dB
    # below it); the R_4 sequence, which was here before, was off by 0.047.
    assert np.abs(offset.mean(axis=0)).max() < 0.002
    # Sample 0 is held at the centre, which takes one part in `count` from the variance.
    assert np.allclose(offset.var(axis=0), wanted.var(axis=0), rtol=0.03 + 1.0 / count)


@pytest.mark.parametrize("count", [16, 64, 256])
def test_each_cell_of_every_grid_has_one_point(count: int) -> None:
    points = sobol_points(count)
    columns = count
    while columns:
        cells = np.floor(points * [columns, count // columns]).astype(int)
        assert len(np.unique(cells, axis=0)) == count
        columns //= 2


def test_points_after_the_first_continue_the_sequence() -> None:
    assert np.array_equal(sobol_points(4, first=3), sobol_points(7)[3:])
