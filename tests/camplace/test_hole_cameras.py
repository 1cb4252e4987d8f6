# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras at a view hold its holes, as finely as the view shows them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.temporary_store import MOST_BYTES
from addon.caching.temporary_store import MOST_PICTURES as MOST_KEPT
from addon.camplace.camera import CachingCamera
from addon.camplace.hole_cameras import (
    MOST_PICTURES,
    MOST_TEXELS,
    SHARP_TEXELS_PER_PIXEL,
    TEXELS_PER_PIXEL,
    HoleCameras,
    HolePoints,
    hole_cameras,
)
from addon.camplace.settings import RESOLUTIONS
from addon.scene.view import View
from tests import synthetic

_PLACE = synthetic.looking_at((3.0, -8.0, 2.0), (0.0, 0.0, 0.5))


def seen_by(view: View, depth: float = 6.0, every: int = 1) -> NDArray[np.float64]:
    """A point on the ray of each pixel's centre, (H, W, 3), at about this distance; of fewer
    pixels (N, 3), one after another."""
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    if every > 1:
        x, y = x.ravel()[::every], y.ravel()[::every]
    origins, directions = view.rays(np.stack([x, y], axis=-1))
    away = depth * (1.0 + 0.2 * np.sin(0.3 * x + 0.2 * y))
    return np.asarray(origins + away[..., None] * directions)


def cameras_of(
    view: View, is_hole: NDArray[np.bool_], is_soft: NDArray[np.bool_] | None = None
) -> tuple[CachingCamera, ...]:
    soft = None if is_soft is None else is_soft.ravel()
    points = HolePoints(seen_by(view).reshape(-1, 3), is_hole.ravel(), soft)
    return hole_cameras(view, points).cameras


