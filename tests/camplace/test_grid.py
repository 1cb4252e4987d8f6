# SPDX-License-Identifier: GPL-3.0-or-later
"""3D-DDA against a test of every cell with every ray."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.camplace.grid import RAYS, Grid


def _overlap(
    grid: Grid, origin: NDArray[np.float64], direction: NDArray[np.float64], length: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """For every cell: where the ray enters, and how long it stays (negative: it misses)."""
    low = grid.centres(np.arange(len(grid))) - 0.5 * grid.cell
    to_low, to_high = (low - origin) / direction, (low + grid.cell - origin) / direction
    enter = np.maximum(np.minimum(to_low, to_high).max(axis=-1), 0.0)
    leave = np.minimum(np.maximum(to_low, to_high).min(axis=-1), length)
    return enter, leave - enter


def test_every_cell_on_the_way_and_no_other() -> None:
    rng = np.random.default_rng(3)
    grid = Grid.over(np.array([[-1.0, 2.0, 0.5], [2.0, 4.0, 1.7]]), 9)
    origins = rng.uniform([-2.0, 1.0, -0.5], [3.0, 5.0, 2.7], (60, 3))
    directions = rng.normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    lengths = rng.uniform(0.1, 4.0, 60)
    passages = grid.traverse(origins, directions, lengths)
    # Rays that touch a cell for less than this may be told apart only by rounding.
    tolerance = 1e-9 * grid.cell
    for ray in range(60):
        enter, stay = _overlap(grid, origins[ray], directions[ray], lengths[ray])
        mine = passages.ray == ray
        cells = passages.cell[mine]
        assert len(np.unique(cells)) == len(cells)
        assert set(np.flatnonzero(stay > tolerance)) <= set(cells.tolist())
        assert (stay[cells] >= -tolerance).all()
        # Distances are kept in float32.
        np.testing.assert_allclose(passages.distance[mine], enter[cells], rtol=1e-6, atol=1e-6)


def test_rays_along_an_axis_and_past_the_grid() -> None:
    grid = Grid.over(np.array([[0.0, 0.0, 0.0], [4.0, 4.0, 4.0]]), 4)
    origins = np.array([[-1.0, 1.5, 2.5], [3.5, 0.5, 9.0], [-1.0, 4.5, 2.5], [1.5, 1.5, 1.5]])
    directions = np.array([[1.0, 0, 0], [0, 0, -1.0], [1.0, 0, 0], [0, 1.0, 0]])
    passages = grid.traverse(origins, directions, np.array([np.inf, 7.0, np.inf, 1.0]))
    found = [sorted(passages.cell[passages.ray == ray].tolist()) for ray in range(4)]
    assert found[0] == [16 * x + 4 * 1 + 2 for x in range(4)]
    assert found[1] == [16 * 3 + 4 * 0 + z for z in (2, 3)]  # ends at z = 2
    assert found[2] == []
    assert found[3] == [16 + 4 * y + 1 for y in (1, 2)]


def test_cells_are_cubes_over_the_whole_box() -> None:
    box = np.array([[0.0, 0.0, 0.0], [10.0, 4.9, 0.3]])
    grid = Grid.over(box, 20)
    assert grid.shape == (20, 10, 1)
    assert grid.cell == 0.5
    assert (grid.low <= box[0]).all()
    assert (grid.low + np.array(grid.shape) * grid.cell >= box[1]).all()


def test_many_rays_are_walked_as_each_alone() -> None:
    rng = np.random.default_rng(4)
    grid = Grid.over(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.5]]), 6)
    count = 2 * RAYS + 5  # three parts
    origins = rng.uniform(-0.2, 1.2, (count, 3))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    lengths = np.where(rng.random(count) < 0.5, np.inf, rng.random(count))
    passages = grid.traverse(origins, directions, lengths)
    for ray in (0, count // 3 - 1, count // 3, 2 * count // 3, count - 1):  # about the cuts
        alone = grid.traverse(origins[[ray]], directions[[ray]], lengths[[ray]])
        mine = passages.ray == ray
        assert passages.cell[mine].tolist() == alone.cell.tolist()
        assert passages.distance[mine].tolist() == alone.distance.tolist()
