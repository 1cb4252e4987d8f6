# SPDX-License-Identifier: GPL-3.0-or-later
"""What a slide lets through, as one picture: its use, alpha, blur and density are in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.light_controls import Slide

# Rec.709.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# How many standard deviations a blurred edge reaches: beyond are 3e-5 of it.
_REACH = 4.0

# Texels that a blurred picture keeps for each standard deviation. What bilinear interpolation
# makes of a Gaussian's curvature there is 1 / (8 * 8^2), a fifth of a percent.
_TEXELS_PER_DEVIATION = 8.0


@dataclass(frozen=True)
class SlidePicture:
    """A picture that is multiplied with the light, placed as its `Slide` is.

    Attributes:
        pixels: (H, W, 3) float32, scene-linear, row 0 at the bottom.
        scale: (x, y) metres that it covers: the slide's, and more where blur reaches beyond it.
        outside: what comes through beside it, where it does not repeat.
        behind: what comes through behind the light.
    """

    pixels: NDArray[np.float32]
    scale: tuple[float, float]
    outside: float
    behind: float


def slide_picture(slide: Slide) -> SlidePicture:
    """The picture that a slide multiplies its light by."""
    rgb = slide.pixels[..., :3].astype(np.float64)
    if slide.use == "COOKIE":
        rgb = np.repeat((rgb @ LUMINANCE)[..., None], 3, axis=-1)
    if slide.invert:
        rgb = np.maximum(1.0 - rgb, 0.0)
    through = 1.0 + slide.pixels[..., 3:].astype(np.float64) * (rgb - 1.0)
    beside = 0.0 if slide.frame else 1.0
    height, width = through.shape[:2]
    deviation = slide.blur * min(height, width)
    grown = (1.0, 1.0)
    if deviation > 0.0:
        if not slide.repeat:
            through, grown = _padded(through, beside, deviation)
        through = _blurred(through, deviation)
    thin = 1.0 - slide.density
    return SlidePicture(
        pixels=(thin + slide.density * through).astype(np.float32),
        scale=(slide.scale[0] * grown[0], slide.scale[1] * grown[1]),
        outside=thin + slide.density * beside,
        behind=thin + slide.density * (beside if not slide.repeat else 0.0),
    )


def _padded(
    picture: NDArray[np.float64], value: float, deviation: float
) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """The picture with as much around it as blur reaches, and how much wider and higher it is."""
    height, width = picture.shape[:2]
    step = _step(deviation)
    pads = [_pad(side, step, deviation) for side in (height, width)]
    around = ((pads[0], pads[0]), (pads[1], pads[1]), (0, 0))
    padded = np.pad(picture, around, constant_values=value)
    return padded, (padded.shape[1] / width, padded.shape[0] / height)


def _pad(side: int, step: int, deviation: float) -> int:
    """Texels to add on both sides, so that `step` (odd) divides the whole."""
    pad = int(np.ceil(_REACH * deviation))
    while (side + 2 * pad) % step:
        pad += 1
    return pad


def _step(deviation: float) -> int:
    """How many texels become one before blur, odd."""
    step = max(int(deviation / _TEXELS_PER_DEVIATION), 1)
    return step if step % 2 == 1 else step - 1


def _blurred(picture: NDArray[np.float64], deviation: float) -> NDArray[np.float64]:
    """Gaussian blur of a picture that repeats, on a coarser grid where that is as good."""
    height, width = picture.shape[:2]
    step = _step(deviation)
    rows = max(n for n in range(1, step + 1) if height % n == 0)
    columns = max(n for n in range(1, step + 1) if width % n == 0)
    coarse = picture.reshape(height // rows, rows, width // columns, columns, -1).mean(axis=(1, 3))
    # The mean of n texels is a blur already, of variance (n^2 - 1) / 12.
    frequencies = (np.fft.fftfreq(coarse.shape[0]), np.fft.rfftfreq(coarse.shape[1]))
    gains = [
        np.exp(-2.0 * (np.pi * f) ** 2 * (deviation**2 - (n * n - 1.0) / 12.0) / n**2)
        for f, n in zip(frequencies, (rows, columns), strict=True)
    ]
    spectrum = np.fft.rfft2(coarse, axes=(0, 1))
    spectrum *= (gains[0][:, None] * gains[1][None, :])[..., None]
    result = np.fft.irfft2(spectrum, s=coarse.shape[:2], axes=(0, 1))
    # Rounding leaves what was black a little beside it.
    return np.clip(result, picture.min(), picture.max())
