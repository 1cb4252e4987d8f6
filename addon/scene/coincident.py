# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that lie in one another, from which no light is cast back.

A shadow ray of Cycles starts on its triangle without any offset, and leaves only that triangle
itself out. Another one in the very same plane it meets at distance 0. Where both planes are of one
coordinate (x, y or z the same float32 for all corners) roundings cannot part them, and what lies
in both is black on either side. In slanted planes roundings decide for each ray: there Cycles is
dark in parts, by chance, which nothing here says anything of.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# Planes that only the rounding of places far from the world's origin makes one, differ by more than
# this share of their triangles' sizes.
_SAME_PLANE = 1e-6

# Triangles overlap if by more than this share of the larger one's size: neighbours along an edge
# do so by roundings of float32.
_LEAST_OVERLAP = 1e-6

# Pairs looked at together.
_PART = 1 << 18

# The sides of cells that triangles are sorted into are powers of two; each triangle lies in at
# most 2 x 2 cells of those that are no smaller than it.
_CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))

# Odd numbers whose bits are well mixed.
_HASH = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)


@dataclass(frozen=True)
class Coincident:
    """Pairs of triangles with a common part.

    Attributes:
        first: (P,) int64, ascending: the one triangle of each pair; each pair is there twice.
        second: (P,) int64: the other.
        axis: (P,) int8: the coordinate that is the same all over both.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    axis: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.first)

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """(N,) those that are in a pair, ascending."""
        return np.unique(self.first)


def coincident_triangles(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> Coincident:
    """All pairs of triangles (T, 3) of (V, 3) vertices, with Cycles' float32 coordinates."""
    found: list[NDArray[np.int64]] = []
    rounded = vertices.astype(np.float32)
    for axis in range(3):
        levels = rounded[:, axis].take(triangles)
        flat = np.flatnonzero((levels[:, 0] == levels[:, 1]) & (levels[:, 0] == levels[:, 2]))
        if not len(flat):
            continue
        _, plane = np.unique(levels[flat, 0], return_inverse=True)
        corners = np.roll(vertices, -1 - axis, axis=1)[triangles[flat]]
        corners, level = corners[..., :2], corners[..., 2]
        most = _SAME_PLANE * np.ptp(corners, axis=1).max(axis=1)
        for a, b in _near_pairs(plane, corners):
            off = np.abs(level[a, :, None] - level[b, None]).max(axis=(1, 2))
            same = off <= np.minimum(most[a], most[b])
            some = np.flatnonzero(same)[_overlap(corners[a[same]], corners[b[same]])]
            one, other = flat[a[some]], flat[b[some]]
            where = np.full(len(one), axis)
            found += [np.stack([one, other, where]), np.stack([other, one, where])]
    every = np.concatenate(found, axis=1) if found else np.empty((3, 0), dtype=np.int64)
    # Two triangles may have several cells in common.
    first, second, axes = np.unique(every, axis=1)
    return Coincident(first, second, axes.astype(np.int8))


def _near_pairs(
    plane: NDArray[np.int64], corners: NDArray[np.float64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Pairs of triangles (N, 3, 2) of the same plane (N,) whose bounds overlap, each pair once,
    some at a time."""
    # Components come first: numpy works on long rows several times faster than on pairs.
    low, high = _least(corners), -_least(-corners)
    _, exponent = np.frexp(np.maximum(*(high - low)))
    for size in np.unique(exponent):
        # Those of this size, with one another and with smaller ones.
        cell = np.ldexp(1.0, size)
        large, small = np.flatnonzero(exponent == size), np.flatnonzero(exponent <= size)
        keys, owner = _cells(plane[large], low[:, large], high[:, large], cell)
        order = np.argsort(keys, kind="stable")
        keys, owner = keys[order], large[owner[order]]
        asked, asking = _cells(plane[small], low[:, small], high[:, small], cell)
        start = np.searchsorted(keys, asked, "left")
        count = np.searchsorted(keys, asked, "right") - start
        ends = np.cumsum(count)
        cuts = np.searchsorted(ends, np.arange(0, ends[-1] + _PART, _PART))
        for i, j in zip(cuts[:-1], cuts[1:] + 1, strict=True):
            many = count[i:j]
            a = np.repeat(small[asking[i:j]], many)
            within = np.arange(len(a)) - np.repeat(np.cumsum(many) - many, many)
            b = owner[np.repeat(start[i:j], many) + within]
            fits = (exponent[a] < size) | (a < b)
            for x in range(2):
                fits &= (low[x].take(a) < high[x].take(b)) & (low[x].take(b) < high[x].take(a))
            yield a[fits], b[fits]


def _least(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, N) the least of the coordinates of triangles (N, 3, 2)."""
    a, b, c = (corners[:, k].T for k in range(3))
    return np.minimum(np.minimum(a, b), c)


def _cells(
    plane: NDArray[np.int64], low: NDArray[np.float64], high: NDArray[np.float64], side: float
) -> tuple[NDArray[np.uint64], NDArray[np.int64]]:
    """(C,) what tells cells apart, but for rare chance, and (C,) which of some bounds lie in them.

    Args:
        plane: (N,) of the bounds.
        low: (2, N) the least of the bounds, which are no larger than a cell.
        high: (2, N) their greatest.
        side: of a cell.
    """
    from_cell, to_cell = (np.floor(corner / side) for corner in (low, high))
    keys, owners = [], []
    for steps in _CORNERS:
        x, y = from_cell[0] + steps[0], from_cell[1] + steps[1]
        some = np.flatnonzero((x <= to_cell[0]) & (y <= to_cell[1]))
        parts = (plane[some], x[some], y[some])
        key = np.zeros(len(some), dtype=np.uint64)
        for part, factor in zip(parts, _HASH, strict=True):
            key = (key ^ part.astype(np.int64).view(np.uint64)) * np.uint64(factor)
        keys.append(key)
        owners.append(some)
    return np.concatenate(keys), np.concatenate(owners)


def _overlap(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(P,) whether triangles (P, 3, 2) have a common part: no line along a side of either parts
    them."""
    overlap = np.ones(len(a), dtype=np.bool_)
    size = np.maximum.reduce([np.abs(x[:, k] - x[:, k - 1]) for x in (a, b) for k in range(3)])
    size = size.max(axis=1)
    corners = [[np.ascontiguousarray(x[:, k].T) for k in range(3)] for x in (a, b)]
    for one, other in (corners, corners[::-1]):
        for k in range(3):
            corner, side = one[k], one[(k + 1) % 3] - one[k]
            inward = np.where(_cross(side, one[(k + 2) % 3] - corner) < 0.0, -1.0, 1.0)
            theirs = [inward * _cross(side, point - corner) for point in other]
            within = np.maximum(np.maximum(theirs[0], theirs[1]), theirs[2])
            overlap &= within > _LEAST_OVERLAP * size * np.hypot(*side)
    return overlap


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P,) of (2, P) vectors: positive where the second is to the left of the first."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])
