# SPDX-License-Identifier: GPL-3.0-or-later
"""A regular grid of cubes, and which of its cells rays pass (3D-DDA)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .parallel import in_parts

# Rays walked together: few enough that what is kept of them fits into a processor's cache.
RAYS = 8192


@dataclass(frozen=True)
class Grid:
    """Cubic cells over a box.

    Attributes:
        low: (3,) float64, the lowest corner.
        cell: side of a cell.
        shape: cells along each axis.
    """

    low: NDArray[np.float64]
    cell: float
    shape: tuple[int, int, int]

    @classmethod
    def over(cls, box: NDArray[np.float64], cells: int) -> Grid:
        """`cells` along the longest side of `box` (2, 3), centred on it.

        The paper divides the longer of width and height; the longest of all three keeps the
        grid small in a tower too.
        """
        size = box[1] - box[0]
        cell = float(size.max()) / cells
        counts = np.maximum(1, np.ceil(size / cell * (1.0 - 1e-9)).astype(int))  # 128.0000001
        low = 0.5 * (box[0] + box[1] - counts * cell)
        return cls(low, cell, (int(counts[0]), int(counts[1]), int(counts[2])))

    def __len__(self) -> int:
        return self.shape[0] * self.shape[1] * self.shape[2]

    def centres(self, index: NDArray[np.int64]) -> NDArray[np.float64]:
        """Flat cell numbers (N,) to their centres (N, 3)."""
        cell = np.stack(np.unravel_index(index, self.shape), axis=-1)
        return np.asarray(self.low + (cell + 0.5) * self.cell)

    def traverse(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        lengths: NDArray[np.float64],
    ) -> Passages:
        """All cells that rays pass, each once for each ray, by 3D-DDA.

        Rays step together: every step moves each into its next cell, across the face that it
        reaches first (Amanatides and Woo, 1987; Fujimoto et al., 1986). How many faces a ray
        crosses is known from where it ends; with the longest ways first, those still under way
        are the first ones of the arrays, which then need no sorting out.

        Args:
            origins: (R, 3), anywhere.
            directions: (R, 3), unit.
            lengths: (R,), where the rays end; may be inf.
        """
        found: dict[int, Passages] = {}

        def walk(part: slice) -> None:
            found[part.start] = self._walk(
                origins[part], directions[part], lengths[part], part.start
            )

        in_parts(walk, len(origins), RAYS)
        whole = [found[start] for start in sorted(found)]
        if not whole:
            return Passages(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))
        return Passages(
            np.concatenate([part.cell for part in whole]),
            np.concatenate([part.ray for part in whole]),
            np.concatenate([part.distance for part in whole]),
        )

    def _walk(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        lengths: NDArray[np.float64],
        number: int,
    ) -> Passages:
        """`traverse` for some rays, the first of which is called `number`."""
        enter, leave = self._clip(origins, directions, lengths)
        ray = np.flatnonzero(enter < leave)
        shape = np.array(self.shape)
        start = (origins[ray] - self.low) / self.cell
        slope = directions[ray] / self.cell  # cells per unit of length
        cell = np.clip(np.floor(start + enter[ray, None] * slope), 0, shape - 1)
        at_end = start + leave[ray, None] * slope
        # A cell whose face the ray ends on is not entered.
        last = np.where(slope > 0.0, np.ceil(at_end) - 1.0, np.floor(at_end))
        last = np.clip(last, 0, shape - 1)
        crossings = np.maximum((last - cell) * np.sign(slope), 0.0).astype(np.int32)
        steps = crossings.sum(axis=-1)
        order = np.argsort(-steps, kind="stable")
        ray, steps = ray[order], steps[order]
        with np.errstate(divide="ignore", invalid="ignore"):
            face = ((cell + (slope > 0.0) - start) / slope)[order].T
            width = (1.0 / np.abs(slope))[order].T
        crossings = crossings[order].T
        # Distance to the next face on each axis; none is left where the ray ends before it.
        face = np.where(crossings > 0, face, np.inf)
        stride = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.int32)
        jump = (np.sign(slope).astype(np.int32) * stride)[order].T
        flat = (cell.astype(np.int32) @ stride)[order]
        rays = _Walk(face, width, crossings, jump, flat, enter[ray])
        under_way = np.cumsum(np.bincount(steps)[::-1])[::-1]  # rays with at least so many steps
        found = Passages(
            np.empty(under_way.sum(), np.int32),
            np.empty(under_way.sum(), np.int32),
            np.empty(under_way.sum(), np.float32),
        )
        name = (ray + number).astype(np.int32)
        place = 0
        for count in under_way.tolist():
            if place:  # the first cells are where the rays start
                rays.step(count)
            found.cell[place : place + count] = rays.flat[:count]
            found.ray[place : place + count] = name[:count]
            found.distance[place : place + count] = rays.now[:count]
            place += count
        return found

    def _clip(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        lengths: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(R,), (R,) distances where the rays enter and leave the box."""
        high = self.low + np.array(self.shape) * self.cell
        with np.errstate(divide="ignore", invalid="ignore"):
            to_low = (self.low - origins) / directions
            to_high = (high - origins) / directions
        parallel = directions == 0.0
        within = (origins >= self.low) & (origins <= high)
        near = np.where(parallel, np.where(within, -np.inf, np.inf), np.minimum(to_low, to_high))
        far = np.where(parallel, np.where(within, np.inf, -np.inf), np.maximum(to_low, to_high))
        return np.maximum(near.max(axis=-1), 0.0), np.minimum(far.min(axis=-1), lengths)


@dataclass(frozen=True)
class Passages:
    """Which rays pass which cells.

    Attributes:
        cell: (P,) int32, flat cell number.
        ray: (P,) int32.
        distance: (P,) float32, from the ray's origin to where it enters the cell.
    """

    cell: NDArray[np.int32]
    ray: NDArray[np.int32]
    distance: NDArray[np.float32]


@dataclass(frozen=True)
class _Walk:
    """Rays under way through the grid; `step` changes all arrays but `width` and `jump`.

    Attributes:
        face: (3, R) float64, distance along the ray to the next face on each axis; inf for none.
        width: (3, R) float64, distance from one face to the next.
        crossings: (3, R) int32, faces still to be crossed.
        jump: (3, R) int32, what crossing a face adds to the cell's flat number.
        flat: (R,) int32, the cell's flat number.
        now: (R,) float64, how far the ray has come.
    """

    face: NDArray[np.float64]
    width: NDArray[np.float64]
    crossings: NDArray[np.int32]
    jump: NDArray[np.int32]
    flat: NDArray[np.int32]
    now: NDArray[np.float64]

    def step(self, count: int) -> None:
        """Move the first `count` rays across the face that each reaches first."""
        x, y, z = self.face[:, :count]
        across_x = (x <= y) & (x <= z)
        across_y = ~across_x & (y <= z)
        self.now[:count] = np.minimum(np.minimum(x, y), z)
        for axis, across in enumerate((across_x, across_y, ~(across_x | across_y))):
            some = np.flatnonzero(across)
            self.flat[some] += self.jump[axis, some]
            left = self.crossings[axis, some] - 1
            self.crossings[axis, some] = left
            further = self.face[axis, some] + self.width[axis, some]
            self.face[axis, some] = np.where(left > 0, further, np.inf)
