# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's image textures, drawn with numpy: (H, W, 4) float32, row 0 at the bottom, sRGB."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]


def _grid(height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixel centres: x and y in [0, 1], each (H, W)."""
    x = (np.arange(width) + 0.5) / width
    y = (np.arange(height) + 0.5) / height
    return np.meshgrid(x, y)


def _paint(mask: NDArray[np.bool_], image: Image, color: tuple[float, float, float]) -> None:
    image[mask, :3] = color


def _plain(height: int, width: int, color: tuple[float, float, float]) -> Image:
    image = np.ones((height, width, 4), dtype=np.float32)
    image[..., :3] = color
    return image


def rug() -> Image:
    """A woven rug: borders around a field of lozenges."""
    height, width = 384, 512
    x, y = _grid(height, width)
    image = _plain(height, width, (0.62, 0.20, 0.16))
    across, up = x * 12.0, y * 9.0
    lozenge = np.abs(across % 2.0 - 1.0) + np.abs(up % 2.0 - 1.0)
    _paint(lozenge < 0.75, image, (0.83, 0.66, 0.40))
    _paint(lozenge < 0.45, image, (0.13, 0.22, 0.34))
    _paint(lozenge < 0.18, image, (0.87, 0.80, 0.66))
    inside = np.minimum(np.minimum(x, 1.0 - x) * 4.0 / 3.0, np.minimum(y, 1.0 - y))
    _paint(inside < 0.12, image, (0.13, 0.20, 0.30))
    zigzag = np.abs((x + y) * 16.0 % 1.0 - 0.5) < 0.22
    _paint((inside < 0.09) & (inside > 0.035) & zigzag, image, (0.83, 0.66, 0.40))
    _paint(inside < 0.02, image, (0.87, 0.80, 0.66))
    return _softened(image, 3)


def _softened(image: Image, times: int) -> Image:
    """Wool has no sharp edges: the mean of each pixel and its eight neighbours, several times."""
    for _ in range(times):
        padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
        rows = padded[:-2] + padded[1:-1] + padded[2:]
        image = (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / np.float32(9.0)
    return image


def painting() -> Image:
    """Hills under an evening sun."""
    height, width = 320, 480
    x, y = _grid(height, width)
    sky = np.stack([0.95 - 0.45 * y, 0.66 - 0.25 * y, 0.42 + 0.25 * y], axis=-1)
    image = np.concatenate([sky, np.ones((height, width, 1))], axis=-1).astype(np.float32)
    _paint(np.hypot((x - 0.66) * 1.5, y - 0.62) < 0.13, image, (0.98, 0.90, 0.62))
    hills = (
        (0.50, 0.07, 5.0, 0.3, (0.55, 0.42, 0.50)),
        (0.38, 0.08, 7.0, 1.4, (0.36, 0.36, 0.44)),
        (0.24, 0.06, 9.0, 2.9, (0.20, 0.30, 0.30)),
        (0.10, 0.04, 13.0, 0.9, (0.10, 0.17, 0.16)),
    )
    for level, swing, waves, phase, color in hills:
        _paint(y < level + swing * np.sin(waves * x + phase), image, color)
    return image


def leaf() -> Image:
    """A leaf with a pale midrib; alpha is 0 outside its outline. Its stalk is at y = 0."""
    height, width = 256, 128
    x, y = _grid(height, width)
    side = np.abs(x - 0.5)
    half_width = 0.46 * np.sin(np.pi * np.clip(y, 0.0, 1.0)) ** 0.7
    veins = np.abs((y * 9.0 - side * 6.0) % 1.0 - 0.5) < 0.06
    image = _plain(height, width, (0.22, 0.45, 0.17))
    image[..., 1] += (0.10 * y).astype(np.float32)
    _paint(veins, image, (0.31, 0.55, 0.24))
    _paint(side < 0.025, image, (0.55, 0.68, 0.38))
    image[..., 3] = side < half_width
    return image


def lattice() -> Image:
    """A wooden lattice, in diagonals with a frame; alpha is 0 in the gaps."""
    height, width = 512, 192
    x, y = _grid(height, width)
    across, up = x * 4.0, y * 4.0 * height / width
    bar = np.minimum(np.abs((across + up) % 1.0 - 0.5), np.abs((across - up) % 1.0 - 0.5))
    image = _plain(height, width, (0.42, 0.25, 0.13))
    _paint(bar < 0.05, image, (0.52, 0.33, 0.18))
    edge = np.minimum(np.minimum(x, 1.0 - x), np.minimum(y, 1.0 - y) * height / width)
    image[..., 3] = (bar < 0.13) | (edge < 0.06)
    return image
