# SPDX-License-Identifier: GPL-3.0-or-later
"""What is chosen, kept, sharpened and given up, with places and cameras that are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.camplace.aim import look, needed_resolution
from addon.camplace.camera import CachingCamera
from addon.camplace.choose import Chosen, choose_cameras
from addon.camplace.coverage import gain, seen_by_camera
from addon.camplace.keep import kept_groups
from addon.camplace.offer import Choice
from addon.camplace.places import Sights
from addon.camplace.prepare import Stage, prepare
from addon.camplace.settings import PlacementSettings
from addon.camplace.spheres import Spheres
from addon.progress import silent
from tests.synthetic import looking_at, perspective_view, room_with_box

SMALL = PlacementSettings(
    view_samples=800, area_samples=600, grid_cells=24, candidates=6, sphere_searches=10
)
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)
NOWHERE = Spheres(np.zeros((0, 3)), np.zeros(0))
GOOD = np.array([[1.5, -1.5, 0.9]])


@pytest.fixture(scope="module")
def stage() -> Stage:
    return prepare(room_with_box(), (VIEW,), None, SMALL, np.random.default_rng(0))


def _chosen(
    stage: Stage, earlier: Sequence[CachingCamera] = (), places: Any = GOOD, **changes: Any
) -> Chosen:
    """With `places` (N, 3) as the only ones."""
    return choose_cameras(
        stage,
        NOWHERE,
        NOWHERE,
        replace(SMALL, **changes),
        lambda _worth: places,
        earlier=[[camera] for camera in earlier],
        progress=silent,
    )


def _camera(place: tuple[float, ...], target: tuple[float, ...], fov: float) -> CachingCamera:
    forward = np.subtract(target, place)
    return CachingCamera(
        id=0,
        world_from_camera=look(np.array(place), forward, np.array([0.0, 0.0, 1.0])),
        fov=fov,
        near=0.01,
        far=100.0,
        resolution=512,
        kind="PERSPECTIVE",
        source=0,
    )


def _score(stage: Stage, camera: CachingCamera) -> float:
    """What the camera alone is worth."""
    seen = seen_by_camera(camera, stage.samples, Sights(stage).of(camera.origin))
    return gain(seen, np.zeros(len(stage.samples)), stage.samples.weight)


# A narrow look at a part of the far wall: not nothing, and far from what one camera can do.
NARROW = _camera((-1.0, 0.5, 0.5), (-1.0, 2.0, 0.3), 0.9)
# The best of what the view sees.
WIDE = _camera((1.5, -1.5, 0.9), (-0.4, 0.9, -0.6), 1.6)


def test_a_full_budget_gives_up_what_sees_little_for_what_sees_much(stage: Stage) -> None:
    assert 0.03 < _score(stage, NARROW) < 0.3
    chosen = _chosen(stage, [NARROW], cameras=1)
    ((choice,),) = chosen.groups
    np.testing.assert_array_equal(choice.camera.origin, GOOD[0])
    assert chosen.kept == 0
    assert _score(stage, choice.camera) > 0.6


def test_the_one_that_is_missed_least_is_given_up(stage: Stage) -> None:
    other = np.array([[-1.6, -1.6, 1.6]])
    for earlier in ([WIDE, NARROW], [NARROW, WIDE]):
        chosen = _chosen(stage, earlier, other, cameras=2, max_resolution=512)
        assert chosen.kept == 1
        assert len(chosen.groups) == 2
        np.testing.assert_array_equal(chosen.groups[0][0].camera.origin, WIDE.origin)
        np.testing.assert_array_equal(chosen.groups[1][0].camera.origin, other[0])


def test_nothing_is_given_up_for_something_little_better(stage: Stage) -> None:
    """What is won is several least gains, and less than it takes."""
    won = 0.9 - _score(stage, NARROW)
    chosen = _chosen(stage, [NARROW], cameras=1, least_gain=won / 8.0)
    ((choice,),) = chosen.groups
    np.testing.assert_array_equal(choice.camera.origin, NARROW.origin)
    assert chosen.stop == "budget"


@pytest.mark.parametrize("earlier", [[replace(WIDE, resolution=256)], []])
def test_texels_that_are_left_sharpen_what_was_chosen(
    stage: Stage, earlier: list[CachingCamera]
) -> None:
    """A coarse picture comes first, since it gains most for its texels."""
    poor = _chosen(stage, earlier, texels=256**2)
    rich = _chosen(stage, earlier, texels=4 * 1024**2)
    ((coarse,),) = poor.groups
    fine = rich.groups[0][0]
    assert coarse.camera.resolution == 256
    needed = needed_resolution(coarse.seen, stage.samples.weight, 256, SMALL.max_resolution)
    assert fine.camera.resolution == needed > 256
    np.testing.assert_array_equal(fine.camera.world_from_camera, coarse.camera.world_from_camera)
    assert np.median(fine.seen.texel) < 0.6 * np.median(coarse.seen.texel)
    assert rich.kept == len(earlier)


@pytest.mark.parametrize("width", [320, 640])
def test_texels_go_to_a_few_pictures_not_to_many_of_the_smallest(width: int) -> None:
    """Eight of the smallest could be had. Each would gain more for its texels than a sharper
    one, but every picture costs something besides."""
    view = perspective_view(VIEW.world_from_camera, width, width * 3 // 4, 1.2)
    stage = prepare(room_with_box(), (view,), None, SMALL, np.random.default_rng(0))
    places = np.random.default_rng(0).uniform(-1.7, 1.7, (60, 3))
    chosen = _chosen(stage, (), places, texels=8 * 256**2)
    pictures = [choice.camera.resolution for group in chosen.groups for choice in group]
    assert pictures == [512, 512]


@pytest.mark.parametrize(("share", "kept"), [(0.05, False), (0.4, True), (0.9, True), (2.0, True)])
def test_an_earlier_camera_may_add_less_than_a_new_one_must(
    stage: Stage, share: float, *, kept: bool
) -> None:
    """Asked of it is more than nothing and less than half a least gain."""
    visible = Sights(stage).of(NARROW.origin)
    choice = Choice(NARROW, seen_by_camera(NARROW, stage.samples, visible))
    weight = stage.samples.weight
    settings = replace(SMALL, least_gain=_score(stage, NARROW) / share)
    assert (kept_groups([(choice,)], weight, settings) == [(choice,)]) == kept