def held(cameras: tuple[CachingCamera, ...], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of (N, 3) points lie inside any camera's picture and between its clips."""
    inside = np.zeros(len(points), dtype=bool)
    for camera in cameras:
        u, v, depth = camera.project(points).T
        margin = 1.0 / camera.resolution
        fits = (np.abs(u - 0.5) < 0.5 - margin) & (np.abs(v - 0.5) < 0.5 - margin)
        inside |= fits & (depth > camera.near) & (depth <= camera.far)
    return inside


def a_view(fov: float = 1.0, size: tuple[int, int] = (160, 90)) -> View:
    return synthetic.perspective_view(_PLACE, *size, fov)


def shifted(view: View) -> View:
    clip = view.clip_from_camera.copy()
    clip[:2, 2] = 0.8, -0.6
    return replace(view, clip_from_camera=clip)


def stretched(view: View) -> View:
    clip = view.clip_from_camera.copy()
    clip[1, 1] *= 2.0
    return replace(view, clip_from_camera=clip)


def parallel(near: float = 0.5, far: float = 40.0) -> View:
    clip = np.diag([0.4, 0.6, -2.0 / (far - near), 1.0])
    clip[2, 3] = -(far + near) / (far - near)
    return View(_PLACE, clip, 150, 100, perspective=False)


VIEWS = {
    "plain": a_view(),
    "long lens": a_view(np.radians(1.0)),
    "wide": a_view(np.radians(150.0)),
    "shifted": shifted(a_view()),
    "stretched pixels": stretched(a_view()),
    "parallel": parallel(),
    "parallel, from behind the eye": parallel(-40.0, 40.0),
}


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("share", [1.0, 0.003])
def test_every_hole_is_in_a_picture(name: str, share: float) -> None:
    view = VIEWS[name]
    is_hole = np.random.default_rng(3).random((view.height, view.width)) < share
    cameras = cameras_of(view, is_hole)
    assert held(cameras, seen_by(view)[is_hole]).all()
    for camera in cameras:
        # As strict as what is read from a file.
        assert CachingCamera.from_json(camera.to_json()).to_json() == camera.to_json()
    assert [camera.id for camera in cameras] == list(range(len(cameras)))


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("what", ["holes", "soft"])
def test_texels_are_finer_than_pixels(name: str, what: str) -> None:
    view = VIEWS[name]
    chosen = np.random.default_rng(3).random((view.height, view.width)) < 0.01
    none = np.zeros_like(chosen)
    cameras = cameras_of(view, chosen) if what == "holes" else cameras_of(view, none, chosen)
    texels_per_pixel = TEXELS_PER_PIXEL if what == "holes" else SHARP_TEXELS_PER_PIXEL
    points = seen_by(view)[chosen]
    x = view.project(points)
    best = np.zeros(len(points))
    for camera in cameras:
        # Along the view's right, of a step that is a thousandth of the distance.
        step = 1e-3 * np.linalg.norm(points - view.origin, axis=1)
        beside = points + step[:, None] * view.world_from_camera[:3, 0]
        pixels = np.linalg.norm(view.project(beside)[:, :2] - x[:, :2], axis=1)
        apart = camera.project(beside)[:, :2] - camera.project(points)[:, :2]
        texels = camera.resolution * np.linalg.norm(apart, axis=1)
        best = np.maximum(best, np.where(held((camera,), points), texels / pixels, 0.0))
    # A hundredth for the step, which ends a little off the hole.
    assert best.min() > 0.99 * texels_per_pixel


def test_a_large_soft_view_gets_fewer_texels_for_a_pixel() -> None:
    few = {}
    for width in (320, 1920):
        view = a_view(0.9, (width, width * 9 // 16))
        # As many wanted pixels as all of them, of which a few places tell the pictures.
        count = view.width * view.height
        some = seen_by(view)[:: max(width // 64, 1), :: max(width // 64, 1)].reshape(-1, 3)
        seen = np.resize(some, (count, 3))
        points = HolePoints(seen, np.zeros(count, dtype=bool), np.ones(count, dtype=bool))
        few[width] = texels_of(hole_cameras(view, points)) / count
    assert few[320] > SHARP_TEXELS_PER_PIXEL**2
    assert TEXELS_PER_PIXEL**2 < few[1920] < few[320]


def texels_of(found: HoleCameras) -> int:
    return sum(camera.resolution**2 for camera in found.cameras)


def test_a_cache_keeps_the_pictures_of_a_view_together() -> None:
    assert MOST_PICTURES < MOST_KEPT
    # The most of the scenes of docs/caching.md.
    assert MOST_TEXELS * 8.1 < MOST_BYTES


# Picture size, field of view in degrees, every which pixel is asked.
LARGE = {
    "1080p": ((1920, 1080), 50.0, 16),
    "1080p, wide": ((1920, 1080), 90.0, 16),
    "4k, wide": ((3840, 2160), 90.0, 60),
    "very wide": ((640, 480), 150.0, 2),
    "nearly flat": ((640, 480), 170.0, 2),
}


@pytest.mark.parametrize("name", LARGE)
@pytest.mark.parametrize("what", ["holes", "soft", "scattered holes"])
def test_a_view_has_no_more_pictures_and_texels_than_it_may(name: str, what: str) -> None:
    size, degrees, every = LARGE[name]
    view = a_view(np.radians(degrees), size)
    seen = seen_by(view, every=every)
    none = np.zeros(len(seen), dtype=bool)
    lacks = np.random.default_rng(3).random(len(seen)) < (0.005 if "scattered" in what else 1.0)
    points = HolePoints(seen, none, lacks) if what == "soft" else HolePoints(seen, lacks)
    found = hole_cameras(view, points)
    assert len(found.cameras) <= MOST_PICTURES
    assert texels_of(found) <= MOST_TEXELS
    missed = 1.0 - float(held(found.cameras, seen[lacks]).mean())
    # What one picture is left out for, another may show.
    assert missed <= found.left
    assert ("stays as it is" in found.note) == (found.left > 0.0)
    assert (found.left > 0.0) <= (name in {"4k, wide", "very wide", "nearly flat"})
    assert ("texels along" in found.note) == (found.texels < 1.0)
    if what == "soft":
        assert found.texels >= 1.0


def test_what_lacks_most_is_served_first() -> None:
    """Where a view may not have pictures of all: here of few holes in a corner of a large view."""
    view = a_view(np.radians(170.0), (640, 480))
    is_hole = np.random.default_rng(3).random((480, 640)) < 0.001
    is_hole[200:280, 280:360] = True
    points = HolePoints(seen_by(view).reshape(-1, 3), is_hole.ravel())
    found = hole_cameras(view, points)
    assert 0.0 < found.left < 0.05
    middle = np.zeros_like(is_hole)
    middle[200:280, 280:360] = True
    assert held(found.cameras, seen_by(view)[middle]).all()


def test_where_nothing_is_soft_holes_are_baked_as_ever() -> None:
    view = a_view()
    is_hole = np.random.default_rng(3).random((view.height, view.width)) < 0.01
    alone, with_none = cameras_of(view, is_hole), cameras_of(view, is_hole, np.zeros_like(is_hole))
    assert [c.to_json() for c in with_none] == [c.to_json() for c in alone]
    assert cameras_of(view, np.zeros_like(is_hole), np.zeros_like(is_hole)) == ()


def test_holes_beside_what_is_soft_are_in_pictures_too() -> None:
    view = a_view()
    is_hole, is_soft = np.zeros((2, view.height, view.width), dtype=bool)
    is_hole[5, 5] = is_soft[-5, -5] = True
    points = seen_by(view)[is_hole | is_soft]
    assert held(cameras_of(view, is_hole, is_soft), points).all()


def test_pictures_look_from_the_eye() -> None:
    view = a_view()
    for camera in cameras_of(view, np.ones((view.height, view.width), dtype=bool)):
        assert np.array_equal(camera.origin, view.origin)
        assert camera.near == pytest.approx(0.01, rel=2e-3)


def test_a_parallel_view_is_seen_nearly_parallel() -> None:
    view = parallel()
    is_hole = np.ones((view.height, view.width), dtype=bool)
    for camera in cameras_of(view, is_hole):
        way = seen_by(view).reshape(-1, 3) - camera.origin
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        lean = np.degrees(np.arccos(np.clip(way @ -view.world_from_camera[:3, 2], -1.0, 1.0)))
        assert lean.max() < 1.0
        # What the view's own near clip cuts away is cut away here.
        eye_depth = (view.origin - camera.origin) @ -camera.world_from_camera[:3, 2]
        # The camera leans by half a 64th at most, of a clip plane 64 times as far as it is wide.
        assert camera.near == pytest.approx(eye_depth + 0.5, abs=0.05)


def test_holes_apart_get_pictures_of_their_own() -> None:
    view = a_view(1.2, (1600, 900))
    is_hole = np.zeros((900, 1600), dtype=bool)
    is_hole[20:60, 30:80] = is_hole[830:860, 1500:1560] = True
    cameras = cameras_of(view, is_hole)
    assert len(cameras) == 2
    assert max(camera.resolution for camera in cameras) < 200
    whole = cameras_of(view, np.ones_like(is_hole))
    assert max(camera.resolution for camera in whole) <= RESOLUTIONS[-1]
    assert len(whole) > 1


def test_without_holes_there_is_no_camera() -> None:
    view = a_view()
    assert cameras_of(view, np.zeros((view.height, view.width), dtype=bool)) == ()
