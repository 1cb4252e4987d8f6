# SPDX-License-Identifier: GPL-3.0-or-later
"""The measure of placements, where its answer is known, and the table that it fills."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.aim import cube_cameras
from addon.camplace.rays import RayCaster
from addon.camplace.settings import PlacementSettings
from tests.synthetic import box, geometry_of, looking_at, perspective_view, room_with_box
from tools import placement_measure, placement_table
from tools.placement_measure import FreshSamples, free_among

ROOM = geometry_of([box((0, 0, 0), 4.0)])
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)


@pytest.fixture(autouse=True)
def _few_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, count in (("RAYS", 200), ("AREA_POINTS", 500), ("FREE_POINTS", 64)):
        monkeypatch.setattr(placement_measure, name, count)
    monkeypatch.setattr(placement_table, "DRAWS", 1)


def test_a_cube_in_an_empty_room_sees_all_of_it() -> None:
    fresh = FreshSamples(ROOM, (VIEW,), ROOM.bounds)
    shares = fresh.measure(cube_cameras(np.zeros(3), 2048))
    # Only the insides of the walls are there to be seen: no free point is outside.
    assert shares.view_seen == 1.0
    assert shares.area_seen == 1.0
    assert shares.view_well == 1.0
    coarse = fresh.measure(cube_cameras(np.zeros(3), 16))
    assert coarse.view_seen == 1.0
    # Each face has 16 texels for 90 degrees, the view has 320 pixels for 69.
    assert coarse.view_well == 0.0


def test_half_of_the_faces_see_half_of_an_empty_room() -> None:
    fresh = FreshSamples(ROOM, (), ROOM.bounds)
    shares = fresh.measure(cube_cameras(np.zeros(3), 2048)[:3])
    assert np.isnan(shares.view_seen)
    # 500 points: five standard errors of a share of a half.
    assert shares.area_seen == pytest.approx(0.5, abs=5 * np.sqrt(0.25 / 500))


def test_no_cameras_see_nothing() -> None:
    shares = FreshSamples(ROOM, (VIEW,), ROOM.bounds).measure([])
    assert (shares.view_seen, shares.view_well, shares.area_seen, shares.area_well) == (0, 0, 0, 0)


def test_free_points_are_not_in_solids() -> None:
    rays = RayCaster(room_with_box())
    points = np.array([[0.3, 0.2, -0.6], [-1.5, 1.5, 1.5], [5.0, 0.0, 0.0], [-1.5, -1.5, -1.5]])
    np.testing.assert_allclose(free_among(points, (VIEW,), rays)[1:], points[[1, 3]])
    # Without a view, the two that see each other are more than either of the others.
    np.testing.assert_allclose(free_among(points, (), rays), points[[1, 3]])


@pytest.mark.parametrize("faces_the_view", [True, False])
def test_area_points_want_the_density_of_a_view_that_sees_their_side(
    *, faces_the_view: bool
) -> None:
    """A sheet that a view looks at from above wants that view's pixels on its upper side alone."""
    sheet = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    geometry = geometry_of([(sheet, triangles if faces_the_view else triangles[:, ::-1])])
    pose = looking_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), up=(0, 1, 0))
    view = perspective_view(pose, 400, 400, 1.0)
    small_part = perspective_view(
        looking_at((0.2, 0.2, 0.1), (0.2, 0.2, 0.0), up=(0, 1, 0)), 400, 400, 0.5
    )
    region = np.array([[-1.0, -1, -4], [1, 1, 4]])
    below = perspective_view(looking_at((0, 0, -0.01), (0, 0, -5.0), up=(0, 1, 0)), 9, 9, 1.0)
    fresh = FreshSamples(geometry, (view, small_part, below), region)
    samples = fresh.by_area
    assert samples is not None
    footprint = samples.footprint * fresh.frame.unit
    up = samples.normal[:, 2] > 0.0
    assert up.any()
    assert (~up).any()
    # On the axis a pixel at distance 3 is 2 * 3 * tan(0.5) / 400 wide, and larger off the axis.
    on_axis = 2.0 * 3.0 * np.tan(0.5) / 400
    assert footprint[up].min() == pytest.approx(on_axis, rel=0.02)
    assert footprint[up].max() < 1.6 * on_axis
    # The lower side is seen by no view: it wants what is usual for them, all points the same.
    assert np.ptp(footprint[~up]) < 1e-9


def test_the_table_has_all_ways_and_budgets() -> None:
    small = PlacementSettings(
        view_samples=200, area_samples=200, grid_cells=16, candidates=4, sphere_searches=5
    )
    rows = placement_table.measure_scene(
        room_with_box(), (VIEW,), (2, 3), ablations=False, settings=small
    )
    lines = placement_table.table(rows, "room", (2, 3))
    assert len(lines) == 5
    assert all(line.count("|") == placement_table.heading((2, 3))[0].count("|") for line in lines)
    ours = {row["budget"]: row for row in rows if row["way"] == "Relume"}
    assert all(row["cameras"] <= budget for budget, row in ours.items())
    aimless = {row["budget"]: row for row in rows if row["way"] == "random"}
    assert ours[3]["shares"].view_well > aimless[3]["shares"].view_well
    ablated = placement_table.measure_scene(
        room_with_box(), (VIEW,), (2,), ablations=True, settings=replace(small, seed=1)
    )
    assert len(ablated) == 8
