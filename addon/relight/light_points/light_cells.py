# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells that part a light's square or disk among its samples, and a point in each.

Every sample of a light is lit from one point, and its lobes see one cell; together the cells are
the whole light, without gaps or overlaps, so that highlights are exact whatever their number.

The square is cut into rows of cells of the same area. The points are those of Chiu, Shirley and
Wang's multi-jittered sampling (Graphics Gems IV, 1994): one in each cell, and of n x n cells no two
at the same place along either side, so that shadows' edges that run along a side are parted n x n
times too. Neighbours lie apart by steps of the golden ratio: over edges of all directions the
error of 16 points is 0.7, of 64 points 0.57 of that of the plain quasirandom sequence. The pattern
mirrors itself in the centre where all rows have as many cells: what grows evenly over the light is
then exact.
Disks are squares under Shirley and Chiu's concentric map (1997), which keeps areas.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

# Corners of a cell: its own four, and the middles of its sides, because a side that is straight
# on the light is not quite so among the slopes of half vectors, or on a disk.
CORNERS = 8

# Around the unit square, counterclockwise.
_AROUND = 0.5 * np.array([(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)])

_GOLDEN_SHARE = 0.5 * (math.sqrt(5.0) - 1.0)

# Spots of a cell: as many as a 4 x 4 block of pixels has.
SPOTS = 16


@dataclass(frozen=True)
class Cell:
    """One sample's share of a light.

    Attributes:
        point: (2,) where it is lit from; on the square [-1, 1]^2, or in the unit disk.
        corners: (CORNERS, 2) around the cell, on the same.
        spots: (SPOTS, 2) in the cell: one in each of 4 x 4 parts, and of any four that begin at
            a multiple of four one in each quarter.
    """

    point: NDArray[np.float64]
    corners: NDArray[np.float64]
    spots: NDArray[np.float64]


@lru_cache(maxsize=64)
def square_cells(count: int, aspect: float = 1.0) -> tuple[Cell, ...]:
    """`count` cells of the square, in an order that spreads the first ones.

    Args:
        count: how many.
        aspect: width over height that the square will be stretched to; cells are made as wide
            as high, as far as their number allows.
    """
    rows = min(max(round(math.sqrt(count / aspect)), 1), count)
    ends = np.round(np.linspace(0, count, rows + 1)).astype(int)
    cells = []
    for row, (first, last) in enumerate(itertools.pairwise(ends)):
        columns = last - first
        low, size = np.array([0.0, first / count]), np.array([1.0, columns]) / [columns, count]
        for column in range(columns):
            corner = low + size * [column, 0]
            inside = np.array([_rank(rows)[row] / rows, _rank(columns)[column] / columns])
            parts = (inside, _AROUND, unit_spots())
            point, corners, spots = (2.0 * (corner + size * part) - 1.0 for part in parts)
            cells.append(Cell(point, corners, spots))
    return tuple(cells[index] for index in _spread(count))


@lru_cache(maxsize=64)
def disk_cells(count: int, aspect: float = 1.0) -> tuple[Cell, ...]:
    """`count` cells of the unit disk, in the same order.

    Their corners lie a little outside where the disk's outline is cut off between them, so that
    together they have the disk's area.
    """
    square = square_cells(count, aspect)
    corners = np.array([concentric(cell.corners) for cell in square])
    x, y = np.moveaxis(corners, -1, 0)
    areas = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    corners *= math.sqrt(math.pi / float(areas.sum()))
    return tuple(
        Cell(concentric(cell.point), around, concentric(cell.spots))
        for cell, around in zip(square, corners, strict=True)
    )


def concentric(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (..., 2) of [-1, 1]^2 to the unit disk, areas in proportion."""
    x, y = square[..., 0], square[..., 1]
    wide = np.abs(x) >= np.abs(y)
    radius = np.where(wide, x, y)
    safe = np.where(radius == 0.0, 1.0, radius)
    quarter = np.pi / 4.0
    angle = np.where(wide, quarter * y / safe, 2.0 * quarter - quarter * x / safe)
    return radius[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@lru_cache(maxsize=1)
def unit_spots() -> NDArray[np.float64]:
    """(SPOTS, 2) of the unit square: the first points of Sobol's sequence (1967), each in the
    middle of its sixteenth along either side."""
    number = np.arange(SPOTS)
    bits = (number[:, None] >> np.arange(4)) & 1  # (SPOTS, 4)
    x, y = bits @ [8, 4, 2, 1], np.bitwise_xor.reduce(bits * [8, 12, 10, 15], axis=1)
    return (np.stack([x, y], axis=1) + 0.5) / SPOTS


def quarters() -> NDArray[np.int64]:
    """(SPOTS,) in which quarter of a cell each spot is."""
    return np.asarray((unit_spots() >= 0.5) @ [1, 2])


@lru_cache(maxsize=64)
def _rank(count: int) -> NDArray[np.float64]:
    """(count,) each of 0.5, 1.5, ... once, so that neighbours are far apart; the last is the
    first's mirror image."""
    steps = (_GOLDEN_SHARE * (np.arange(count) - 0.5 * (count - 1)) + 0.5) % 1.0
    return np.asarray(np.argsort(np.argsort(steps)) + 0.5)


def _spread(count: int) -> list[int]:
    """0 to count - 1 in steps of the golden ratio's share, as nearly as visits each once."""
    wanted = count * _GOLDEN_SHARE
    steps = [step for step in range(1, count + 1) if math.gcd(step, count) == 1]
    step = min(steps, key=lambda candidate: abs(candidate - wanted))
    return [index * step % count for index in range(count)]
