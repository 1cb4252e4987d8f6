# SPDX-License-Identifier: GPL-3.0-or-later
"""Views from a little elsewhere."""

from __future__ import annotations

import numpy as np

from addon.camplace.moves import MOVED, moved_view
from addon.camplace.rays import RayCaster
from addon.camplace.view_samples import sample_view
from tests.synthetic import box, geometry_of, looking_at, perspective_view

ROOM = geometry_of([box((0, 0, 0), 4.0)])


def test_moves_fill_a_ball_of_a_tenth_of_the_viewing_distance() -> None:
    rays = RayCaster(ROOM)
    rng = np.random.default_rng(0)
    view = perspective_view(looking_at((0, 0, 0), (1, 0.2, 0.1)), 100, 100, 1.0)
    seen = sample_view(view, ROOM, rays, 100, rng)
    reach = MOVED * np.median(np.linalg.norm(seen.point, axis=-1))
    moved = [moved_view(view, seen, rays, rng) for _ in range(400)]
    offset = np.array([copy.origin for copy in moved]) / reach
    radius = np.linalg.norm(offset, axis=-1)
    assert radius.max() <= 1.0
    # Even over a ball: the cubed radius is even over [0, 1] and no direction is preferred. Five
    # standard errors of the means of 400.
    assert abs((radius**3).mean() - 0.5) < 5 * np.sqrt(1 / 12 / 400)
    assert (np.abs(offset.mean(axis=0)) < 5 * np.sqrt(0.2 / 400)).all()
    for copy in moved:
        np.testing.assert_array_equal(
            copy.world_from_camera[:3, :3], view.world_from_camera[:3, :3]
        )
        assert copy.clip_from_camera is view.clip_from_camera


def test_a_moved_view_stays_in_its_room() -> None:
    rays = RayCaster(ROOM)
    rng = np.random.default_rng(0)
    near_wall = perspective_view(looking_at((1.99, 0, 0), (0, 0.1, 0)), 100, 100, 1.0)
    seen = sample_view(near_wall, ROOM, rays, 100, rng)
    for _ in range(30):
        moved = moved_view(near_wall, seen, rays, rng)
        assert (np.abs(moved.origin) < 2.0).all()
        assert np.linalg.norm(moved.origin - near_wall.origin) > 0.0
