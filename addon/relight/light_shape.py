# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that shape a light in the shader: cones, grids, and the cell that a sample stands for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.light import NARROWEST_SPREAD, Light

# A spot without blend has a step of no width; this is steep enough to be one in float32, whose
# cosines are 6e-8 apart.
_STEEPEST = 1e9

# Between 2 and 4 lies the least error against Cycles, of 1, 2, 4 and 8, for square and round
# lights in surfaces of roughness 0.1 to 0.3, with 8 and with 32 points.
_OVERLAP = 3.0


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
    """The squared radius of the part of the light that one of `count` points stands for.

    A lobe narrower than the gaps between a light's points would show the points one by one, so
    specular lobes see a disk around each. Disks of an even share of the light's would leave
    gaps and overlap elsewhere, since the points are not evenly spread; these are _OVERLAP as large.

    Returns:
        radians squared for a sun, square metres for others.
    """
    share = (1.0 if count == 1 else _OVERLAP) / count
    if light.type == "SUN":
        return light.solid_angle / np.pi * share
    if light.type in ("AREA", "MESH"):
        return light.area / np.pi * share
    return light.shadow_soft_size**2 * share
