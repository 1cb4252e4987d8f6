# SPDX-License-Identifier: GPL-3.0-or-later
"""The place that gains most is found without asking all of them each time."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.camplace import candidates
from addon.camplace.aim import aimed_camera
from addon.camplace.camera import CachingCamera
from addon.camplace.candidates import FINALISTS, Candidates
from addon.camplace.coverage import joined, seen_by_camera
from addon.camplace.places import Sights
from addon.camplace.prepare import Stage, prepare
from addon.camplace.settings import PlacementSettings
from tests.synthetic import looking_at, perspective_view, room_with_box

RESOLUTION = 512
# Two in the room, one below its floor, one in its box.
CORNERS = np.array([[1.7, 1.7, 1.7], [-1.7, 1.7, -1.7], [0.0, 0.0, -9.0], [0.3, 0.2, -0.6]])


@pytest.fixture(scope="module")
def stage() -> Stage:
    view = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)
    settings = PlacementSettings(view_samples=800, area_samples=600)
    return prepare(room_with_box(), (view,), None, settings, np.random.default_rng(0))


def _nowhere(_worth: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.zeros((0, 3))


def _gains(
    stage: Stage, places: NDArray[np.float64], worth: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What the best camera at each place gains, each asked anew."""
    sights = Sights(stage)
    lack = stage.samples.weight * (1.0 - worth)
    gains = np.zeros(len(places))
    for number, place in enumerate(places):
        visible = sights.of(place)
        visible = visible[lack[visible] > 0.0]
        if visible.size:
            gains[number] = aimed_camera(place, stage.samples, visible, worth, RESOLUTION)[2]
    return gains


def _seen(stage: Stage, worth: NDArray[np.float64], camera: CachingCamera) -> NDArray[np.float64]:
    visible = Sights(stage).of(camera.origin)
    return joined(worth, seen_by_camera(camera, stage.samples, visible))


def test_the_best_of_all_is_found_each_time(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def counting(place: NDArray[np.float64], *rest: object) -> object:
        asked.append(place)
        return aimed_camera(place, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(candidates, "aimed_camera", counting)
    places = np.random.default_rng(1).uniform(-1.9, 1.9, (24, 3))
    pool = Candidates(stage, Sights(stage), places, _nowhere, RESOLUTION)
    worth = np.zeros(len(stage.samples))
    rounds = 5
    for _ in range(rounds):
        best = pool.best(worth)
        assert best is not None
        gains = _gains(stage, places, worth)
        np.testing.assert_array_equal(best.origin, places[int(np.argmax(gains))])
        worth = _seen(stage, worth, best)
    assert len(asked) < 0.7 * rounds * len(places)
    # Now that all gains are known, nothing but the best is asked once more.
    last = pool.best(worth)
    assert last is not None
    asked.clear()
    pool.best(worth)
    assert len(asked) == 1


def test_after_cameras_were_taken_away_all_are_asked_again(stage: Stage) -> None:
    places = np.random.default_rng(2).uniform(-1.9, 1.9, (12, 3))
    pool = Candidates(stage, Sights(stage), places, _nowhere, RESOLUTION)
    nothing = np.zeros(len(stage.samples))
    first = pool.best(nothing)
    assert first is not None
    seen_from_there = nothing.copy()
    seen_from_there[Sights(stage).of(first.origin)] = 1.0
    elsewhere = pool.best(seen_from_there)
    assert elsewhere is not None
    assert not np.array_equal(elsewhere.origin, first.origin)
    pool.forget()
    again = pool.best(nothing)
    assert again is not None
    np.testing.assert_array_equal(again.origin, first.origin)


def test_proposals_are_added_to_what_is_tried(stage: Stage) -> None:
    poor, good = CORNERS[2:], np.array([[0.0, -1.0, 1.0]])
    proposals = [good, np.zeros((0, 3))]
    pool = Candidates(stage, Sights(stage), poor, lambda _worth: proposals.pop(0), RESOLUTION)
    worth = np.zeros(len(stage.samples))
    best = pool.best(worth)
    assert best is not None
    np.testing.assert_array_equal(best.origin, good[0])
    # It stays: another camera there, aimed elsewhere, may be best again.
    again = pool.best(_seen(stage, worth, best))
    assert again is not None
    np.testing.assert_array_equal(again.origin, good[0])
    assert not np.array_equal(again.world_from_camera, best.world_from_camera)


def test_of_many_proposals_the_best_is_among_those_kept(stage: Stage) -> None:
    poor = np.stack([np.linspace(-1.0, 1.0, 3 * FINALISTS), np.zeros(24), np.full(24, -9.0)], -1)
    good = np.array([[0.0, -1.0, 1.0]])
    many = np.concatenate([poor, good])
    nowhere = np.zeros((0, 3))
    pool = Candidates(stage, Sights(stage), nowhere, lambda _worth: many, RESOLUTION)
    best = pool.best(np.zeros(len(stage.samples)))
    assert best is not None
    np.testing.assert_array_equal(best.origin, good[0])


def test_where_nothing_lacks_no_camera_gains(stage: Stage) -> None:
    pool = Candidates(stage, Sights(stage), CORNERS, lambda _worth: CORNERS, RESOLUTION)
    assert pool.best(np.ones(len(stage.samples))) is None
