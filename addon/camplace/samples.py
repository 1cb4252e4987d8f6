# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface points that stand for the surface when cameras are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Samples:
    """Oriented surface points, in the local frame.

    Attributes:
        point: (S, 3) float64.
        normal: (S, 3) float64, unit, on the side of the surface that is to be cached.
        weight: (S,) float64, together 1.
        pixels: (S, 2, 3) float64: a step along the surface times this is a step in the
            picture, in pixels, of the view that the sample must satisfy.
        triangle: (S,) int64, where the point lies.
        from_view: (S,) bool, whether it was shot through a pixel.
    """

    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    weight: NDArray[np.float64]
    pixels: NDArray[np.float64]
    triangle: NDArray[np.int64]
    from_view: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.point)

    def __getitem__(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> Samples:
        return Samples(
            self.point[index],
            self.normal[index],
            self.weight[index],
            self.pixels[index],
            self.triangle[index],
            self.from_view[index],
        )

    @cached_property
    def tangents(self) -> NDArray[np.float64]:
        """(S, 3, 2) two unit vectors along the surface, as columns."""
        return tangent_basis(self.normal)

    @cached_property
    def pixels_from_surface(self) -> NDArray[np.float64]:
        """(S, 2, 2): pixels moved in the picture for a step along each tangent."""
        return np.asarray(self.pixels @ self.tangents)

    @cached_property
    def footprint(self) -> NDArray[np.float64]:
        """(S,) side of the square as large as a pixel of the view on the surface."""
        return 1.0 / np.sqrt(np.abs(np.linalg.det(self.pixels_from_surface)))


def tangent_basis(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3) unit normals to (..., 3, 2) orthonormal tangents as columns.

    The branchless basis of Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
    """
    x, y, z = np.moveaxis(normal, -1, 0)
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return np.stack([first, second], axis=-1)


def joined_samples(parts: Sequence[Samples]) -> Samples:
    """One after the other; at least one part."""
    return Samples(
        np.concatenate([part.point for part in parts]),
        np.concatenate([part.normal for part in parts]),
        np.concatenate([part.weight for part in parts]),
        np.concatenate([part.pixels for part in parts]),
        np.concatenate([part.triangle for part in parts]),
        np.concatenate([part.from_view for part in parts]),
    )
