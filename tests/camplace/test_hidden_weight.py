# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface that no place near the views sees matters less, not as much and not nothing."""

from __future__ import annotations

import numpy as np

from addon.camplace.prepare import prepare
from addon.camplace.settings import PlacementSettings
from tests.synthetic import box, geometry_of, looking_at, perspective_view


def test_the_room_next_door_weighs_less_than_half_as_much() -> None:
    rooms = geometry_of([box((0, 0, 0), 4.0), box((5.0, 0, 0), 4.0)])
    view = perspective_view(looking_at((0, 0, 0), (1, 0.1, 0)), 320, 240, 1.2)
    settings = PlacementSettings(view_samples=400, area_samples=600)
    bounds = rooms.bounds + np.array([[-0.1], [0.1]])
    stage = prepare(rooms, (view,), bounds, settings, np.random.default_rng(0))
    before = stage.samples
    after = stage.settled_by(np.array([[0.0, 0, 0], [5.0, 0, 0]])).samples
    next_door = ~before.from_view & (before.point[:, 0] > 2.5)
    here = ~before.from_view & (before.point[:, 0] < 2.5)
    # Points by area weigh the same each until it is known what is seen from near the view.
    assert np.ptp(before.weight[next_door | here]) < 1e-12
    least, most = after.weight[here].min(), after.weight[next_door].max()
    assert 0.0 < 2.0 * most < least
    np.testing.assert_allclose(after.weight.sum(), 1.0)
