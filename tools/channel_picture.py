# SPDX-License-Identifier: GPL-3.0-or-later
"""A cached channel as a person sees it."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import NDArray

from addon.caching.channels import Channel

from .display import GOLDEN_TURN
from .metrics import encode_srgb

# Where nothing is hit: no channel is this colour elsewhere, but for a chance.
NOTHING = (0.10, 0.06, 0.16)
# Depth and emission run from this share of their values to the rest of them, so that a few
# extreme texels do not make all else one grey.
OUTERMOST = 0.01
# The farthest surface is this bright, so that it stands out from nothing.
FAR = 0.1


def channel_picture(
    channel: Channel, values: NDArray[np.float32], hit: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], str]:
    """Display values in [0, 1], (H, W, 3), and a line of figures about what is shown.

    Depth runs from white (near) to dark (far) by its logarithm; normals are (1 + n) / 2; each
    material has a colour of its own; colours are encoded for display, emission after it was
    scaled to its largest values; everything else is grey from 0 to the largest value.

    Args:
        channel: what the values are.
        values: (H, W, components).
        hit: (H, W), where the camera sees a surface.
    """
    seen = values[hit].astype(np.float64)
    if not len(seen):
        return _on_nothing(np.zeros((0, 3)), hit), "nothing is seen"
    if channel.name == "depth":
        shown, note = _depth(seen[:, 0])
    elif channel.name == "material_id":
        numbers = seen[:, 0].astype(np.int64)
        shown, note = _colors(numbers), f"{len(np.unique(numbers))} materials"
    elif channel.space == "world":
        shown, note = 0.5 + 0.5 * seen, "x, y, z as red, green, blue"
    elif channel.name == "emission":
        brightest = max(float(np.quantile(seen, 1.0 - OUTERMOST)), float(seen.max()) * 1e-6)
        shown = encode_srgb(seen / brightest) if brightest > 0.0 else np.zeros_like(seen)
        note = f"up to {seen.max():.3g} {channel.unit}"
    elif channel.components == 3:
        shown, note = encode_srgb(seen), _range(seen)
    else:
        largest = max(float(seen.max()), float(np.finfo(np.float32).tiny))
        shown, note = np.repeat(seen / largest, 3, axis=-1), _range(seen)
    return _on_nothing(np.clip(shown, 0.0, 1.0), hit), note


def _range(seen: NDArray[np.float64]) -> str:
    return f"{seen.min():.3g} to {seen.max():.3g}"


def _depth(depth: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    low, high = np.log(np.quantile(depth, (OUTERMOST, 1.0 - OUTERMOST)))
    far = (np.log(depth) - low) / max(high - low, np.finfo(np.float64).eps)
    grey = 1.0 - (1.0 - FAR) * np.clip(far, 0.0, 1.0)
    return np.repeat(grey[:, None], 3, axis=-1), f"{depth.min():.3g} to {depth.max():.3g} m"


def _colors(numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """(N, 3) a colour for each material."""
    every, inverse = np.unique(numbers, return_inverse=True)
    palette = [
        colorsys.hsv_to_rgb((number * GOLDEN_TURN) % 1.0, 0.65, 0.95) for number in every.tolist()
    ]
    return np.array(palette)[inverse]


def _on_nothing(shown: NDArray[np.float64], hit: NDArray[np.bool_]) -> NDArray[np.float64]:
    picture = np.empty((*hit.shape, 3))
    picture[:] = NOTHING
    picture[hit] = shown
    return picture
