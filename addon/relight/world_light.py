# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as a light: what its passes need to know of its picture.

- Diffuse: nine spherical harmonics of the irradiance (Ramamoorthi and Hanrahan, "An Efficient
  Representation for Irradiance Environment Maps", 2001).
- Specular: the picture convolved with the microfacet lobe for light from straight above, for a
  few roughnesses (Karis, "Real Shading in Unreal Engine 4", 2013). That lobe is round, while
  the real one is stretched at grazing angles.

Both are dimmed by ambient occlusion, which knows how much of the sky is hidden but not which
part: sharp shadows of a small sun in the picture are not there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Roughnesses that have a convolved picture; below the first one the picture itself is mixed in.
LOBE_ROUGHNESS = (0.25, 0.4, 0.55, 0.75, 1.0)

# Convolved pictures' height: the narrowest lobe (alpha = 0.06) spreads over 14 degrees.
_LOBE_HEIGHT = 48

# Rows of the lobe matrix computed at once, to keep it in the processor's caches.
_CHUNK = 256


@dataclass(frozen=True)
class WorldLight:
    """A world's picture, prepared.

    Attributes:
        irradiance: (9, 3) float64: radiance's harmonics times the cosine lobe's, over pi: dotted
            with the harmonics of a normal they give what a white Lambert surface reflects.
        lobes: (len(LOBE_ROUGHNESS) * h, 2 h, 3) float32: convolved pictures above each other.
    """

    irradiance: NDArray[np.float64]
    lobes: NDArray[np.float32]


def directions(height: int, width: int) -> NDArray[np.float64]:
    """(height, width, 3) unit directions of an equirectangular picture's texels, in Blender's
    mapping: u = 1/2 - atan2(y, x) / 2 pi (the middle looks along +X), row 0 straight down."""
    latitude = np.pi * ((np.arange(height) + 0.5) / height - 0.5)
    u = (np.arange(width) + 0.5) / width
    longitude = np.pi * (1.0 - 2.0 * u)
    cosine = np.cos(latitude)[:, None]
    return np.stack(
        [
            cosine * np.cos(longitude),
            cosine * np.sin(longitude),
            np.broadcast_to(np.sin(latitude)[:, None], (height, width)),
        ],
        axis=-1,
    )


def solid_angles(height: int, width: int) -> NDArray[np.float64]:
    """(height, 1) steradians of each texel of a row; exact, so that they add up to 4 pi."""
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    return (np.diff(edges) * 2.0 * np.pi / width)[:, None]


def harmonics(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nine real spherical harmonics up to order 2: (..., 3) to (..., 9)."""
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.stack(
        [
            np.full_like(x, 0.5 / np.sqrt(np.pi)),
            np.sqrt(3.0 / (4.0 * np.pi)) * y,
            np.sqrt(3.0 / (4.0 * np.pi)) * z,
            np.sqrt(3.0 / (4.0 * np.pi)) * x,
            np.sqrt(15.0 / (4.0 * np.pi)) * x * y,
            np.sqrt(15.0 / (4.0 * np.pi)) * y * z,
            np.sqrt(5.0 / (16.0 * np.pi)) * (3.0 * z * z - 1.0),
            np.sqrt(15.0 / (4.0 * np.pi)) * x * z,
            np.sqrt(15.0 / (16.0 * np.pi)) * (x * x - y * y),
        ],
        axis=-1,
    )


# The clamped cosine's harmonics over pi, by order (Ramamoorthi and Hanrahan, eq. 9).
_COSINE = np.array([1.0] + [2.0 / 3.0] * 3 + [0.25] * 5)


def prepare_world(equirect: NDArray[np.float32]) -> WorldLight:
    """Harmonics and convolved pictures of (H, W, 3) float32 radiance."""
    height, width, _ = equirect.shape
    weight = solid_angles(height, width)
    basis = harmonics(directions(height, width))
    radiance = equirect.astype(np.float64)
    coefficients = np.einsum("hwk,hwc->kc", basis, radiance * weight[..., None])
    small = _shrink(radiance, min(_LOBE_HEIGHT, height))
    lobes = [_convolve(small, roughness) for roughness in LOBE_ROUGHNESS]
    return WorldLight(_COSINE[:, None] * coefficients, np.concatenate(lobes).astype(np.float32))


def _shrink(picture: NDArray[np.float64], height: int) -> NDArray[np.float64]:
    """Box-filter to (height, 2 height, 3), each texel weighted by its solid angle."""
    rows, columns, _ = picture.shape
    weight = solid_angles(rows, columns) * np.ones((1, columns))
    row = (np.arange(rows) * height) // rows
    column = (np.arange(columns) * 2 * height) // columns
    index = row[:, None] * (2 * height) + column
    total = np.bincount(index.ravel(), weight.ravel(), 2 * height * height)
    sums = [
        np.bincount(index.ravel(), (weight * picture[..., c]).ravel(), 2 * height * height)
        for c in range(3)
    ]
    filled = np.where(total > 0.0, total, 1.0)
    return np.stack([s / filled for s in sums], axis=-1).reshape(height, 2 * height, 3)


def _convolve(picture: NDArray[np.float64], roughness: float) -> NDArray[np.float64]:
    """The picture seen through the lobe with N = V = R: weights D(NoH) NoL / 4 and normalized."""
    height, width, _ = picture.shape
    toward = directions(height, width).reshape(-1, 3).astype(np.float32)
    weight = (solid_angles(height, width) * np.ones((1, width))).ravel().astype(np.float32)
    radiance = picture.reshape(-1, 3).astype(np.float32)
    alpha_sq = np.float32(roughness**4)
    result = np.empty_like(radiance)
    for start in range(0, len(toward), _CHUNK):
        cosine = np.maximum(toward[start : start + _CHUNK] @ toward.T, 0.0)
        NoH_sq = 0.5 * (1.0 + cosine)  # cos^2 of half the angle
        lobe = cosine * weight / (1.0 - NoH_sq * (1.0 - alpha_sq)) ** 2
        result[start : start + _CHUNK] = (lobe @ radiance) / lobe.sum(axis=1, keepdims=True)
    return result.reshape(picture.shape).astype(np.float64)
