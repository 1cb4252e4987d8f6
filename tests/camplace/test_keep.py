# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that changed a little keeps its cameras."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.camplace.camera import CachingCamera
from addon.camplace.place import place_cameras
from addon.camplace.placement import Placement
from addon.camplace.settings import PlacementSettings
from addon.scene.geometry import SceneGeometry
from tests.synthetic import box, geometry_of, looking_at, perspective_view

SMALL = PlacementSettings(
    view_samples=1200, area_samples=800, grid_cells=32, candidates=8, sphere_searches=20
)
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)
ROOM = [box((0, 0, 0), 4.0), box((0.3, 0.2, -0.6), 1.0)]
FURNISHED = [*ROOM, box((-1.2, 0.9, -1.6), 0.5)]


def _place(geometry: SceneGeometry, earlier: Placement | None = None, **changes: Any) -> Placement:
    cameras = () if earlier is None else earlier.cameras
    return place_cameras(geometry, (VIEW,), replace(SMALL, **changes), earlier=cameras)


@pytest.fixture(scope="module")
def before() -> Placement:
    return _place(geometry_of(ROOM))


def _pose(camera: CachingCamera) -> tuple[object, ...]:
    pose = np.round(camera.world_from_camera, 9).ravel().tolist()
    return (camera.id, camera.kind, camera.fov, camera.resolution, *pose)


def _moved(before: Placement, after: Placement) -> int:
    """Cameras of `before` that are gone, and new ones."""
    old, new = {_pose(c) for c in before.cameras}, {_pose(c) for c in after.cameras}
    return len(old - new) + len(new - old)


def test_the_same_scene_keeps_its_cameras(before: Placement) -> None:
    again = _place(geometry_of(ROOM), before)
    # One that others made superfluous may go, and then something better come.
    assert _moved(before, again) <= 2
    third = _place(geometry_of(ROOM), again)
    assert _moved(again, third) == 0
    assert third.kept == len(third.cameras)


def test_one_more_object_moves_at_most_a_few(before: Placement) -> None:
    settled = _place(geometry_of(ROOM), before)
    after = _place(geometry_of(FURNISHED), settled)
    cold = _place(geometry_of(FURNISHED))
    assert _moved(settled, after) <= 3
    assert _moved(before, cold) > 3
    assert after.well_seen[-1] > cold.well_seen[-1] - 0.02
    assert after.seen[-1] > cold.seen[-1] - 0.01
    ids = [camera.id for camera in after.cameras]
    assert len(set(ids)) == len(ids)
    for camera in after.cameras:
        if camera.kind == "CUBE_FACE":
            centre = after.spheres.centre[camera.source]
            np.testing.assert_allclose(centre, camera.origin, atol=1e-9)


def test_a_full_budget_gives_one_up_for_something_much_better() -> None:
    """The view looks at one wall; then it is walled off, and what is new has no camera."""
    first = _place(geometry_of(ROOM), cameras=1)
    wall = np.array([[-2.0, -2, -2], [2.0, -2, -2], [2, -2, 2], [-2, -2, 2]])
    sheet = (np.add(wall, (0.0, 0.9, 0.0)), np.array([[0, 1, 2], [0, 2, 3]]))
    second = _place(geometry_of([*ROOM, sheet]), first, cameras=1)
    assert len(second.cameras) == 1
    assert second.seen[-1] > 0.8


def test_a_smaller_budget_keeps_the_most_useful(before: Placement) -> None:
    five = _place(geometry_of(ROOM), cameras=5)
    four = _place(geometry_of(ROOM), five, cameras=4)
    assert len(four.cameras) <= 4
    assert four.kept >= 3
    assert {_pose(c) for c in four.cameras[: four.kept]} <= {_pose(c) for c in five.cameras}
    assert four.seen[-1] > five.seen[-1] - 0.02
    limited = _place(geometry_of(ROOM), before, primaries=0, secondaries=3)
    assert all(camera.kind == "PERSPECTIVE" for camera in limited.cameras)
    assert len(limited.cameras) <= 3


def test_useless_cameras_are_not_kept(before: Placement) -> None:
    away = before.cameras[-1].world_from_camera.copy()
    away[:3, 3] = [0.3, 0.2, -0.6]  # inside of the cube
    lost = replace(before.cameras[-1], id=99, world_from_camera=away, source=99)
    after = place_cameras(geometry_of(ROOM), (VIEW,), SMALL, earlier=(*before.cameras, lost))
    assert 99 not in {camera.id for camera in after.cameras}


def test_clips_of_kept_cameras_are_widened_only(before: Placement) -> None:
    after = _place(geometry_of(FURNISHED), before)
    for camera in after.cameras[: after.kept]:
        old = next(c for c in before.cameras if c.id == camera.id)
        assert camera.near <= old.near * (1 + 1e-12)
        assert camera.far >= old.far * (1 - 1e-12)
