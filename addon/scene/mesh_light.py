# SPDX-License-Identifier: GPL-3.0-or-later
"""An object whose surface glows, as a light."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .light import Light

# Rec.709's luminance: how much a colour's components count where triangles are chosen.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# Bits of each coordinate in the order of triangles: finer than any light's points.
_MORTON_BITS = 10


def _no_triangles() -> NDArray[np.float64]:
    return np.zeros((0, 3, 3))


def _no_radiance() -> NDArray[np.float64]:
    return np.zeros((0, 3))


@dataclass(frozen=True)
class MeshLight(Light):
    """A glowing object under the attributes of a light.

    It shines from both sides, equally bright from everywhere, as emission does in Cycles; there
    `emission_sampling` decides only how noise is kept low. `color` is its intensity in W/sr along
    the normal, were it flat: radiance times area; `energy` is a factor, 1 as it was baked.

    Attributes:
        corners: (N, 3, 3) float64, world space, metres: its triangles, in an order in which
            neighbours are near each other.
        radiance: (N, 3) float64 of each, linear Rec.709, W/(m2 sr); not negative.
    """

    corners: NDArray[np.float64] = field(default_factory=_no_triangles)
    radiance: NDArray[np.float64] = field(default_factory=_no_radiance)

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """(N, 3) float64 unit normals, by the corners' winding."""
        cross = self._cross
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.asarray(cross / np.where(length > 0.0, length, 1.0))

    @cached_property
    def areas(self) -> NDArray[np.float64]:
        """(N,) float64, square metres."""
        return np.asarray(0.5 * np.linalg.norm(self._cross, axis=1))

    @cached_property
    def area(self) -> float:
        """Of all triangles, square metres; either side counts once."""
        return float(self.areas.sum())

    @cached_property
    def chances(self) -> NDArray[np.float64]:
        """(N,) float64, the share of points that each triangle gets: that of its power."""
        power = self.areas * (self.radiance @ _LUMINANCE)
        return np.asarray(power / power.sum())

    @cached_property
    def ends(self) -> NDArray[np.float64]:
        """(N,) float64: sums of `chances` up to each, the last one 1."""
        sums = np.cumsum(self.chances)
        return np.asarray(sums / sums[-1])

    @property
    def _cross(self) -> NDArray[np.float64]:
        a, b, c = self.corners.swapaxes(0, 1)
        return np.cross(b - a, c - a)


def mesh_light(
    name: str,
    corners: NDArray[np.float64],
    radiance: NDArray[np.float64],
    warnings: tuple[str, ...] = (),
) -> MeshLight:
    """The light of some glowing triangles.

    Args:
        name: the object's.
        corners: (N, 3, 3) world space, metres.
        radiance: (N, 3) W/(m2 sr), linear Rec.709.
        warnings: one sentence for each thing about it that is not modelled.
    """
    glows = (radiance @ _LUMINANCE) > 0.0
    corners, radiance = corners[glows], np.maximum(radiance[glows], 0.0)
    middle = corners.mean(axis=1)
    order = np.argsort(_morton(middle), kind="stable")
    corners, radiance = corners[order], radiance[order]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    world_from_light = np.eye(4)
    if area.sum() > 0.0:
        world_from_light[:3, 3] = np.average(corners.mean(axis=1), axis=0, weights=area)
    return MeshLight(
        name=name,
        type="MESH",
        world_from_light=world_from_light,
        energy=1.0,
        color=area @ radiance,
        warnings=warnings,
        corners=corners,
        radiance=radiance,
    )


def _morton(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(N,) numbers whose order keeps points (N, 3) together that are near each other (G. M.
    Morton, 1966): the bits of their coordinates, interleaved."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    low = points.min(axis=0)
    size = float((points.max(axis=0) - low).max()) or 1.0
    cell = ((points - low) / size * (2**_MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(_MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
