# SPDX-License-Identifier: GPL-3.0-or-later
"""Where receivers see the points of a lamp's disk, which turns towards each of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.frame_across import frame_across
from ...scene.light import Light


def turned_way(
    light: Light, from_centre: NDArray[np.float64], place: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, 3) metres: from receivers to their points of a lamp.

    As `turned_way` in addon/glsl/lib/light.glsl (point_light_sample, spot_light_sample): on the
    disk across the way to a receiver, or where a direction of the cone meets the lamp's ball.

    Args:
        light: a point or spot light with a radius.
        from_centre: (N, 3) metres, from the lamp's centre to the receivers.
        place: (N, 2) metres, the points on the disk across the light's axis.
    """
    distance = np.linalg.norm(from_centre, axis=1)
    axis = from_centre / np.where(distance > 0.0, distance, 1.0)[:, None]
    offset = place @ frame_across(light.direction)
    halfway = axis + light.direction
    halfway_sq = _dot(halfway, halfway)
    share = 2.0 * _dot(offset, halfway) / np.where(halfway_sq > 0.0, halfway_sq, 1.0)
    offset = offset - share[:, None] * halfway
    if light.use_soft_falloff:
        return np.asarray(offset - from_centre)
    radius = light.shadow_soft_size
    outside = distance > radius
    sine = np.where(outside, radius / np.maximum(distance, radius), 1.0)
    widest = np.where(outside, sine * sine / (1.0 + np.sqrt(1.0 - sine * sine)), 2.0)
    size = np.linalg.norm(place, axis=1)
    one_minus_cos = np.minimum(widest * (size / radius) ** 2, 2.0)
    around = np.sqrt(one_minus_cos * (2.0 - one_minus_cos))
    direction = offset * (around / np.where(size > 0.0, size, 1.0))[:, None]
    direction -= (1.0 - one_minus_cos)[:, None] * axis
    chord = np.sqrt(np.maximum(radius**2 - (distance * around) ** 2, 0.0))
    reach = distance * (1.0 - one_minus_cos) + np.where(outside, -chord, chord)
    return np.asarray(np.maximum(reach, 1e-7 * radius)[:, None] * direction)


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("nx,nx->n", a, b))
