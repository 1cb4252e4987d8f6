# SPDX-License-Identifier: GPL-3.0-or-later
"""How far one picture is from another.

Kim, Kyung and Lee (2009), Table 1, give the PSNR of 8-bit pictures in YUV; the same is
computed here for display-encoded RGB and for its luma. relMSE and HDR-FLIP look at the
scene-linear values, so they also see errors in what a display would clip.

Pictures are (H, W, 3) float arrays, row 0 at the bottom, either scene-linear Rec.709 or
display-encoded in [0, 1].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.floating]
Mask = NDArray[np.bool_]

# ITU-R BT.601, the YUV of the paper's time and of most codecs' 8-bit pictures.
LUMA = np.array([0.299, 0.587, 0.114])
# Rousselle, Knaus, Zwicker (2011), "Adaptive Sampling and Reconstruction using Greedy Error
# Minimization", section 5: added to the squared reference, so that black pixels do not
# divide by zero. It is relative to a display's white, which is 1 in both spaces.
RELATIVE_MSE_FLOOR = 0.01
# Wang, Bovik, Sheikh, Simoncelli (2004), "Image Quality Assessment: From Error Visibility to
# Structural Similarity", section III.B: the window's width in pixels, and K1, K2 of equation 13.
SSIM_SIGMA, SSIM_RADIUS = 1.5, 5
SSIM_K1, SSIM_K2 = 0.01, 0.03


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """Scene-linear values to sRGB's (IEC 61966-2-1), clipped to [0, 1] first.

    This is Blender's "Standard" view without looks, the plainest of displays; a filmic view
    transform would hide errors in the highlights.
    """
    value = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * value ** (1.0 / 2.4) - 0.055)


def quantize(encoded: NDArray[np.floating]) -> NDArray[np.float64]:
    """Display-encoded values in [0, 1] to whole numbers from 0 to 255."""
    return np.rint(np.clip(np.asarray(encoded, dtype=np.float64), 0.0, 1.0) * 255.0)


def psnr(mean_squared_error: float) -> float:
    """Peak signal-to-noise ratio in decibels at a peak of 255; infinite without an error."""
    if mean_squared_error == 0.0:
        return math.inf
    return 10.0 * math.log10(255.0**2 / mean_squared_error)


def squared_error(
    reference: NDArray[np.float64], image: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per pixel, between two quantized pictures: the mean over RGB, and luma's, both (H, W)."""
    difference = image - reference
    return np.mean(difference**2, axis=-1), (difference @ LUMA) ** 2


def relative_squared_error(reference: Picture, image: Picture) -> NDArray[np.float64]:
    """(H, W): (x - r)² / (r² + floor), the mean over RGB; scene-linear pictures."""
    wanted = np.asarray(reference, dtype=np.float64)
    error = (np.asarray(image, dtype=np.float64) - wanted) ** 2
    return np.mean(error / (wanted**2 + RELATIVE_MSE_FLOOR), axis=-1)


def structural_similarity(
    reference: NDArray[np.float64], image: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(H, W) SSIM of luma, at most 1, of two quantized pictures (Wang et al. 2004, equation 13).

    Windows that reach over the border see the picture mirrored in it.
    """
    from scipy.ndimage import gaussian_filter

    def windowed(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return gaussian_filter(values, SSIM_SIGMA, radius=SSIM_RADIUS, mode="reflect")

    x, y = reference @ LUMA, image @ LUMA
    mean_x, mean_y = windowed(x), windowed(y)
    # Variances are differences of large numbers; rounding must not make them negative.
    variance_x = np.maximum(windowed(x * x) - mean_x**2, 0.0)
    variance_y = np.maximum(windowed(y * y) - mean_y**2, 0.0)
    covariance = windowed(x * y) - mean_x * mean_y
    c1, c2 = (SSIM_K1 * 255.0) ** 2, (SSIM_K2 * 255.0) ** 2
    luminance = (2.0 * mean_x * mean_y + c1) / (mean_x**2 + mean_y**2 + c1)
    structure = (2.0 * covariance + c2) / (variance_x + variance_y + c2)
    return np.asarray(luminance * structure)


def mean_over(values: NDArray[np.floating], mask: Mask | None) -> float | None:
    """The mean of the pixels in the mask, or of all; None when the mask is empty."""
    chosen = values if mask is None else values[mask]
    return float(np.mean(chosen)) if chosen.size else None


def flip_map(reference: Picture, image: Picture, *, linear: bool) -> NDArray[np.float32]:
    """(H, W) FLIP error in [0, 1] at the usual 67 pixels a degree (Andersson et al. 2020, 2021).

    Scene-linear pictures are measured with HDR-FLIP, whose exposures come from the reference,
    display-encoded ones with LDR-FLIP. A reference that is black all over gives no
    exposures (the package would end the process), so that one is measured at -1 and +1 stop.
    """
    import flip_evaluator

    low, high = 0.0, (math.inf if linear else 1.0)
    pictures = [
        np.ascontiguousarray(np.clip(picture[::-1], low, high), dtype=np.float32)
        for picture in (reference, image)
    ]
    parameters: dict[str, float] = {}
    if linear and not pictures[0].any():
        parameters = {"startExposure": -1.0, "stopExposure": 1.0}
    errors, _, _ = flip_evaluator.evaluate(
        *pictures, "HDR" if linear else "LDR", applyMagma=False, parameters=parameters
    )
    top_down = np.asarray(errors, dtype=np.float32).reshape(reference.shape[:2])
    return np.ascontiguousarray(top_down[::-1])
