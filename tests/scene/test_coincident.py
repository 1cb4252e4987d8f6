# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that lie in one another, against linear programs that look for a common point."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from addon.scene.coincident import Coincident, coincident_triangles

Array = NDArray[np.float64]


def pairs_of(corners: Array) -> Coincident:
    """Of triangles (T, 3, 3) that share no vertices."""
    return coincident_triangles(
        corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    )


def common_radius(a: Array, b: Array) -> float:
    """The radius of the largest circle in both of two triangles (3, 2); negative for none."""
    rows, limits = [], []
    for triangle in (a, b):
        for k in range(3):
            side = triangle[(k + 1) % 3] - triangle[k]
            out = np.array([side[1], -side[0]]) / np.hypot(*side)
            if out @ (triangle[(k + 2) % 3] - triangle[k]) > 0.0:
                out = -out
            rows.append([*out, 1.0])
            limits.append(out @ triangle[k])
    found = linprog([0, 0, -1], A_ub=rows, b_ub=limits, bounds=[(None, None)] * 3)
    assert found.x is not None
    return float(found.x[2])


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_pairs_are_those_with_a_common_part(axis: int) -> None:
    rng = np.random.default_rng(axis)
    count = 60
    size = 10.0 ** rng.uniform(-2.0, 0.5, (count, 1, 1))
    flat = rng.uniform(-1.0, 1.0, (count, 1, 2)) + size * rng.uniform(-1.0, 1.0, (count, 3, 2))
    level = rng.choice([0.1, -3.7], count)
    corners = np.insert(flat, axis, level[:, None], axis=2)
    found = pairs_of(corners)
    want = {
        (a, b)
        for a in range(count)
        for b in range(count)
        if a != b and level[a] == level[b] and common_radius(flat[a], flat[b]) > 1e-5
    }
    assert len(want) > 100
    assert set(zip(found.first.tolist(), found.second.tolist(), strict=True)) == want
    assert (found.axis == axis).all()
    assert (np.diff(found.first) >= 0).all()
    assert len(found) == len(want)


def grid(count: int, slope: float = 0.0) -> tuple[Array, NDArray[np.int32]]:
    """A square of count x count quads, split into triangles."""
    xs = np.linspace(-1.0, 1.0, count + 1)
    x, y = np.meshgrid(xs, xs)
    vertices = np.stack([x, y, 0.3 + slope * x], axis=-1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    quads = corner[:, None] + [0, 1, count + 2, count + 1]
    return vertices, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_neighbours_do_not_lie_in_one_another(scale: float, offset: float) -> None:
    vertices, triangles = grid(100)
    assert not len(coincident_triangles(vertices * scale + offset, triangles))


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_surfaces_that_are_near_do_not_lie_in_one_another(offset: float) -> None:
    """A centimetre apart, which a million metres away is less than what float32 tells apart."""
    vertices, triangles = grid(4)
    both = np.concatenate([vertices, vertices + np.array([0.0, 0.0, 0.01])]) + offset
    twice = np.concatenate([triangles, triangles + len(vertices)])
    assert not len(coincident_triangles(both, twice))
    same = np.concatenate([vertices, vertices]) + offset
    assert len(coincident_triangles(same, twice)) >= 2 * len(triangles)


def test_slanted_planes_are_left_to_chance() -> None:
    vertices, triangles = grid(4, slope=0.25)
    both = np.concatenate([vertices, vertices])
    assert not len(coincident_triangles(both, np.concatenate([triangles, triangles + 25])))
