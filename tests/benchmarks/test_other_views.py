# SPDX-License-Identifier: GPL-3.0-or-later
"""Views by rule: elsewhere, in free space, and looking at what their camera looks at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.rays import RayCaster
from addon.errors import InputError
from addon.scene.view import View
from benchmarks.other_views import MOVES, other_views, turned
from tests.synthetic import looking_at, perspective_view, room_with_box

PLACES = ((-1.2, -1.2, 0.3), (1.3, -1.0, -0.2))


def _view(place: np.ndarray, target: np.ndarray) -> View:
    return perspective_view(looking_at(place, target), 160, 120, 1.0)


def _views(offset: np.ndarray, scale: float = 1.0) -> list[View]:
    return [_view(offset + scale * np.array(place), offset) for place in PLACES]


@pytest.mark.parametrize(("scale", "far"), [(1.0, 0.0), (1e3, 1e6), (1e-3, 1.0)])
def test_views_are_new_and_in_the_same_room(scale: float, far: float) -> None:
    offset = np.array([far, -far, far])
    geometry = room_with_box(scale, offset)
    found = other_views(_views(offset, scale), geometry)
    assert [view.name for view in found] == ["Other 1", "Other 2", "Other 3", "Other 4"]
    rays = RayCaster(replace(geometry, vertices=geometry.vertices - offset))
    for view in found:
        at = view.origin - offset
        # Placement moves views by a tenth of their viewing distance; in this room that is 0.2.
        away = [float(np.linalg.norm(at - scale * np.array(place))) for place in PLACES]
        assert min(away) > 0.2 * scale
        assert not rays.occluded(at[None], scale * np.array([PLACES[int(np.argmin(away))]])).any()
        assert (np.abs(at) < 2.0 * scale).all()
        axes = view.world_from_camera[:3, :3]
        # Composed of float64 unit vectors.
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_the_rule_gives_the_same_views_again() -> None:
    views, geometry = _views(np.zeros(3)), room_with_box()
    pairs = zip(other_views(views, geometry), other_views(views, geometry), strict=True)
    for first, second in pairs:
        np.testing.assert_array_equal(first.world_from_camera, second.world_from_camera)


@pytest.mark.parametrize("move", [move for move, _ in MOVES])
def test_a_turned_view_has_the_same_place_in_its_middle(move: tuple[float, float, float]) -> None:
    view = _view(np.array([0.4, -3.0, 0.7]), np.zeros(3))
    distance = 2.5
    middle = view.origin - distance * view.world_from_camera[:3, 2]
    scaled = (distance * move[0], distance * move[1], distance * move[2])
    seen = turned(view, scaled, distance).project(middle)
    # To float64's rounding, of numbers about 100.
    np.testing.assert_allclose(seen[:2], [view.width / 2, view.height / 2], atol=1e-9)


def test_views_that_see_nothing_are_refused() -> None:
    away = _view(np.array([0.0, 0.0, 50.0]), np.array([0.0, 90.0, 50.0]))
    with pytest.raises(InputError, match="no camera of the scene sees"):
        other_views([away], room_with_box())
