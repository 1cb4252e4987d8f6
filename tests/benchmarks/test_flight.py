# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight's way, and its figures on surfaces whose values are known everywhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.camplace.rays import RayCaster
from addon.errors import InputError
from addon.scene.view import View
from benchmarks.flight import draw, table
from benchmarks.flight_figures import Frame, flicker, seams, see
from benchmarks.flight_path import fly
from tests.synthetic import geometry_of, looking_at, perspective_view, room_with_box

STOPS = ((-1.5, -1.5, 0.5), (1.5, -1.4, 0.4), (1.4, 1.5, -0.3))
ROOM = room_with_box()
RAYS = RayCaster(ROOM)
WIDTH, HEIGHT = 64, 48


def _view(place: tuple[float, float, float], target: tuple[float, float, float]) -> View:
    return perspective_view(looking_at(place, target), WIDTH, HEIGHT, 1.0)


def _stops() -> list[View]:
    return [
        replace(_view(place, (0.0, 0.0, 0.0)), name=f"stop {n}") for n, place in enumerate(STOPS)
    ]


def _frame(view: View, slope: float = 0.0, camera: int | None = None) -> Frame:
    """Values that rise by `slope` levels a metre; two caching cameras parted at x = 0."""
    surfaces = see(view, RAYS, np.zeros(3), ROOM.normal, ROOM.object_id.astype(np.int64))
    value = 100.0 + slope * surfaces.point.sum(axis=-1)
    parted = (surfaces.point[..., 0] > 0.0).astype(np.int64)
    return Frame(view, surfaces, value, parted if camera is None else np.full_like(parted, camera))


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_the_flight_stays_in_free_space_and_keeps_its_speed(offset: float) -> None:
    shift = np.full(3, offset)
    geometry = room_with_box(1.0, shift)
    stops = []
    for view in _stops():
        world = view.world_from_camera.copy()
        world[:3, 3] += shift
        stops.append(replace(view, world_from_camera=world))
    flight = fly(stops, np.zeros((0, 3)), geometry, 60)
    places = np.array([view.origin - shift for view in flight.views])
    assert len(places) == 60
    assert flight.left_out == ()
    # float64 at a million metres has a spacing of 1e-10.
    np.testing.assert_allclose(places[0], STOPS[0], atol=1e-9)
    np.testing.assert_allclose(places[-1], STOPS[2], atol=1e-9)
    assert not RAYS.occluded(places[:-1], places[1:]).any()
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # A chord is shorter than its arc, and LEAST_STEP lets it rest a little.
    assert steps.max() <= 1.01 * flight.length / 59
    assert steps.min() > 0.9 * flight.length / 59
    axes = np.array([view.world_from_camera[:3, 2] for view in flight.views])
    # 60 frames turn by less than a half turn in all, with no jerk.
    assert np.degrees(np.arccos((axes[1:] * axes[:-1]).sum(axis=1))).max() < 8.0


