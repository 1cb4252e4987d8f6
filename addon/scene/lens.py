# SPDX-License-Identifier: GPL-3.0-or-later
"""A thin lens, as Cycles has it: what lies off the plane in focus is blurred by its opening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Lens:
    """The opening of a camera's lens.

    Attributes:
        radius: of the opening, metres; above 0.
        focus_distance: metres along the camera's axis to the plane in focus; above 0.
        blades: corners of the opening, or fewer than 3 for a disk.
        rotation: radians, counter-clockwise as the camera sees it.
        ratio: how much higher than wide the opening is (anamorphic bokeh).
    """

    radius: float
    focus_distance: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0

    def points(self, uniform: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 2) metres right of and above the lens's middle, evenly over the opening, from
        (N, 2) in [0, 1)."""
        points = _disk(uniform) if self.blades < 3 else self._polygon(uniform)
        return np.asarray(points * [self.radius / self.ratio, self.radius])

    def _polygon(self, uniform: NDArray[np.float64]) -> NDArray[np.float64]:
        """In a regular polygon of radius 1, an edge's middle at the angle `rotation`."""
        scaled = uniform[:, 0] * self.blades
        sector = np.floor(scaled)
        # Evenly over a triangle: the share of its height goes with the root.
        height = np.sqrt(scaled - sector)
        half = np.pi / self.blades
        x = height * np.cos(half)
        y = height * np.sin(half) * (2.0 * uniform[:, 1] - 1.0)
        angle = self.rotation + sector * 2.0 * half
        cos, sin = np.cos(angle), np.sin(angle)
        return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _disk(uniform: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evenly over the unit disk, squares to rings (Shirley and Chiu, "A Low Distortion Map
    Between Disk and Square", 1997)."""
    a, b = 2.0 * uniform.T - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.where(wide, np.pi / 4.0 * (b / a), np.pi / 2.0 - np.pi / 4.0 * (a / b))
    angle = np.nan_to_num(angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
