# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that overlap in one plane, against linear programs that look for a common point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from addon.scene import plane_cells
from addon.scene.coincident import coincident_triangles
from addon.scene.geometry import SceneGeometry
from tests.synthetic import geometry_of

Array = NDArray[np.float64]


def loose(corners: Array) -> SceneGeometry:
    """Triangles (T, 3, 3) that share no vertices."""
    count = len(corners)
    return geometry_of([(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))])


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


@pytest.mark.parametrize("at_once", [7, 1 << 18])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_those_with_a_common_part_are_found(
    axis: int, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plane_cells, "PART", at_once)
    rng = np.random.default_rng(axis)
    count = 60
    size = 10.0 ** rng.uniform(-2.0, -0.2, (count, 1, 1))
    flat = 0.8 * rng.uniform(-1.0, 1.0, (count, 1, 2)) + size * rng.uniform(-1, 1, (count, 3, 2))
    level = rng.choice([0.1, 0.1, -3.7], count)
    found = coincident_triangles(loose(np.insert(flat, axis, level[:, None], axis=2)))
    overlaps = np.zeros(count, dtype=bool)
    for a in range(count):
        for b in range(a):
            if level[a] == level[b] and common_radius(flat[a], flat[b]) > 1e-5:
                overlaps[[a, b]] = True
    assert 10 < overlaps.sum() < count - 10
    assert np.array_equal(found.triangles, np.flatnonzero(overlaps))
    assert (found.axis == axis).all()
    same = found.plane[:, None] == found.plane
    assert np.array_equal(same, level[overlaps][:, None] == level[overlaps])


def grid(count: int, slope: float = 0.0) -> SceneGeometry:
    """A square of count x count quads, split into triangles."""
    xs = np.linspace(-1.0, 1.0, count + 1)
    x, y = np.meshgrid(xs, xs)
    vertices = np.stack([x, y, 0.3 + slope * x], axis=-1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    quads = corner[:, None] + [0, 1, count + 2, count + 1]
    return geometry_of([(vertices, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))])


def joined(parts: list[SceneGeometry]) -> SceneGeometry:
    return geometry_of([(each.vertices, each.triangles.astype(np.int64)) for each in parts])


def both(a: SceneGeometry, b: SceneGeometry) -> SceneGeometry:
    return joined([a, b])


def moved(geometry: SceneGeometry, offset: float, scale: float = 1.0) -> SceneGeometry:
    return replace(geometry, vertices=geometry.vertices * scale + offset)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_neighbours_do_not_overlap(scale: float, offset: float) -> None:
    assert not len(coincident_triangles(moved(grid(100), offset, scale)))


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_surfaces_that_are_near_do_not_overlap(offset: float) -> None:
    """A centimetre apart, which a million metres away is less than what float32 tells apart."""
    near = replace(grid(4), vertices=grid(4).vertices + np.array([0.0, 0.0, 0.01]))
    assert not len(coincident_triangles(moved(both(grid(4), near), offset)))
    assert len(coincident_triangles(moved(both(grid(4), grid(4)), offset))) == 64


def test_fine_meshes_at_a_rounded_level_overlap_a_coarse_one() -> None:
    """0.1 + 0.2 is 0.3 in float32 only."""
    fine = grid(100)
    fine.vertices[:, 2] = 0.1 + 0.2
    assert fine.vertices[0, 2] != grid(1).vertices[0, 2]
    assert len(coincident_triangles(both(fine, grid(1)))) == 20002


def test_slanted_planes_are_left_to_chance() -> None:
    assert not len(coincident_triangles(both(grid(4, 0.25), grid(4, 0.25))))


def test_meshes_that_several_objects_show_are_left_to_chance() -> None:
    scene = both(grid(2), grid(4))
    assert len(coincident_triangles(scene)) == 40
    shared = replace(scene, shares_mesh=np.array([True, False]))
    assert not len(coincident_triangles(shared))
    three = joined([grid(n) for n in (2, 4, 1)])
    shared = replace(three, shares_mesh=np.array([True, False, False]))
    assert coincident_triangles(shared).triangles.tolist() == list(range(8, 42))


def test_many_small_things_on_a_large_floor() -> None:
    """Each of which overlaps the floor, and none its like."""
    small = grid(100)
    small.vertices[:, :2] *= 1.0 - 1e-3
    scene = both(grid(1), small)
    assert len(coincident_triangles(scene)) == len(scene)
