# SPDX-License-Identifier: GPL-3.0-or-later
"""What clusters leave out is not in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from addon.corrmap.clusters import CLUSTER, Clusters, order_of_objects, overlaps
from addon.corrmap.visible_surface import clip_from_local
from addon.scene.view import View
from tests import synthetic

RNG = np.random.default_rng(12)
WIDTH, HEIGHT = 64, 48


def crumbs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Small triangles along a curve through a box of 8 m, each near the one before."""
    steps = RNG.normal(size=(count, 3)).cumsum(axis=0)
    place = 4.0 * np.sin(RNG.uniform(0.0, 6.3, 3) + steps * 0.01)
    corners = place[:, None] + RNG.uniform(-0.03, 0.03, size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def views() -> list[View]:
    pose = synthetic.looking_at((0.3, -1.0, 0.2), (1.0, 3.0, 0.5))
    view = synthetic.perspective_view(pose, WIDTH, HEIGHT, 0.8)
    flat = np.diag([0.5, 0.7, -0.02, 1.0])
    flat[2, 3] = -1.0
    return [view, View(pose, flat, WIDTH, HEIGHT, perspective=False)]


@pytest.mark.parametrize("number", [0, 1])
def test_pictures_are_the_same_without_what_is_beside_them(
    gpu_context: None, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    view = views()[number]
    geometry = synthetic.geometry_of([crumbs(CLUSTER // 3) for _ in range(60)])
    buffer = GeometryBuffer(geometry, view.origin)
    clusters = [group.clusters for group in buffer._groups]
    matrix = clip_from_local(view, view.origin)
    seen = np.concatenate([some.seen(matrix) for some in clusters])
    # Otherwise this would test nothing.
    assert 0.05 < seen.mean() < 0.8
    drawn = VisibleSurfacePass(buffer).draw(view, with_objects=True)
    monkeypatch.setattr(Clusters, "seen", lambda self, _: np.ones(len(self.low), dtype=bool))
    whole = VisibleSurfacePass(buffer).draw(view, with_objects=True)
    for name in ("position", "normal", "triangles", "objects"):
        found, expected = (read_texture(getattr(some, name)) for some in (drawn, whole))
        assert expected.any()
        np.testing.assert_array_equal(found, expected)


def test_a_cluster_is_seen_if_a_point_of_it_is() -> None:
    """Never the other way round, in a thousand views of one box."""
    corners = RNG.uniform(-1.0, 1.0, size=(CLUSTER, 3, 3)).astype(np.float32)
    clusters = Clusters.of(corners)
    some_seen = 0
    for _ in range(1000):
        eye = RNG.uniform(-6.0, 6.0, 3)
        pose = synthetic.looking_at(eye, RNG.uniform(-6.0, 6.0, 3))
        matrix = clip_from_local(synthetic.perspective_view(pose, 8, 8, 0.7), np.zeros(3))
        clip = np.append(corners.reshape(-1, 3), np.ones((3 * CLUSTER, 1)), axis=1) @ matrix.T
        inside = (np.abs(clip[:, :2]) <= clip[:, 3:]).all(axis=1).any()
        some_seen += int(inside)
        assert bool(clusters.seen(matrix)[0]) or not inside
    assert 100 < some_seen < 900


def test_ranges() -> None:
    corners = np.zeros((3 * CLUSTER + 5, 3, 3), dtype=np.float32)
    clusters = Clusters.of(corners)
    seen = np.array([True, False, True, True])
    ranges = [(0, CLUSTER), (2 * CLUSTER, 3 * CLUSTER + 5)]
    assert clusters.ranges(seen) == ranges
    shown = [(10, 20), (CLUSTER - 1, 2 * CLUSTER + 1), (3 * CLUSTER, 3 * CLUSTER + 5)]
    assert overlaps(ranges, shown) == [
        (10, 20),
        (CLUSTER - 1, CLUSTER),
        (2 * CLUSTER, 2 * CLUSTER + 1),
        (3 * CLUSTER, 3 * CLUSTER + 5),
    ]


def test_objects_that_lie_together_come_together() -> None:
    """The way through a grid of boxes is less than half as long as in a random order."""
    cells = np.stack(np.meshgrid(*[np.arange(10.0)] * 3), axis=-1).reshape(-1, 3)
    cells = RNG.permutation(cells)
    geometry = synthetic.geometry_of([synthetic.box(cell, 0.5) for cell in cells])
    rank = order_of_objects(geometry.vertices, geometry.triangles, geometry.object_id)
    assert sorted(rank) == list(range(1000))
    way = np.linalg.norm(np.diff(cells[np.argsort(rank)], axis=0), axis=1).sum()
    random = np.linalg.norm(np.diff(cells, axis=0), axis=1).sum()
    assert way < 0.4 * random
