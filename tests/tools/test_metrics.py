# SPDX-License-Identifier: GPL-3.0-or-later
"""The metrics against values known on paper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools import metrics


def flat(value: float | tuple[float, float, float], size: tuple[int, int] = (32, 48)) -> np.ndarray:
    return np.broadcast_to(np.array(value, np.float32), (*size, 3)).copy()


def psnr_luma(reference: np.ndarray, image: np.ndarray) -> float:
    _, luma = metrics.squared_error(metrics.quantize(reference), metrics.quantize(image))
    return metrics.psnr(float(luma.mean()))


def psnr_rgb(reference: np.ndarray, image: np.ndarray) -> float:
    rgb, _ = metrics.squared_error(metrics.quantize(reference), metrics.quantize(image))
    return metrics.psnr(float(rgb.mean()))


@pytest.mark.parametrize("step", [1, 3, 16, 255])
def test_psnr_of_a_constant_step_in_grey_is_20_log_255_over_the_step(step: int) -> None:
    expected = 20.0 * math.log10(255.0 / step)
    black, grey = flat(0.0), flat(step / 255.0)
    assert psnr_rgb(black, grey) == pytest.approx(expected, rel=1e-12)  # whole numbers: exact
    assert psnr_luma(black, grey) == pytest.approx(expected, rel=1e-12)


def test_psnr_of_one_channel_counts_a_third_in_rgb_and_its_weight_in_luma() -> None:
    black, green = flat(0.0), flat((0.0, 10.0 / 255.0, 0.0))
    assert psnr_rgb(black, green) == pytest.approx(10 * math.log10(255**2 / (100 / 3)), rel=1e-12)
    assert psnr_luma(black, green) == pytest.approx(20 * math.log10(255 / 5.87), rel=1e-12)


def test_psnr_of_identical_pictures_is_infinite() -> None:
    assert psnr_rgb(flat(0.4), flat(0.4)) == math.inf


def test_psnr_is_the_same_both_ways() -> None:
    random = np.random.default_rng(0)
    a, b = random.random((2, 16, 16, 3)).astype(np.float32)
    assert psnr_rgb(a, b) == psnr_rgb(b, a)
    assert psnr_luma(a, b) == psnr_luma(b, a)


def test_psnr_of_noise_follows_from_its_variance() -> None:
    random = np.random.default_rng(1)
    reference = flat(0.5, (256, 256))
    image = reference + random.normal(0.0, 8.0 / 255.0, reference.shape).astype(np.float32)
    # Rounding to whole levels adds 1/12 of variance. 196608 samples: the variance is known to
    # sqrt(2 / n) = 0.3 %, 0.014 dB; 0.06 dB is more than four standard deviations.
    expected = 10 * math.log10(255**2 / (64.0 + 1.0 / 12.0))
    assert psnr_rgb(reference, image) == pytest.approx(expected, abs=0.06)


@given(st.floats(0.0, 1.0))
def test_srgb_encoding_inverts_the_standards_decoding(encoded: float) -> None:
    # IEC 61966-2-1, the decoding, written down apart from the code under test.
    linear = encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4
    # The standard's two pieces meet within 3e-8 only: its constants are rounded.
    assert float(metrics.encode_srgb(np.array([linear]))[0]) == pytest.approx(encoded, abs=1e-7)


def test_encoding_clips_what_a_display_clips() -> None:
    found = metrics.encode_srgb(np.array([-1.0, 0.0, 1.0, 40.0]))
    # 1.055 - 0.055 is one float64 spacing short of 1
    assert found == pytest.approx([0.0, 0.0, 1.0, 1.0], abs=2.3e-16)


def test_relative_error_of_a_factor() -> None:
    reference = flat(2.0)
    found = metrics.relative_squared_error(reference, 1.1 * reference)
    expected = 0.2**2 / (4.0 + metrics.RELATIVE_MSE_FLOOR)
    # float32 pictures: 1.1 * 2 is off by half a spacing of 2.2, 1.2e-7, on a difference of 0.2
    assert found == pytest.approx(expected, rel=4e-6)


def test_mean_over_an_empty_mask_is_none() -> None:
    assert metrics.mean_over(np.ones((4, 4)), np.zeros((4, 4), dtype=bool)) is None


@pytest.mark.parametrize("linear", [True, False])
def test_flip_is_zero_for_equal_pictures_and_grows_with_the_error(linear: bool) -> None:
    random = np.random.default_rng(2)
    reference = random.random((40, 56, 3)).astype(np.float32)
    errors = [
        float(metrics.flip_map(reference, reference * scale, linear=linear).mean())
        for scale in (1.0, 0.95, 0.7)
    ]
    assert errors[0] == 0.0
    assert 0.0 < errors[1] < errors[2] <= 1.0


def test_flip_keeps_rows_where_they_are() -> None:
    reference = flat(0.4, (40, 56))
    image = reference.copy()
    image[30:, :] = 0.9  # the upper rows: row 0 is at the bottom
    errors = metrics.flip_map(reference, image, linear=True)
    assert errors[36:].min() > 0.1 > errors[:24].max()


def test_flip_against_black_is_finite() -> None:
    errors = metrics.flip_map(flat(0.0), flat(0.5), linear=True)
    assert np.isfinite(errors).all()
    assert errors.mean() > 0.1


def similarity(reference: np.ndarray, image: np.ndarray) -> np.ndarray:
    return metrics.structural_similarity(metrics.quantize(reference), metrics.quantize(image))


def test_similarity_is_1_for_equal_pictures() -> None:
    random = np.random.default_rng(2).random((24, 20, 3))
    # The same products on both sides of each quotient, but for rounding.
    np.testing.assert_allclose(similarity(random, random), 1.0, rtol=1e-12)


def test_similarity_of_flat_greys_is_the_luminance_term() -> None:
    # Wang et al. 2004, equation 6, with C1 = (0.01 * 255)^2; there is no structure.
    x, y, c1 = 51.0, 102.0, 2.55**2
    expected = (2 * x * y + c1) / (x * x + y * y + c1)
    found = similarity(flat(51 / 255), flat(102 / 255))
    # Windows' variances are differences of squares: some 1e-12 of 1e4, beside C2 = 58.
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_similarity_of_a_turned_checkerboard_is_near_minus_1_and_sees_only_its_window() -> None:
    board = np.indices((48, 48)).sum(axis=0) % 2
    first = np.repeat(board[..., None], 3, axis=-1).astype(np.float64)
    second = first.copy()
    second[:24] = 1.0 - second[:24]
    found = similarity(first, second)
    variance, c2 = 127.5**2, 7.65**2
    # The window's mean of a checkerboard is off 127.5 by less than 1e-4 of it.
    expected = (c2 - 2.0 * variance) / (c2 + 2.0 * variance)
    np.testing.assert_allclose(found[6:18, 6:-6], expected, rtol=1e-4)
    np.testing.assert_allclose(found[30:], 1.0, rtol=1e-12)
