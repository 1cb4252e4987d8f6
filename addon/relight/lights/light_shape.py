# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that shape a light in the shader: cones, grids, and the cell that a sample stands for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.light import NARROWEST_SPREAD, Light

# A spot without blend has a step of no width; this is steep enough to be one in float32, whatever
# the cone: one of 0.01 degrees is 4e-9 wide, in steps of 2e-16.
_STEEPEST = 1e20

# Phong's lobe has no half vector, and sees a disk in a cell's place. Disks of an even share leave
# gaps between them; these are as much larger.
_OVERLAP = 1.5

# The same for a glowing object's points, which have no cells: between 2 and 4 lies the least error.
_MESH_OVERLAP = 3.0


def spot_cone(light: Light) -> NDArray[np.float64]:
    """(2,) 1 - the cosine of half the cone, and the blend's slope (Cycles' spot_smooth)."""
    one_minus_cosine = 2.0 * np.sin(0.25 * light.spot_size) ** 2
    width = one_minus_cosine * light.spot_blend
    return np.array([one_minus_cosine, min(1.0 / width, _STEEPEST) if width > 0.0 else _STEEPEST])


def spread_cone(light: Light) -> NDArray[np.float64]:
    """(2,) tangent of half the spread and the attenuation's slope, which keeps the power."""
    if light.spread >= np.pi:
        return np.zeros(2)
    half = 0.5 * max(light.spread, NARROWEST_SPREAD)
    tangent = np.tan(half)
    return np.array([tangent, 1.0 / (tangent - half)])


def has_extent(light: Light) -> bool:
    """Whether a lobe can see more than a point of it."""
    return light.type == "AREA" or light.solid_angle > 0.0 or light.has_disk


# As addon/glsl/lib/light.glsl has it: no more than that many times the light's intensity.
MOST_RADIANCE = 1e29


def cell(light: Light, parts: int, points: int = 1) -> float:
    """The squared radius of a disk as large as what lobes see of the light in one sample.

    Args:
        light: the light.
        parts: how many it is parted into; 1 where lobes see all of it.
        points: how many samples there are, for a glowing object's.

    Returns:
        radians squared for a sun, square metres for others.
    """
    if light.type == "SUN":
        return light.solid_angle / np.pi / parts
    if light.type == "AREA":
        return light.area / np.pi / parts
    if light.type == "MESH":
        return light.area / np.pi * (1.0 if points == 1 else _MESH_OVERLAP) / points
    return light.shadow_soft_size**2 / parts


def cell_overlap(parts: int) -> float:
    """How much larger than `cell` a disk is that stands for it beside others."""
    return _OVERLAP if parts > 1 else 1.0


def cell_radiance(light: Light, parts: int) -> float:
    """Radiance of what lobes see of the light in one sample, for `Light.intensity` 1: such that
    the mean over the samples is that of the whole light."""
    extent = np.pi * cell(light, parts)
    return min(1.0 / extent, MOST_RADIANCE) if extent > 0.0 else 0.0