def test_a_wall_between_two_stops_is_flown_around() -> None:
    # A wall across the room, with a door at one side.
    vertices = np.array([[0, -2, -2], [0, 1, -2], [0, 1, 2], [0, -2, 2]], dtype=np.float64)
    wall = (vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    geometry = geometry_of([(ROOM.vertices[:8], ROOM.triangles[:12].astype(np.int64)), wall])
    rays = RayCaster(geometry)
    stops = [_view((-1.0, -1.0, 0.0), (0, 0, 0)), _view((1.0, -1.0, 0.0), (0, 0, 0))]
    with pytest.raises(InputError, match="no line of sight"):
        fly(stops, np.zeros((0, 3)), geometry, 10)
    flight = fly(stops, np.array([[0.0, 1.5, 0.0]]), geometry, 40)
    places = np.array([view.origin for view in flight.views])
    assert not rays.occluded(places[:-1], places[1:]).any()
    assert places[:, 1].max() > 1.0


def test_points_lie_where_the_pixels_look() -> None:
    view = _stops()[0]
    surfaces = see(view, RAYS, np.zeros(3), ROOM.normal, ROOM.object_id.astype(np.int64))
    seen = view.project(surfaces.point)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    # embree measures in float32: 1e-6 of a distance of 4 m, by 60 pixels a metre and more.
    np.testing.assert_allclose(seen[..., 0], x, atol=1e-3)
    np.testing.assert_allclose(seen[..., 1], y, atol=1e-3)
    assert set(np.unique(surfaces.owner)) == {0, 1}


def test_a_picture_without_steps_has_none_across_seams() -> None:
    found = seams(_frame(_stops()[0], slope=10.0))
    assert found.share > 0.0
    # On a plane the value is nearly linear from pixel to pixel: seams step as what is beside them.
    assert found.step == pytest.approx(found.beside, rel=0.02)


def test_a_step_at_the_seams_is_measured() -> None:
    frame = _frame(_stops()[0])
    found = seams(replace(frame, value=frame.value + 7.0 * frame.camera))
    assert found.step == pytest.approx(7.0)
    assert found.beside == 0.0
    assert found.worst == pytest.approx(7.0)


def test_edges_between_surfaces_are_no_seams() -> None:
    frame = _frame(_stops()[0])
    # One camera for the box, another for the room, which meet nowhere.
    parted = replace(frame, camera=frame.surfaces.owner)
    assert seams(parted).share == 0.0


def test_still_light_does_not_flicker_while_the_camera_moves() -> None:
    first = _frame(_view((-1.5, -1.5, 0.5), (0, 0, 0)), slope=10.0)
    second = _frame(_view((-1.47, -1.5, 0.52), (0.02, 0, 0)), slope=10.0)
    found = flicker(first, second)
    assert found.share > 0.8
    # What is linear on planes is not quite in perspective: second differences of some pixels.
    assert found.worst < 0.1
    assert 0.0 < found.switched < 0.1
    assert found.excess < 1e-3


def test_a_camera_that_takes_over_everywhere_with_another_value_is_flicker() -> None:
    first = _frame(_view((-1.5, -1.5, 0.5), (0, 0, 0)), camera=0)
    moved = _frame(_view((-1.47, -1.5, 0.52), (0.02, 0, 0)), camera=1)
    found = flicker(first, replace(moved, value=moved.value + 5.0))
    assert found.switched == 1.0
    assert found.switched_change == pytest.approx(5.0)
    assert found.excess == pytest.approx(5.0)


def test_what_was_hidden_before_is_no_flicker() -> None:
    first = _frame(_view((-1.5, -1.5, 0.5), (0, 0, 0)))
    behind = _view((1.5, 1.5, 0.5), (0, 0, 0))
    other = _frame(behind)
    found = flicker(first, replace(other, value=np.full_like(other.value, 200.0)))
    # From the far corner only the box's top and the side walls are the same points.
    ok = found.picture > 0.0
    point = first.surfaces.point[ok]
    seen = ~RAYS.occluded(point + 1e-4 * first.surfaces.normal[ok], behind.origin)
    # embree's hits are off by less than the lift, but a pixel reaches over an edge.
    assert seen.mean() > 0.98


def test_the_plot_and_the_table_show_every_scene(tmp_path: Path) -> None:
    part = {"share": 0.04, "step": 1.0, "beside": 0.5, "worst": 2.0}
    change = {
        "share": 0.9, "switched": 0.1, "stayed_change": 0.2, "switched_change": 1.2,
        "worst": 3.0, "excess": 0.1,
    }  # fmt: skip
    rows = [
        {"holes": 0.02 * n, "open": 0.01, "seams": part, "flicker": change if n else None}
        for n in range(3)
    ]
    flights = {"hall": {"cameras": 5, "frames": rows}}
    draw(flights, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 10_000
    # Mean and most of 0, 2 and 4 %.
    assert "| hall | 2.00 / 4.00 | 1.00 / 1.00 | 4.00 / 4.00 |" in table(flights)
