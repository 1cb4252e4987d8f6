# SPDX-License-Identifier: GPL-3.0-or-later
"""Sections and sharp edges have closed forms on simple bodies."""

from __future__ import annotations

import numpy as np
import pytest

from addon.scene.geometry import SceneGeometry
from tools import scene_lines
from tools.scene_lines import creases, section

EVERYWHERE = np.array([[-10.0] * 3, [10.0] * 3])


def geometry(vertices: np.ndarray, triangles: np.ndarray) -> SceneGeometry:
    count = len(triangles)
    ids, shown = np.zeros(count, dtype=np.int32), np.ones(count, dtype=np.bool_)
    return SceneGeometry(vertices.astype(np.float64), triangles.astype(np.int32), ids, ids,
                         np.ones(count, dtype=np.float32), shown, shown, ("a",), ("",))  # fmt: skip


def cube() -> SceneGeometry:
    """From 0 to 1, two triangles a side."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(q[0], q[i], q[i + 1]) for q in quads for i in (1, 2)]
    return geometry(corners, np.array(triangles))


def length(lines: np.ndarray) -> float:
    return float(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_cubes_section_is_a_square(axis: int) -> None:
    lines = section(cube(), axis, 0.3)
    assert length(lines) == pytest.approx(4.0)
    np.testing.assert_allclose(lines[..., axis], 0.3)
    assert not len(section(cube(), axis, 1.5))


def test_a_cubes_sharp_edges_are_its_twelve() -> None:
    lines = creases(cube(), EVERYWHERE)
    assert len(lines) == 12
    assert length(lines) == pytest.approx(12.0)


def test_a_sheet_has_a_border_and_nothing_inside() -> None:
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    corner = np.array([5 * i + j for i in range(4) for j in range(4)])
    halves = [np.stack([corner, corner + 5, corner + 6], 1),
              np.stack([corner, corner + 6, corner + 1], 1)]  # fmt: skip
    lines = creases(geometry(points, np.concatenate(halves)), EVERYWHERE)
    assert length(lines) == pytest.approx(16.0)


def test_what_is_outside_or_too_much_is_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not len(creases(cube(), EVERYWHERE + 100.0))
    monkeypatch.setattr(scene_lines, "MAX_TRIANGLES", 11)
    assert not len(creases(cube(), EVERYWHERE))
