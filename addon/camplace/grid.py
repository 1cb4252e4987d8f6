# SPDX-License-Identifier: GPL-3.0-or-later
"""A regular grid of cubes, and which of its cells rays pass (3D-DDA)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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

        All rays step together: every step moves each ray into its next cell, across the face
        that it reaches first (Amanatides and Woo, 1987; Fujimoto et al., 1986).

        Args:
            origins: (R, 3), anywhere.
            directions: (R, 3), unit.
            lengths: (R,), where the rays end; may be inf.
        """
        enter, leave = self._clip(origins, directions, lengths)
        ray = np.flatnonzero(enter < leave)
        shape = np.array(self.shape)
        start = (origins[ray] - self.low) / self.cell
        slope = directions[ray] / self.cell  # cells per unit of length
        at_entry = start + enter[ray, None] * slope
        cell = np.clip(np.floor(at_entry).astype(np.int64), 0, shape - 1)
        step = np.where(slope > 0.0, 1, -1)
        with np.errstate(divide="ignore", invalid="ignore"):
            face = (cell + (slope > 0.0) - start) / slope
            width = 1.0 / np.abs(slope)
        face = np.where(slope == 0.0, np.inf, face)  # distance to the next face on each axis
        now, end = enter[ray], leave[ray]
        stride = np.array([shape[1] * shape[2], shape[2], 1])
        found: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]] = []
        while ray.size:
            found.append((cell @ stride, ray, now))
            axis = np.argmin(face, axis=-1)
            row = np.arange(len(ray))
            now = face[row, axis]
            cell[row, axis] += step[row, axis]
            face[row, axis] += width[row, axis]
            moved = cell[row, axis]
            on = (now < end) & (moved >= 0) & (moved < shape[axis])
            ray, now, end = ray[on], now[on], end[on]
            cell, face, step, width = cell[on], face[on], step[on], width[on]
        if not found:
            return Passages(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))
        return Passages(
            np.concatenate([part[0] for part in found]).astype(np.int32),
            np.concatenate([part[1] for part in found]).astype(np.int32),
            np.concatenate([part[2] for part in found]).astype(np.float32),
        )

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
