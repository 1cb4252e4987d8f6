# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells of planes, which tell what lies near what in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

# Pairs at once.
PART = 1 << 18

# The sides of cells are powers of two; what is no larger than a cell lies in at most 2 x 2 of them.
_CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))

# Odd numbers whose bits are well mixed.
_HASH = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)

type Pairs = tuple[NDArray[np.int64], NDArray[np.int64]]


class PlaneCells:
    """Triangles in planes, each in the cells of its size.

    Attributes:
        low: (2, N) metres: the least of the triangles' coordinates.
        high: (2, N) the greatest.

    Args:
        plane: (N,) a number for the plane of each triangle.
        corners: (N, 3, 2) metres: where they are in it.
    """

    def __init__(self, plane: NDArray[np.integer], corners: NDArray[np.float64]) -> None:
        # Components come first: numpy works on long rows several times faster than on pairs.
        self.low, self.high = _least(corners), -_least(-corners)
        self._plane = plane
        self._sizes: list[tuple[float, NDArray[np.uint64], NDArray[np.int64]]] = []
        _, exponent = np.frexp(np.maximum(*(self.high - self.low)))
        for size in np.unique(exponent):
            some, side = np.flatnonzero(exponent == size), float(np.ldexp(1.0, size))
            keys, owner = _cells(plane[some], self.low[:, some], self.high[:, some], side)
            order = np.argsort(keys, kind="stable")
            self._sizes.append((side, keys[order], some[owner[order]]))

    def near(
        self,
        plane: NDArray[np.integer],
        low: NDArray[np.float64],
        high: NDArray[np.float64],
    ) -> Iterator[Pairs]:
        """Bounds and triangles in the same plane that overlap or touch and of which the bounds are
        the smaller, to a power of two; each pair at least once, at most `PART` at a time.

        Args:
            plane: (M,) of the bounds.
            low: (2, M) their least coordinates.
            high: (2, M) their greatest.
        """
        extent = np.maximum(*(high - low))
        for side, keys, owner in self._sizes:
            some = np.flatnonzero(extent < side)
            asked, asking = _cells(plane[some], low[:, some], high[:, some], side)
            start = np.searchsorted(keys, asked, "left")
            count = np.searchsorted(keys, asked, "right") - start
            for row, item in _spread(start, count):
                a, b = some[asking[row]], owner[item]
                # Other planes' cells may have the same key.
                meets = plane.take(a) == self._plane.take(b)
                for x in range(2):
                    meets &= low[x].take(a) <= self.high[x].take(b)
                    meets &= self.low[x].take(b) <= high[x].take(a)
                yield a[meets], b[meets]


def _spread(start: NDArray[np.int64], count: NDArray[np.int64]) -> Iterator[Pairs]:
    """For rows (R,) of so many items each, from `start` on: the row and the item of each."""
    ends = np.cumsum(count)
    first = start - (ends - count)
    for at in range(0, int(ends[-1]) if len(ends) else 0, PART):
        number = np.arange(at, min(at + PART, int(ends[-1])))
        row = np.searchsorted(ends, number, "right")
        yield row, first.take(row) + number


def _least(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, N) the least of the coordinates of triangles (N, 3, 2)."""
    a, b, c = (corners[:, k].T for k in range(3))
    return np.minimum(np.minimum(a, b), c)


def _cells(
    plane: NDArray[np.integer], low: NDArray[np.float64], high: NDArray[np.float64], side: float
) -> tuple[NDArray[np.uint64], NDArray[np.int64]]:
    """(C,) what tells cells apart, but for rare chance, and (C,) which of some bounds lie in them.

    Args:
        plane: (N,) of the bounds.
        low: (2, N) the least of the bounds, which are smaller than a cell.
        high: (2, N) their greatest.
        side: of a cell.
    """
    from_cell, to_cell = (np.floor(corner / side) for corner in (low, high))
    keys, owners = [], []
    for steps in _CORNERS:
        x, y = from_cell[0] + steps[0], from_cell[1] + steps[1]
        some = np.flatnonzero((x <= to_cell[0]) & (y <= to_cell[1]))
        key = np.zeros(len(some), dtype=np.uint64)
        for part, factor in zip((plane[some], x[some], y[some]), _HASH, strict=True):
            key = (key ^ part.astype(np.int64).view(np.uint64)) * np.uint64(factor)
        keys.append(key)
        owners.append(some)
    return np.concatenate(keys), np.concatenate(owners)
