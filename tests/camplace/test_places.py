# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that are tried keep clear of surfaces, and the views' own are among them if asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.choose import choose_cameras
from addon.camplace.coverage import SEEN
from addon.camplace.grid import Grid
from addon.camplace.places import VotedPlaces, clear_places
from addon.camplace.prepare import Stage, prepare
from addon.camplace.settings import PlacementSettings
from addon.camplace.spheres import Spheres
from addon.camplace.votes import Ballot, strongest_cells
from addon.progress import silent
from tests.synthetic import looking_at, perspective_view, room_with_box

SMALL = PlacementSettings(
    view_samples=800, area_samples=600, grid_cells=24, candidates=8, sphere_searches=10
)
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 1920, 1440, 1.2)
NOWHERE = Spheres(np.zeros((0, 3)), np.zeros(0))


@pytest.fixture(scope="module")
def stage() -> Stage:
    bounds = np.array([[-2.2] * 3, [2.2] * 3])
    return prepare(room_with_box(), (VIEW,), bounds, SMALL, np.random.default_rng(0))


def _to_surface(places: np.ndarray) -> np.ndarray:
    """(N,) from places (N, 3) in the room to its walls or the cube in it, whichever is nearer.

    Negative in the cube and outside of the room.
    """
    walls = 2.0 - np.abs(places).max(axis=-1)
    beyond = np.abs(places - [0.3, 0.2, -0.6]) - 0.5
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    cube = np.where(outside > 0.0, outside, beyond.max(axis=-1))
    return np.asarray(np.minimum(walls, cube))


def test_only_places_more_than_a_cell_from_all_surfaces_are_clear(stage: Stage) -> None:
    cell = 0.1
    gaps = cell * np.array([0.0, 0.2, 0.5, 1.0, 1.4, 1.6, 3.0])
    by_wall = np.stack([np.full(7, -1.0), np.full(7, 1.0), 2.0 - gaps], axis=-1)
    by_cube = np.stack([np.full(7, 0.3), np.full(7, 0.2), -0.1 + gaps], axis=-1)
    in_cube = np.array([[0.3, 0.2, -0.15], [0.75, 0.2, -0.6]])
    places = np.concatenate([by_wall, by_cube, in_cube, [[0.0, 0.0, 50.0]]])
    kept = clear_places(stage, places, cell)
    np.testing.assert_array_equal(kept, np.concatenate([by_wall[5:], by_cube[5:]]))
    assert clear_places(stage, in_cube, cell).shape == (0, 3)


def test_the_strongest_cells_are_no_places_where_they_hug_a_surface(stage: Stage) -> None:
    # All is seen, and coarsely: only pictures from close by would be sharper.
    worth = np.full(len(stage.samples), SEEN + 0.5 * (1.0 - SEEN))
    settings = replace(SMALL, max_resolution=256)
    grid = Grid.over(stage.box, settings.grid_cells)
    ballot = Ballot(
        stage.samples,
        stage.lift,
        grid,
        stage.rays,
        count=settings.rays,
        resolution=settings.max_resolution,
        rng=np.random.default_rng(1),
    )
    strongest = grid.centres(strongest_cells(ballot.count(worth), settings.candidates))
    # Else this would show nothing.
    assert (_to_surface(strongest) < 1.5 * grid.cell).sum() >= 3
    propose = VotedPlaces(stage, settings, np.random.default_rng(1))
    unseen = np.zeros(len(stage.samples))
    assert len(propose(unseen)) == settings.candidates
    for now in (worth, unseen):
        # One cell and a half; distances to triangles are exact but for rounding.
        assert (_to_surface(propose(now)) >= 1.5 * grid.cell * (1.0 - 1e-6)).all()


@pytest.mark.parametrize("asked", [True, False])
def test_where_no_other_place_is_any_good_an_offered_view_is(stage: Stage, *, asked: bool) -> None:
    settings = replace(SMALL, primaries=0, secondaries=1, offer_views=asked)
    chosen = choose_cameras(
        stage, NOWHERE, NOWHERE, settings, lambda _worth: np.zeros((0, 3)), progress=silent
    )
    origins = [choice.camera.origin.tolist() for group in chosen.groups for choice in group]
    assert origins == ([VIEW.origin.tolist()] if asked else [])
