# SPDX-License-Identifier: GPL-3.0-or-later
"""Placement as a whole, on scenes whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.camera import CachingCamera
from addon.camplace.place import place_cameras
from addon.camplace.placement import Placement
from addon.camplace.settings import PlacementSettings
from addon.errors import InputError
from addon.progress import Cancelled
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from tests.synthetic import Tracer, box, geometry_of, looking_at, perspective_view, room_with_box

SHEET = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
# Small enough to be quick, large enough that a few samples more or less change nothing.
SMALL = PlacementSettings(
    view_samples=1200, area_samples=800, grid_cells=32, candidates=8, sphere_searches=20
)


def _room_view(scale: float = 1.0, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> View:
    place = np.array([1.6, -1.7, 0.9]) * scale + offset
    target = np.array([-0.4, 0.9, -0.6]) * scale + offset
    pose = looking_at(tuple(place), tuple(target))
    return perspective_view(pose, 320, 240, 1.2, near=0.01 * scale, far=100.0 * scale)


@pytest.fixture(scope="module")
def room() -> Placement:
    return place_cameras(room_with_box(), (_room_view(),), SMALL)


def _covers(camera: CachingCamera, geometry: SceneGeometry, placement: Placement) -> np.ndarray:
    """(S,) by an independent trace: in the frustum, facing, first to be hit."""
    point, normal = placement.sample_point, placement.sample_normal
    place = camera.project(point)
    inside = (place[:, 2] > 0) & (np.abs(place[:, :2] - 0.5) <= 0.5).all(axis=-1)
    way = point - camera.origin
    distance = np.linalg.norm(way, axis=-1)
    direction = way / distance[:, None]
    facing = np.einsum("sx,sx->s", direction, normal) < 0.0
    triangle, hit = Tracer(geometry).hit(np.broadcast_to(camera.origin, point.shape), direction)
    near = np.linalg.norm(hit - point, axis=-1) <= 1e-4 * distance
    return np.asarray(inside & facing & (triangle >= 0) & near)


def test_covered_samples_are_covered_and_the_others_are_not(room: Placement) -> None:
    traced = np.zeros(len(room.sample_point), dtype=bool)
    for camera in room.cameras:
        traced |= _covers(camera, room_with_box(), room)
    # Rays that graze an edge may be decided either way.
    assert (traced != room.covered).mean() < 0.005


def test_a_room_is_covered(room: Placement) -> None:
    view = room.from_view
    assert room.covered[view].mean() > 0.995
    assert room.worth[view].mean() > 0.9
    assert room.seen[-1] > 0.97
    assert not room.warnings


def test_coverage_rises_with_every_camera(room: Placement) -> None:
    assert len(room.seen) == len(room.well_seen) == len(room.cameras)
    assert (np.diff(room.seen) >= 0.0).all()
    assert (np.diff(room.well_seen) >= 0.0).all()
    assert (room.well_seen <= room.seen + 1e-12).all()
    assert room.sample_weight.sum() == pytest.approx(1.0)
    assert room.seen[-1] == pytest.approx(room.sample_weight @ room.covered)


def test_cameras_are_numbered_typed_and_clear_of_surfaces(room: Placement) -> None:
    cameras = room.cameras
    assert [camera.id for camera in cameras] == list(range(len(cameras)))
    faces = [camera for camera in cameras if camera.kind == "CUBE_FACE"]
    assert 1 <= len(faces) <= 6
    assert all(camera.fov == pytest.approx(np.pi / 2) for camera in faces)
    assert all(camera.source < len(room.spheres) for camera in faces)
    sources = [camera.source for camera in cameras if camera.kind == "PERSPECTIVE"]
    assert sources == list(range(len(sources)))
    assert len(sources) <= SMALL.secondaries
    for camera in cameras:
        assert 0.0 < camera.near < camera.far
        wall = 2.0 - np.abs(camera.origin).max()
        to_cube = np.abs(camera.origin - [0.3, 0.2, -0.6]).max() - 0.5
        # Nothing in the frustum is nearer than the near clip: no surface is cut away.
        assert camera.near < min(wall, to_cube)
        assert camera.far >= np.abs(room.sample_point - camera.origin).max()
        assert camera.fov <= np.radians(120.0) + 1e-12


def test_the_same_seed_gives_the_same_cameras(room: Placement) -> None:
    again = place_cameras(room_with_box(), (_room_view(),), SMALL)
    assert [c.to_json() for c in again.cameras] == [c.to_json() for c in room.cameras]
    other = place_cameras(room_with_box(), (_room_view(),), replace(SMALL, seed=1))
    assert [c.to_json() for c in other.cameras] != [c.to_json() for c in room.cameras]


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1.0, (1e6, -1e6, 5e5)), (1e-3, (0.0, 0.0, 0.0)), (1e5, (0.0, 0.0, 0.0))],
)
def test_a_similar_scene_has_similar_cameras(
    room: Placement, scale: float, offset: tuple[float, float, float]
) -> None:
    moved = place_cameras(room_with_box(scale, offset), (_room_view(scale, offset),), SMALL)
    assert len(moved.cameras) == len(room.cameras)
    for there, here in zip(moved.cameras, room.cameras, strict=True):
        back = (there.origin - offset) / scale
        # 1e6 m has 1e-10 m of float64; float32 rays may then decide a few samples otherwise,
        # which shifts a mean direction or a width a little.
        np.testing.assert_allclose(back, here.origin, atol=1e-3)
        np.testing.assert_allclose(
            there.world_from_camera[:3, :3], here.world_from_camera[:3, :3], atol=0.02
        )
        assert there.fov == pytest.approx(here.fov, abs=0.02)
        assert there.near / scale == pytest.approx(here.near, rel=0.01)
        assert there.resolution == here.resolution


def test_two_triangles_and_a_view() -> None:
    geometry = geometry_of([(SQUARE, SHEET)])
    view = perspective_view(looking_at((0.5, -1.0, 1.5), (0.5, 0.5, 0.0)), 200, 200, 0.8)
    placement = place_cameras(geometry, (view,), SMALL)
    assert placement.covered.all()
    # The view sees the upper side, so that is the side to cache.
    assert all(camera.origin[2] > 0.0 for camera in placement.cameras)


def test_a_two_sided_sheet_is_cached_from_the_side_that_the_view_sees() -> None:
    """Twice the same sheet, wound both ways round."""
    for sheet in (SQUARE, SQUARE[::-1]):
        geometry = geometry_of([(sheet, SHEET)])
        view = perspective_view(looking_at((0.5, -1.0, -1.5), (0.5, 0.5, 0.0)), 200, 200, 0.8)
        placement = place_cameras(geometry, (view,), SMALL)
        assert all(camera.origin[2] < 0.0 for camera in placement.cameras)
        assert (placement.sample_normal[placement.from_view, 2] < 0.0).all()


def test_without_a_view_the_whole_scene_is_served() -> None:
    placement = place_cameras(room_with_box(), (), SMALL)
    assert not placement.from_view.any()
    assert placement.seen[-1] > 0.95
    # Outward winding does not turn the cameras out of the room.
    assert all(np.abs(camera.origin).max() < 2.0 for camera in placement.cameras)


def test_hills_far_away_do_not_blow_up_the_box() -> None:
    ground = (SQUARE - [0.5, 0.5, 0]) * [60.0, 60.0, 1.0]
    hill = np.array([[-5e3, 8e3, -10], [5e3, 8e3, -10], [5e3, 9e3, 2e3], [-5e3, 9e3, 2e3]])
    geometry = geometry_of([(ground, SHEET), (hill, SHEET), box((0.0, 2.0, 1.0), 2.0)])
    view = perspective_view(looking_at((3.0, -6.0, 2.0), (0.0, 2.0, 1.0)), 320, 240, 1.0, far=2e4)
    placement = place_cameras(geometry, (view,), SMALL)
    assert (placement.box[1] - placement.box[0]).max() < 120.0
    seen_hill = placement.from_view & (placement.sample_point[:, 1] > 1e3)
    assert seen_hill.any()
    assert placement.covered[seen_hill].mean() > 0.95
    assert placement.covered[placement.from_view].mean() > 0.98
    assert all(camera.far > 8e3 for camera in placement.cameras)


def test_an_alcove_that_the_primary_misses_gets_a_camera() -> None:
    """A wall stands in the room; the view looks behind it from the side."""
    wall = np.array([[-2.0, 0.5, -2], [1.0, 0.5, -2], [1.0, 0.5, 2], [-2.0, 0.5, 2]])
    geometry = geometry_of([box((0, 0, 0), 4.0), (wall, SHEET)])
    view = perspective_view(looking_at((1.7, 0.6, 0.3), (-1.5, 1.2, 0.0)), 320, 240, 1.3)
    alone = place_cameras(geometry, (view,), replace(SMALL, secondaries=0))
    more = place_cameras(geometry, (view,), SMALL)
    behind = more.from_view & (more.sample_point[:, 1] > 0.51)
    assert behind.mean() > 0.3
    assert more.covered[behind].mean() > 0.99
    assert more.seen[-1] >= alone.seen[-1]


def test_more_of_the_budget_sharpens_what_is_seen() -> None:
    few = place_cameras(room_with_box(), (_room_view(),), replace(SMALL, max_resolution=256))
    one = place_cameras(
        room_with_box(), (_room_view(),), replace(SMALL, max_resolution=256, secondaries=1)
    )
    assert one.seen[-1] > 0.9
    assert few.well_seen[-1] > one.well_seen[-1] + 0.05


def test_cameras_ask_for_what_a_finer_bake_can_use() -> None:
    """A coarse bake is judged as it will be; the cameras still say what they need."""
    coarse = replace(SMALL, max_resolution=256, secondaries=2)
    placement = place_cameras(room_with_box(), (_room_view(),), coarse)
    finest = max(camera.resolution for camera in placement.cameras)
    assert finest > 256
    assert placement.shares.view_well < 0.9
    well = placement.sample_weight @ placement.well_covered
    assert well == pytest.approx(placement.well_seen[-1])
    assert well < placement.sample_weight @ placement.covered
    counted = place_cameras(room_with_box(), (_room_view(),), replace(coarse, texels=9 * 256**2))
    assert {camera.resolution for camera in counted.cameras} == {256}
    kept = place_cameras(room_with_box(), (_room_view(),), coarse, earlier=placement.cameras)
    assert kept.kept > 0
    before = {camera.id: camera.resolution for camera in placement.cameras}
    assert all(c.resolution == before[c.id] for c in kept.cameras[: kept.kept])
    assert kept.shares.view_well == pytest.approx(placement.shares.view_well, abs=0.05)


def test_weights_draw_the_cameras() -> None:
    """Two facing walls; only one of them matters."""
    plate = np.array([[-2.0, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]])
    geometry = geometry_of([(np.add(plate, (0, -3, 0)), SHEET), (np.add(plate, (0, 3, 0)), SHEET)])
    weight = np.array([1, 1, 0, 0], dtype=np.float32)
    settings = replace(SMALL, primaries=0, secondaries=1)
    placement = place_cameras(replace(geometry, weight=weight), (), settings)
    assert placement.covered.all()
    assert (placement.sample_point[:, 1] < 0.0).all()


def test_the_box_of_interest_bounds_cameras_and_samples() -> None:
    bounds = np.array([[-2.5, -2.5, -2.5], [0.5, 0.5, 0.5]])
    placement = place_cameras(room_with_box(), (_room_view(),), replace(SMALL, bounds=bounds))
    inside = (placement.sample_point >= bounds[0]) & (placement.sample_point <= bounds[1])
    assert inside.all()
    for camera in placement.cameras:
        assert ((camera.origin >= bounds[0]) & (camera.origin <= bounds[1])).all()
    assert any("box of interest" in warning for warning in placement.warnings)


def test_a_view_that_sees_nothing_is_named_and_a_single_plane_is_seen_well() -> None:
    geometry = geometry_of([(np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), SHEET)])
    away = replace(perspective_view(looking_at((0, 0, 5), (0, 0.1, 9)), 320, 240, 1.0), name="Lost")
    placement = place_cameras(geometry, (away,), SMALL)
    assert any("in sight of Lost" in warning for warning in placement.warnings)
    # Nobody knows from where the plane will be looked at: the box leaves room over and under it.
    assert (placement.box[1, 2] - placement.box[0, 2]) > 0.9
    assert placement.shares.area_well > 0.95
    seeing = place_cameras(room_with_box(), (_room_view(),), replace(SMALL, secondaries=1))
    assert not any("in sight" in warning for warning in seeing.warnings)


def test_offered_views_may_be_taken() -> None:
    settings = replace(SMALL, primaries=0, secondaries=1, offer_views=True)
    placement = place_cameras(room_with_box(), (_room_view(),), settings)
    assert placement.well_seen[-1] > 0.8


def test_orthographic_view() -> None:
    clip = np.diag([1 / 1.5, 1 / 1.5, -2 / 9.9, 1.0])
    clip[2, 3] = -10.1 / 9.9
    view = View(looking_at((0, 0, 1.9), (0, 0, 0), (0, 1, 0)), clip, 200, 200, perspective=False)
    placement = place_cameras(room_with_box(), (view,), SMALL)
    assert placement.covered[placement.from_view].mean() > 0.99


def test_input_that_cannot_be_used() -> None:
    room = room_with_box()
    view = (_room_view(),)
    none = np.zeros(len(room), dtype=bool)
    empty = replace(
        room, triangles=room.triangles[:0], camera_visible=none[:0], weight=room.weight[:0]
    )
    for geometry in (empty, replace(room, camera_visible=none)):
        with pytest.raises(InputError, match="no surface"):
            place_cameras(geometry, view, SMALL)
    with pytest.raises(InputError, match="weight"):
        place_cameras(replace(room, weight=room.weight * 0), view, SMALL)
    away = np.array([[50.0] * 3, [51.0] * 3])
    with pytest.raises(InputError, match="holds no surface"):
        place_cameras(room, view, replace(SMALL, bounds=away))


@pytest.mark.parametrize(
    "settings",
    [
        PlacementSettings(primaries=0, secondaries=0),
        PlacementSettings(primaries=-1),
        PlacementSettings(view_samples=0),
        PlacementSettings(grid_cells=1),
        PlacementSettings(view_share=1.5),
        PlacementSettings(max_resolution=1000),
        PlacementSettings(bounds=np.array([[1.0] * 3, [0.0] * 3])),
        PlacementSettings(bounds=np.array([[np.nan] * 3, [1.0] * 3])),
    ],
)
def test_settings_that_cannot_be_used(settings: PlacementSettings) -> None:
    with pytest.raises(InputError):
        place_cameras(room_with_box(), (), settings)


def test_progress_rises_and_may_cancel() -> None:
    told: list[float] = []
    place_cameras(room_with_box(), (_room_view(),), SMALL, lambda share, _: told.append(share))
    assert told == sorted(told)
    assert told[0] == 0.0

    def stop(share: float, message: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        place_cameras(room_with_box(), (_room_view(),), SMALL, stop)
