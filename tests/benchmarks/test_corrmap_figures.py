# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables and bounds of the benchmark of camera moves, and the cameras it spreads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.corrmap_figures import PASSES, describe_moves, growth, move_bounds
from benchmarks.spread_cameras import spread_cameras
from tests import synthetic

ROW: dict[str, Any] = {
    "asked": 1000,
    "cameras": 9,
    "triangles": 1024,
    "hole_fraction": 0.1,
    "move_s": 0.1,
    "passes_s": {"gather": 0.02},
}


def test_a_move_is_held_against_eevee_where_it_rendered() -> None:
    rows = [ROW, {**ROW, "asked": 2000, "eevee_s": 3.5}]
    (bound,) = move_bounds(rows, 2000)
    assert bound.ratio == pytest.approx(35.0)
    assert bound.met
    assert not move_bounds(rows, 1000)


def test_growth_is_of_the_most_cameras() -> None:
    assert growth([{**ROW, "cameras": 300, "move_s": 0.15}, ROW]) == pytest.approx(1.5)


def test_a_row_has_a_cell_for_each_column() -> None:
    head, _, plain, beside = describe_moves([ROW, {**ROW, "eevee_s": 2.0}]).splitlines()
    assert "| 10.0 % | 100 | 0 | 0 | 20 |" in plain
    assert head.count("|") == plain.count("|") == beside.count("|")
    assert "2.00 (20)" in beside
    assert all(name in head for name in PASSES)


def test_spread_cameras_see_what_the_view_sees() -> None:
    geometry = synthetic.room_with_box()
    looking = synthetic.looking_at((-1.5, -1.6, 0.9), (0.3, 0.2, -0.6))
    view = synthetic.perspective_view(looking, 64, 48, 1.2)
    cameras = spread_cameras(geometry, view, 20, 32)
    fewer = spread_cameras(geometry, view, 5, 32)
    for one, other in zip(cameras, fewer, strict=False):
        assert np.array_equal(one.world_from_camera, other.world_from_camera)
    tracer = synthetic.Tracer(geometry)
    places = np.array([camera.origin for camera in cameras])
    forward = -np.array([camera.world_from_camera[:3, 2] for camera in cameras])
    _, target = tracer.hit(places, forward)
    x, y, _, w = view.project(target).T
    assert ((w > 0.0) & (x >= 0.0) & (x <= 64.0) & (y >= 0.0) & (y <= 48.0)).all()
    # Nothing hides it from the view.
    way = target - view.origin
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    _, met = tracer.hit(np.broadcast_to(view.origin, way.shape), way)
    # Hits are on planes that float32 rays choose; the room is 4 m wide.
    assert np.abs(met - target).max() < 1e-3
