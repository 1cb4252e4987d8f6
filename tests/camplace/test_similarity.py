# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties that hold for any scene: similar scenes have similar cameras, more see more."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from addon.camplace.place import place_cameras
from addon.camplace.placement import Placement
from addon.camplace.settings import PlacementSettings
from addon.scene.view import View
from tests.synthetic import looking_at, perspective_view, room_with_box

SMALL = PlacementSettings(
    view_samples=600, area_samples=400, grid_cells=24, candidates=6, sphere_searches=10,
    secondaries=4,
)  # fmt: skip


def _view(scale: float, offset: np.ndarray) -> View:
    place = np.array([1.6, -1.7, 0.9]) * scale + offset
    target = np.array([-0.4, 0.9, -0.6]) * scale + offset
    return perspective_view(
        looking_at(place, target), 320, 240, 1.2, near=0.01 * scale, far=100.0 * scale
    )


@cache
def _here() -> Placement:
    return place_cameras(room_with_box(), (_view(1.0, np.zeros(3)),), SMALL)


@settings(max_examples=8, deadline=None)
@given(
    exponent=st.floats(min_value=-3.0, max_value=5.0),
    direction=st.tuples(*[st.floats(min_value=-1.0, max_value=1.0)] * 3),
)
@example(exponent=-3.0, direction=(0.0, 0.0, 0.0))
@example(exponent=5.0, direction=(0.0, 0.0, 0.0))
@example(exponent=0.0, direction=(1.0, -1.0, 1.0))
def test_a_similar_scene_has_similar_cameras(
    exponent: float, direction: tuple[float, float, float]
) -> None:
    """Any scale from 1e-3 to 1e5, moved by up to 1e6 m, as far as float64 holds the scene.

    Scaling by what is no power of two rounds each vertex; embree then decides a few rays that
    graze edges otherwise. That moves mean directions a little, never a camera to another cell.
    """
    scale = 10.0**exponent
    # Of a scene of 4 mm that is 1000 km away, float64 itself keeps 1e-10 m: 3e-8 of its size.
    offset = np.array(direction) * 1e6
    there = place_cameras(room_with_box(scale, offset), (_view(scale, offset),), SMALL)
    here = _here()
    assert [c.resolution for c in there.cameras] == [c.resolution for c in here.cameras]
    assert [c.kind for c in there.cameras] == [c.kind for c in here.cameras]
    for a, b in zip(there.cameras, here.cameras, strict=True):
        np.testing.assert_allclose((a.origin - offset) / scale, b.origin, atol=4e-3)
        np.testing.assert_allclose(
            a.world_from_camera[:3, :3], b.world_from_camera[:3, :3], atol=0.02
        )
        np.testing.assert_allclose(a.fov, b.fov, atol=0.02)
        np.testing.assert_allclose([a.near / scale, a.far / scale], [b.near, b.far], rtol=0.01)
    np.testing.assert_allclose(there.seen, here.seen, atol=0.005)


@settings(max_examples=5, deadline=None)
@given(
    seed=st.integers(min_value=0, max_value=1000),
    fewer=st.integers(min_value=1, max_value=4),
    more=st.integers(min_value=1, max_value=4),
)
def test_more_cameras_cover_more(seed: int, fewer: int, more: int) -> None:
    placements = [
        place_cameras(
            room_with_box(),
            (_view(1.0, np.zeros(3)),),
            replace(SMALL, seed=seed, cameras=count, least_gain=1e-6),
        )
        for count in (fewer, fewer + more)
    ]
    for placement in placements:
        assert (np.diff(placement.seen) >= 0.0).all()
        assert (np.diff(placement.well_seen) >= 0.0).all()
    small, large = placements
    assert len(small.cameras) <= fewer
    # Both begin with the same cameras, unless only the larger one can afford a cube; greedy
    # choices may then differ by a little either way.
    assert large.seen[-1] >= small.seen[-1] - 0.01
