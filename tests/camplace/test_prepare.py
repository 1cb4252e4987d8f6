# SPDX-License-Identifier: GPL-3.0-or-later
"""What the choice of cameras is based on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.moves import MOVED
from addon.camplace.places import LEAST_CLEAR, fixed_places, near_spheres
from addon.camplace.prepare import HIDDEN, MOVES, prepare
from addon.camplace.settings import PlacementSettings
from addon.camplace.spheres import Spheres
from addon.scene.view import View
from tests.synthetic import box, geometry_of, looking_at, perspective_view, room_with_box

SMALL = PlacementSettings(view_samples=800, area_samples=600)
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)
NOWHERE = Spheres(np.zeros((0, 3)), np.zeros(0))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_the_views_share_of_the_weight_is_kept(share: float) -> None:
    rng = np.random.default_rng(0)
    stage = prepare(room_with_box(), (VIEW,), None, replace(SMALL, view_share=share), rng)
    stage = stage.settled_by(np.array([[0.0, -1.0, 1.0]]))
    weight = stage.samples.weight
    assert np.isfinite(weight).all()
    assert weight.sum() == pytest.approx(1.0)
    assert weight[stage.samples.from_view].sum() == pytest.approx(share)


def test_moved_views_look_behind_what_hides() -> None:
    """A post hides a stripe of the wall from the view, and less of it from the moved views."""
    post, triangles = box((0.5, 0.5, 0.5), 1.0)
    parts = [box((0, 0, 0), 8.0), ((post - 0.5) * (0.1, 0.1, 7.9) + (0.0, 0.0, 0.0), triangles)]
    geometry = geometry_of(parts)
    view = perspective_view(looking_at((-1.0, 0, 0), (1, 0, 0)), 320, 240, 1.2)
    stage = prepare(geometry, (view,), None, SMALL, np.random.default_rng(0))
    assert len(stage.moved[0]) == MOVES
    point = stage.samples.point[stage.samples.from_view]
    on_wall = point[:, 0] > 3.999
    # Seen from x = -1 the post's near side at x = -0.05 hides this much of the wall at x = 4.
    hidden = np.abs(point[:, 1]) < 0.05 / 0.95 * 5.0
    assert (on_wall & hidden).any()
    assert (on_wall & ~hidden).sum() > 5 * (on_wall & hidden).sum()


def test_places_near_a_view_keep_clear_and_near() -> None:
    stage = prepare(room_with_box(), (VIEW,), None, SMALL, np.random.default_rng(0))
    near = near_spheres(stage)
    assert 0 < len(near) <= MOVES
    far = np.linalg.norm(stage.samples.point - VIEW.origin, axis=-1)
    assert (np.linalg.norm(near.centre - VIEW.origin, axis=-1) <= MOVED * far.max()).all()
    clear = 2.0 - np.abs(VIEW.origin).max()
    np.testing.assert_allclose(near.radius, 2.0 - np.abs(near.centre).max(axis=-1), rtol=1e-6)
    assert (near.radius >= LEAST_CLEAR * clear).all()
    touching = replace(stage, moved=((_at(stage.moved[0][0], (1.99, -1.7, 0.9)),),))
    assert len(near_spheres(touching)) == 0
    outside = replace(stage, moved=((_at(stage.moved[0][0], (1.5, -9.0, 0.9)),),))
    assert len(near_spheres(outside)) == 0


def test_the_views_own_places_are_tried_on_request_only() -> None:
    stage = prepare(room_with_box(), (VIEW,), None, SMALL, np.random.default_rng(0))
    near = near_spheres(stage)
    usual = fixed_places(stage, NOWHERE, near, SMALL)
    np.testing.assert_array_equal(usual, near.centre)
    asked = fixed_places(stage, NOWHERE, near, replace(SMALL, offer_views=True))
    np.testing.assert_array_equal(asked, [*near.centre, VIEW.origin])


def test_what_no_place_near_the_views_sees_counts_less() -> None:
    two_rooms = geometry_of([box((0, 0, 0), 4.0), box((5.0, 0, 0), 4.0)])
    bounds = two_rooms.bounds + np.array([[-0.1], [0.1]])
    view = perspective_view(looking_at((0, 0, 0), (1, 0.1, 0)), 320, 240, 1.2)
    stage = prepare(two_rooms, (view,), bounds, SMALL, np.random.default_rng(0))
    stage = stage.settled_by(np.array([[0.0, 0, 0], [5.0, 0, 0]]))
    spread = ~stage.samples.from_view
    weight, x = stage.samples.weight[spread], stage.samples.point[spread, 0]
    here, there = weight[x < 2.5], weight[x > 2.5]
    assert len(here) == pytest.approx(len(there), abs=3)
    assert there.mean() / here.mean() == pytest.approx(HIDDEN)


def _at(view: View, place: tuple[float, float, float]) -> View:
    world_from_camera = view.world_from_camera.copy()
    world_from_camera[:3, 3] = place
    return replace(view, world_from_camera=world_from_camera)
