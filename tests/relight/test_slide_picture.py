# SPDX-License-Identifier: GPL-3.0-or-later
"""What a slide lets through, and its blur against a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage, special

from addon.relight.filters.slide_picture import slide_picture
from addon.scene.light_controls import Slide

PIXELS = np.random.default_rng(0).random((12, 20, 4)).astype(np.float32)
PLAIN = Slide(PIXELS, "i", "SLIDE", scale=(2.0, 1.0))


def test_alpha_density_and_use() -> None:
    rgb, alpha = PIXELS[..., :3].astype(np.float64), PIXELS[..., 3:].astype(np.float64)
    made = slide_picture(replace(PLAIN, density=0.5))
    np.testing.assert_allclose(made.pixels, 0.5 + 0.5 * (alpha * rgb + 1.0 - alpha), rtol=1e-6)
    assert (made.outside, made.behind, made.scale) == (0.5, 0.5, (2.0, 1.0))
    grey = slide_picture(replace(PLAIN, use="COOKIE", invert=True, frame=False))
    luminance = rgb @ [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(
        grey.pixels[..., 1], alpha[..., 0] * (1.0 - luminance) + 1.0 - alpha[..., 0], rtol=1e-6
    )
    assert (grey.outside, grey.behind) == (1.0, 1.0)
    tiled = slide_picture(replace(PLAIN, repeat=True, frame=False))
    assert tiled.behind == 0.0


@pytest.mark.parametrize("blur", [0.05, 0.2, 1.0])
def test_a_blurred_edge_is_the_error_function(blur: float) -> None:
    """A white slide in a black frame fades by Gauss' integral; a large blur by a coarser grid."""
    side = 64
    white = Slide(np.ones((side, side, 4), dtype=np.float32), "i", "SLIDE", blur=blur)
    made = slide_picture(white)
    rows = made.pixels.shape[0]
    at = ((np.arange(rows) + 0.5) / rows - 0.5) * made.scale[1]
    # Of the slide's own height, which is 1 and the smaller side.
    share = [special.ndtr((edge + sign * at) / blur) for edge, sign in ((0.5, 1), (0.5, -1))]
    profile = share[0] + share[1] - 1.0
    middle = made.pixels.shape[1] // 2
    want = profile * np.interp(0.0, at, profile)
    # What ends four deviations out is 3e-5. Texels are means, of a slope of up to 0.4 a deviation
    # whose curvature over a texel (a sixteenth to an eighth of a deviation) is 1e-3.
    np.testing.assert_allclose(made.pixels[:, middle, 0], want, atol=2e-3)
    assert made.pixels[0].max() < 1e-3


@pytest.mark.parametrize("blur", [0.1, 0.5])
def test_a_blurred_slide_that_repeats_goes_on(blur: float) -> None:
    made = slide_picture(replace(PLAIN, blur=blur, repeat=True))
    through = slide_picture(PLAIN).pixels.astype(np.float64)
    want = ndimage.gaussian_filter(through, (blur * 12, blur * 12, 0), mode="wrap", truncate=6.0)
    assert made.scale == PLAIN.scale
    # A Gaussian of 1.2 texels that is sampled differs a little from one that is not.
    np.testing.assert_allclose(made.pixels, want, atol=2e-3)


def test_a_large_blur_is_made_of_fewer_texels() -> None:
    big = Slide(np.ones((1000, 2000, 4), dtype=np.float32), "i", blur=0.3)
    assert slide_picture(big).pixels.size < 1e6


def test_fewer_texels_are_blurred_no_more() -> None:
    """The means of 3 x 3 texels blur a little by themselves, which is taken off: a wave's
    amplitude is what the Gaussian leaves of it."""
    wave = 0.5 + 0.5 * np.cos(2.0 * np.pi * (np.arange(96) + 0.5) / 96)
    pixels = np.ones((96, 96, 4), dtype=np.float32)
    pixels[..., :3] = wave[:, None, None]
    made = slide_picture(Slide(pixels, "i", "SLIDE", blur=0.25, repeat=True)).pixels
    assert made.shape == (32, 32, 3)
    left = np.exp(-2.0 * (np.pi * 0.25) ** 2)
    want = 0.5 + 0.5 * left * np.cos(2.0 * np.pi * (np.arange(32) + 0.5) / 32)
    # float32 is left; without the correction 2e-4 to 4e-4 is.
    np.testing.assert_allclose(made[:, 5, 1], want, atol=1e-6)
