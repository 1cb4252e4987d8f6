# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions that the world's light is drawn from, the same for all pixels of a sample.

Texels of the picture are chosen by their light (M. Pharr, W. Jakob and G. Humphreys, "Physically
Based Rendering", 12.5: infinite area lights), with points of Sobol's sequence, whose first 2^n
are spread over the picture as evenly as 2^n points can be (I. M. Sobol, "On the distribution of
points in a cube and the approximate evaluation of integrals", 1967).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...corrmap.sobol_points import sobol_bits
from ..light_points.light_cells import SPOTS, unit_spots
from .equirect import LUMINANCE, bilinear, direction_at, directions, solid_angles, texel_means

Array = NDArray[np.float64]

# Share of the directions that are even over the sphere: where the picture is dark, what lies
# between its texels' centres need not be.
_EVEN = 0.1


@dataclass(frozen=True)
class Directions:
    """Some directions towards the world.

    Attributes:
        toward: (N, 3) float64 unit vectors.
        radiance: (N, 3) float64, of the picture there.
        density: (N,) float64, such directions per steradian and sample.
        cell_sq: squared angular radius of what each stands for, in narrow lobes; 0 where these
            have rays of their own.
        spots: (N, SPOTS, 3) float64 unit vectors: places in what each stands for, to which traced
            shadows look; or none of them.
    """

    toward: Array
    radiance: Array
    density: Array
    cell_sq: float = 0.0
    spots: Array = field(default_factory=lambda: np.zeros((0, SPOTS, 3)))

    def each(self) -> Iterator[Directions]:
        """One by one."""
        for i in range(len(self.toward)):
            one = slice(i, i + 1)
            yield Directions(
                self.toward[one],
                self.radiance[one],
                self.density[one],
                self.cell_sq,
                self.spots[one],
            )


class DirectionSource:
    """Draws directions from one picture.

    Args:
        picture: (H, W, 3) radiance, not negative.
        even: share of the directions that are spread evenly, whatever is there.

    Attributes:
        density: (H, W) float64, probability per steradian, the same all over a texel.
    """

    def __init__(self, picture: Array, even: float = _EVEN) -> None:
        height, width, _ = picture.shape
        weight = np.broadcast_to(solid_angles(height, width), (height, width))
        light = texel_means(np.abs(picture @ LUMINANCE))
        largest = float(light.max())
        # Of its largest value, so that no sum overflows or vanishes.
        share = light / largest * weight if largest > 0.0 else weight
        share = (1.0 - even) * share / share.sum() + even * weight / weight.sum()
        self.density = share / weight
        self._picture = picture
        self._rows = np.concatenate([[0.0], np.cumsum(share.sum(axis=1))])
        self._columns = np.concatenate([np.zeros((height, 1)), np.cumsum(share, axis=1)], axis=1)
        self._middle = np.einsum("hw,hwk->k", share, directions(height, width))

    def draw(
        self, points: Array, number: float, of: tuple[Array, Array] | None = None
    ) -> Directions:
        """Draw some.

        Args:
            points: (N, 2) in [0, 1), one for each direction.
            number: of directions in each sample.
            of: the sums of the pictures (H, W, 3) and densities (H, W) of several sources, to
                draw the part of their sum's directions that is this one's.
        """
        picture, density = (self._picture, self.density) if of is None else of
        height, width, _ = self._picture.shape
        row, column, at = self._places(points)
        return Directions(
            toward=direction_at(*at, width, height),
            radiance=bilinear(picture, *at),
            density=number * density[row, column],
        )

    def spots(self, points: Array, total: int, first: int = 0) -> Array:
        """(N, SPOTS, 3) unit directions in what each of points (N, 2) of Sobol's sequence stands
        for: its part of the unit square, in which of the sequence's first 2^n there is one.

        Args:
            points: of the sequence.
            total: how many there are of it.
            first: the number of the first.
        """
        digits = max(int(np.log2(max(total, 1))), 0)
        parts = 2.0 ** np.array([(digits + 1) // 2, digits // 2])
        order = np.arange(SPOTS) ^ ((first + np.arange(len(points))) % SPOTS)[:, None]
        inside = np.floor(points * parts)[:, None] + unit_spots()[order]
        height, width, _ = self._picture.shape
        _, _, at = self._places((inside / parts).reshape(-1, 2))
        return direction_at(*at, width, height).reshape(-1, SPOTS, 3)

    def _places(
        self, points: Array
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[Array, Array]]:
        """Of points (N, 2) the texels' rows and columns, and the places in the picture."""
        height = len(self._picture)
        row, y = _invert(self._rows, points[:, 1])
        column, x = np.empty_like(row), np.empty(len(points))
        for i, r in enumerate(row):
            column[i : i + 1], x[i : i + 1] = _invert(self._columns[r], points[i : i + 1, 0])
        # Even in the sine of latitude, which is even in solid angle.
        low, high = (np.sin(np.pi * (edge / height - 0.5)) for edge in (row, row + 1))
        sine = np.clip(low + (high - low) * y, -1.0, 1.0)
        return row, column, (column + x, (np.arcsin(sine) / np.pi + 0.5) * height)

    @property
    def middle(self) -> Array:
        """(3,) unit direction of what is bright, as its light weights it."""
        return np.asarray(self._middle / np.linalg.norm(self._middle))


class SunSource:
    """Draws directions towards suns: one of each for each sample.

    Args:
        suns: (H, W, 3) radiance each, zero but for a patch.

    Attributes:
        picture: (H, W, 3) float64: all of them.
        density: (H, W) float64: directions that a sample draws, per steradian.
    """

    def __init__(self, suns: Sequence[Array]) -> None:
        self._sources = [DirectionSource(sun, even=0.0) for sun in suns]
        self.picture = np.sum(suns, axis=0)
        self.density = np.sum([source.density for source in self._sources], axis=0)
        weight = solid_angles(*self.density.shape)
        self._energy = np.array([np.einsum("hwc,ho->c", sun, weight) for sun in suns])
        extents = [(source.density > 0.0) * weight for source in self._sources]
        self._cell_sq = float(np.mean([extent.sum() for extent in extents]) / np.pi)

    @property
    def middles(self) -> Directions:
        """One direction for each sun, that stands for all of it."""
        toward = np.stack([source.middle for source in self._sources])
        return Directions(toward, self._energy, np.ones(len(toward)), self._cell_sq)

    def draw(self, k: int, count: int) -> Directions:
        """One direction within each sun, of sample k of `count`."""
        points = [sobol_points(0, count, seed=1 + i) for i in range(len(self._sources))]
        drawn = [
            source.draw(some, 1.0, (self.picture, self.density))
            for source, some in zip(self._sources, points, strict=True)
        ]
        # Between a patch's texels the picture falls steeply, while a texel's density is even. So
        # that all samples together have the suns' own light, they are scaled by what they lack.
        light = np.sum([(d.radiance / d.density[:, None]).mean(axis=0) for d in drawn], axis=0)
        whole = self._energy.sum(axis=0)
        scale = np.where(light > 0.0, whole / np.where(light > 0.0, light, 1.0), 1.0)
        return Directions(
            toward=np.stack([d.toward[k] for d in drawn]),
            radiance=np.stack([d.radiance[k] for d in drawn]) * scale,
            density=np.stack([d.density[k] for d in drawn]),
            spots=np.concatenate(
                [
                    source.spots(some[k : k + 1], count, k)
                    for source, some in zip(self._sources, points, strict=True)
                ]
            ),
        )


def _invert(cumulative: Array, u: Array) -> tuple[NDArray[np.int64], Array]:
    """Cells (N,) of a rising table whose share of it holds `u` in [0, 1), and the place within."""
    at = u * cumulative[-1]
    cell = np.searchsorted(cumulative, at, side="right") - 1
    cell = np.clip(cell, 0, len(cumulative) - 2)
    width = cumulative[cell + 1] - cumulative[cell]
    part = np.where(width > 0.0, (at - cumulative[cell]) / np.where(width > 0.0, width, 1.0), 0.5)
    return cell, np.clip(part, 0.0, np.nextafter(1.0, 0.0))


def sobol_points(first: int, count: int, seed: int = 0) -> Array:
    """(count, 2) points of the first two dimensions of Sobol's sequence, from number `first` on,
    with all digits turned by the seed's."""
    bits = sobol_bits(np.arange(first, first + count).astype(np.uint32))
    turn = np.random.default_rng(seed).integers(0, 1 << 32, 2, dtype=np.uint64)
    return (bits ^ turn).astype(np.float64) / 2.0**32
