# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as a light: what its passes need to know of its picture.

- Diffuse: the picture convolved with the cosine, which is what a white Lambert surface reflects.
- Specular: the same with the microfacet lobe for light from straight above, for a few roughnesses
  (Karis, "Real Shading in Unreal Engine 4", 2013). That lobe is round, while the real one is
  stretched at grazing angles.

Dimmed by ambient occlusion, which knows how much of the sky is hidden but not which part, this is
the first picture. `environment` corrects the first, and replaces the second, sample by sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .equirect import directions, solid_angles

Array = NDArray[np.float64]

# Roughnesses that have a convolved picture; below the first one the picture itself is mixed in.
LOBE_ROUGHNESS = (0.25, 0.4, 0.55, 0.75, 1.0)
# Convolved pictures in all: the first is the diffuse one.
LEVELS = 1 + len(LOBE_ROUGHNESS)

# Rows of texels that are convolved: the narrowest lobe (alpha = 0.06) spreads over 14 degrees.
_LOBE_HEIGHT = 48

# Rows of the lobe matrix computed at once, to keep it in the processor's caches.
_CHUNK = 256


@dataclass(frozen=True)
class WorldLight:
    """A world's picture, prepared.

    Attributes:
        levels: (LEVELS * (h + 1), 2 h, 3) float32: convolved pictures above each other. The first
            and last row of each look straight down and up, where most floors' normals lie.
    """

    levels: NDArray[np.float32]


def prepare_world(equirect: Array) -> WorldLight:
    """Convolved pictures of (H, W, 3) radiance."""
    small = _shrink(equirect.astype(np.float64), min(_LOBE_HEIGHT, len(equirect)))
    height, width, _ = small.shape
    # Relative to the largest value, whose squares float32 may not hold.
    largest = float(np.abs(small).max()) or 1.0
    toward = directions(height, width).reshape(-1, 3).astype(np.float32)
    weight = (solid_angles(height, width) * np.ones((1, width))).ravel().astype(np.float32)
    radiance = (small / largest).reshape(-1, 3).astype(np.float32)
    levels = np.empty((LEVELS, (height + 1) * width, 3))
    seen_from = node_directions(height, width).reshape(-1, 3).astype(np.float32)
    for start in range(0, len(seen_from), _CHUNK):
        some = slice(start, start + _CHUNK)
        cosine = np.maximum(seen_from[some] @ toward.T, np.float32(0.0))
        light = cosine * weight
        half_sq = 0.5 * (1.0 + cosine)  # cos^2 of half the angle: NoH^2
        for level, roughness in enumerate((None, *LOBE_ROUGHNESS)):
            lobe = light
            if roughness is not None:
                # D(NoH) NoL / 4 with N = V = R.
                lobe = light / (1.0 - half_sq * np.float32(1.0 - roughness**4)) ** 2
            total = lobe.sum(axis=1, keepdims=True)
            levels[level, some] = (lobe @ radiance) / np.where(total > 0.0, total, 1.0)
    levels *= largest
    return WorldLight(levels.reshape(-1, width, 3).astype(np.float32))


def node_directions(height: int, width: int) -> Array:
    """(height + 1, width, 3) unit directions of a level's texels: rows from pole to pole."""
    latitude = np.pi * (np.arange(height + 1) / height - 0.5)
    longitude = np.pi * (1.0 - 2.0 * (np.arange(width) + 0.5) / width)
    cosine = np.cos(latitude)[:, None]
    return np.stack(
        [
            cosine * np.cos(longitude),
            cosine * np.sin(longitude),
            np.broadcast_to(np.sin(latitude)[:, None], (height + 1, width)),
        ],
        axis=-1,
    )


def _shrink(picture: Array, height: int) -> Array:
    """The means over (height, 2 height, 3) larger texels: each has the light that falls into it."""
    rows, columns, _ = picture.shape
    # Even in the sine of latitude, as solid angles are.
    tall = _overlaps(*(np.sin(np.pi * (np.arange(n + 1) / n - 0.5)) for n in (height, rows)))
    wide = _overlaps(*(np.arange(n + 1) / n for n in (2 * height, columns)))
    return np.einsum("hr,wk,rkc->hwc", tall, wide, picture, optimize=True)


def _overlaps(large: Array, small: Array) -> Array:
    """(L, S) the share of each interval between `large` edges that lies in each of `small`'s."""
    low = np.maximum(large[:-1, None], small[:-1])
    high = np.minimum(large[1:, None], small[1:])
    return np.asarray(np.maximum(high - low, 0.0) / np.diff(large)[:, None])
