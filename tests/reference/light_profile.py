# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/profile_filter.glsl, from the formulas of `LightProfile`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light

Array = NDArray[np.float64]


def profile(light: Light, place: Array, sampled: Array) -> Array:
    """(…, 3) of (…, 3) world-space places, from the light's sampled point, (3,)."""
    own = light.profile
    assert own is not None
    q = (place - sampled) @ light.axes.T
    r = np.linalg.norm(q, axis=-1)
    if own.half_width > 0.0:
        before = q[..., 2] < 0.0
        across = q[..., :2] / np.where(before, -q[..., 2], 1.0)[..., None]
        uv = np.clip(0.5 + 0.5 * across / own.half_width, 0.0, 1.0)
    else:
        before = np.ones(r.shape, dtype=bool)
        longitude = np.angle(-q[..., 2] + 1j * q[..., 0])
        latitude = np.arctan2(q[..., 1], np.hypot(q[..., 0], q[..., 2]))
        uv = np.stack([0.5 + longitude / (2.0 * np.pi), 0.5 + latitude / np.pi], axis=-1)
    color = before[..., None] * _bilinear(own.pixels, uv, around=own.half_width <= 0.0)
    gain = r**own.exponent * (1.0 + own.smooth) * r**2 / (own.smooth + r**2)
    return np.asarray(color * gain[..., None])


def over_area(light: Light, sampled: Array, count: int) -> Array:
    """(3,) what an area light emits about its sampled point, (3,), of which there are `count`."""
    assert light.profile is not None
    assert light.profile.over_area is not None
    pixels = light.profile.over_area.astype(np.float64)
    mean = pixels.mean(axis=(0, 1))
    # Of the light's sides, what one sample stands for.
    while len(pixels) > 1 and len(pixels) / np.sqrt(count) >= 2.0:
        half = len(pixels) // 2
        pixels = pixels.reshape(half, 2, half, 2, 3).mean(axis=(1, 3))

    def at(place: Array) -> Array:
        from_centre = place - light.position
        uv = [0.5 + from_centre @ side / (side @ side) for side in light.extents]
        return _bilinear(pixels, np.array(uv), around=False)

    seen = np.mean([at(light_sample(light, k, count).position) for k in range(count)], axis=0)
    return at(sampled) * np.clip(mean / seen, 0.5, 2.0)


def _bilinear(pixels: NDArray[Any], uv: Array, around: bool) -> Array:
    height, width = pixels.shape[:2]
    at = uv * (width, height) - 0.5
    low = np.floor(at).astype(np.int64)
    t = at - low
    total: Array = np.zeros((*uv.shape[:-1], 3))
    for dx in (0, 1):
        for dy in (0, 1):
            x, y = low[..., 0] + dx, np.clip(low[..., 1] + dy, 0, height - 1)
            x = x % width if around else np.clip(x, 0, width - 1)
            weight = np.abs(1 - dx - t[..., 0]) * np.abs(1 - dy - t[..., 1])
            total = total + weight[..., None] * pixels[y, x]
    return total
