# SPDX-License-Identifier: GPL-3.0-or-later
"""Equirectangular pictures in Blender's mapping: u = 1/2 - atan2(y, x) / 2 pi (the middle looks
along +X), row 0 straight down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Rec.709's weights of red, green and blue in luminance.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def directions(height: int, width: int) -> Array:
    """(height, width, 3) unit directions of a picture's texels."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return direction_at(x, y, width, height)


def direction_at(x: Array, y: Array, width: int, height: int) -> Array:
    """(..., 3) unit directions of places in a picture, in texels from its lower left corner."""
    latitude = np.pi * (y / height - 0.5)
    longitude = np.pi * (1.0 - 2.0 * x / width)
    cosine = np.cos(latitude)
    return np.stack(
        [cosine * np.cos(longitude), cosine * np.sin(longitude), np.sin(latitude)], axis=-1
    )


def place_of(direction: Array, width: int, height: int) -> tuple[Array, Array]:
    """The inverse of `direction_at` for unit directions (..., 3): x in [0, width), y."""
    u = 0.5 - np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi)
    v = 0.5 + np.arcsin(np.clip(direction[..., 2], -1.0, 1.0)) / np.pi
    return np.asarray(u * width % width), np.asarray(v * height)


def solid_angles(height: int, width: int) -> Array:
    """(height, 1) steradians of each texel of a row; exact, so that they add up to 4 pi."""
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    return np.asarray((np.diff(edges) * 2.0 * np.pi / width)[:, None])


def bilinear(picture: Array, x: Array, y: Array) -> Array:
    """(..., C) values between the centres of a picture's texels (H, W, C); longitude goes round,
    latitude ends."""
    height, width, _ = picture.shape
    column, row = np.floor(x - 0.5).astype(np.int64), np.floor(y - 0.5).astype(np.int64)
    tx, ty = (x - 0.5 - column)[..., None], (y - 0.5 - row)[..., None]
    low, high = np.clip(row, 0, height - 1), np.clip(row + 1, 0, height - 1)
    left, right = column % width, (column + 1) % width
    bottom = picture[low, left] * (1.0 - tx) + picture[low, right] * tx
    top = picture[high, left] * (1.0 - tx) + picture[high, right] * tx
    return np.asarray(bottom * (1.0 - ty) + top * ty)


def texel_means(values: Array) -> Array:
    """The means over texels of what `bilinear` gives between (H, W) values, as if texels of a row
    and its neighbours were equally large: an eighth of each neighbour."""
    wide = 0.75 * values + 0.125 * (np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1))
    padded = np.pad(wide, ((1, 1), (0, 0)), "edge")
    return np.asarray(0.75 * wide + 0.125 * (padded[:-2] + padded[2:]))
