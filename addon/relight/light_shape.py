# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that shape a light in the shader: cones, grids, and the cell that a sample stands for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.light import NARROWEST_SPREAD, Light

# A spot without blend has a step of no width; this is steep enough to be one in float32, whose
# cosines are 6e-8 apart.
_STEEPEST = 1e9


def spot_cone(light: Light) -> NDArray[np.float64]:
    """(2,) cosine of half the cone and the blend's slope (Cycles' spot_smooth)."""
    cosine = np.cos(0.5 * light.spot_size)
    width = (1.0 - cosine) * light.spot_blend
    return np.array([cosine, min(1.0 / width, _STEEPEST) if width > 0.0 else _STEEPEST])


def spread_cone(light: Light) -> NDArray[np.float64]:
    """(2,) tangent of half the spread and the attenuation's slope, which keeps the power."""
    if light.spread >= np.pi:
        return np.zeros(2)
    half = 0.5 * max(light.spread, NARROWEST_SPREAD)
    tangent = np.tan(half)
    return np.array([tangent, 1.0 / (tangent - half)])


def cell(light: Light, count: int) -> float:
    """What one of `count` samples stands for, as the widening of a specular lobe's alpha^2.

    A lobe narrower than the gaps between a light's points would show the points one by one.
    Each point stands for an even share of the light's disk; seen from distance t its radius
    spans an angle a, by which half vectors turn by a / 2. Slopes of independent lobes add in
    their squares: alpha^2 + (a / 2)^2. The points are not evenly spread, so twice that is
    taken: against Cycles it gave the least error of 1, 2, 4, 8 for a square light in surfaces of
    roughness 0.1 and 0.2. With more samples it vanishes.

    Returns:
        2 (a / 2)^2 for a sun, 2 (a t / 2)^2 in square metres for others.
    """
    if light.type == "SUN":
        return light.solid_angle / np.pi / (2.0 * count)
    if light.type == "AREA":
        return light.area / np.pi / (2.0 * count)
    return light.shadow_soft_size**2 / (2.0 * count)
