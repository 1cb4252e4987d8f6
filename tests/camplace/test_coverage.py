# SPDX-License-Identifier: GPL-3.0-or-later
"""What counts as covered, and how finely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.aim import look
from addon.camplace.camera import CachingCamera
from addon.camplace.coverage import (
    LEAST_COSINE,
    Seen,
    gain,
    joined,
    largest_singular_value,
    score,
    seen_by_camera,
    texel_size,
    visible_from,
)
from addon.camplace.rays import RayCaster
from addon.camplace.samples import Samples
from addon.camplace.view_samples import pixel_gradient, sample_view
from tests.synthetic import box, geometry_of, looking_at, perspective_view

UP = np.array([0.0, 0.0, 1.0])


def _camera(place: list[float], forward: list[float], fov: float, resolution: int) -> CachingCamera:
    return CachingCamera(
        id=0,
        world_from_camera=look(np.array(place), np.array(forward), UP),
        fov=fov,
        near=0.1,
        far=100.0,
        resolution=resolution,
        kind="PERSPECTIVE",
        source=0,
    )


def _wall(point: np.ndarray, pixels: np.ndarray | None = None) -> Samples:
    """Samples that look down -Y."""
    count = len(point)
    if pixels is None:
        pixels = np.tile([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], (count, 1, 1))
    return Samples(
        point=point,
        normal=np.tile([0.0, -1.0, 0.0], (count, 1)),
        weight=np.full(count, 1.0 / count),
        pixels=pixels,
        triangle=np.zeros(count, dtype=np.int64),
        from_view=np.ones(count, dtype=np.bool_),
    )


def test_a_camera_in_the_views_place_with_its_density_has_texels_of_one_pixel() -> None:
    geometry = geometry_of([box((0, 0, 0), 4.0)])
    view = perspective_view(looking_at((0.3, -1.0, 0.2), (0.1, 1.0, 0.0)), 400, 400, 1.0)
    samples = sample_view(view, geometry, RayCaster(geometry), 500, np.random.default_rng(0))
    camera = replace(
        _camera([0, 0, 0], [0, 1, 0], 1.0, 400), world_from_camera=view.world_from_camera
    )
    everything = np.arange(len(samples))
    # Rounding only: both Jacobians come from the same positions.
    np.testing.assert_allclose(texel_size(camera, samples, everything), 1.0, rtol=1e-6)
    finer = replace(camera, resolution=800)
    np.testing.assert_allclose(texel_size(finer, samples, everything), 0.5, rtol=1e-6)


def test_texel_size_of_a_wall_faced_squarely() -> None:
    """A texel at distance d is 2 d tan(fov / 2) / resolution wide; here pixels are 1 / 100."""
    wall = _wall(np.array([[0.0, 5.0, 0.0]]), 100.0 * np.array([[[1.0, 0, 0], [0, 0, 1.0]]]))
    camera = _camera([0, 0, 0], [0, 1, 0], 0.5 * np.pi, 500)
    expected = 2.0 * 5.0 / 500 * 100.0
    np.testing.assert_allclose(texel_size(camera, wall, np.array([0])), expected, rtol=1e-12)


def test_a_slanted_look_stretches_texels_by_the_cosine() -> None:
    wall = _wall(np.array([[0.0, 0.0, 0.0]]))
    straight = _camera([0, -5, 0], [0, 1, 0], 0.5, 256)
    angle = np.radians(60.0)
    slanted = _camera(
        [-5 * np.sin(angle), -5 * np.cos(angle), 0], [np.sin(angle), np.cos(angle), 0], 0.5, 256
    )
    ratio = texel_size(slanted, wall, np.array([0])) / texel_size(straight, wall, np.array([0]))
    np.testing.assert_allclose(ratio, 2.0, rtol=1e-12)


def test_pixel_gradient_against_finite_differences() -> None:
    view = perspective_view(looking_at((3.0, -4.0, 2.0), (0.0, 0.0, 0.0)), 640, 480, 0.9)
    point = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    gradient = pixel_gradient(view, point)
    step = 1e-5
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        moved = (view.project(point + shift) - view.project(point - shift))[:, :2] / (2 * step)
        # Central differences are off by step^2 times the third derivative.
        np.testing.assert_allclose(gradient[:, :, axis], moved, rtol=1e-5, atol=1e-4)


def test_frustum() -> None:
    edge = 5.0 * np.tan(0.3)
    wall = _wall(np.array([[0.99 * edge, 5, 0.99 * edge], [1.01 * edge, 5, 0], [0, -5, 0]]))
    seen = seen_by_camera(_camera([0, 0, 0], [0, 1, 0], 0.6, 256), wall, np.arange(3))
    assert seen.index.tolist() == [0]


def test_only_the_facing_side_at_a_usable_angle_is_covered() -> None:
    sheet = np.array([[-5.0, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5]])
    geometry = geometry_of([(sheet, np.array([[0, 1, 2], [0, 2, 3]]))])
    rays = RayCaster(geometry)
    wall = _wall(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]]))
    lift = rays.lift(wall.point, wall.triangle)
    both = np.arange(2)
    assert visible_from(np.array([0.0, -3.0, 0.0]), wall, lift, rays, both).tolist() == [0, 1]
    assert visible_from(np.array([0.0, 3.0, 0.0]), wall, lift, rays, both).size == 0
    angle = np.arccos(LEAST_COSINE)
    for turned, expected in ((angle - 0.01, 1), (angle + 0.01, 0)):
        place = 3.0 * np.array([np.sin(turned), -np.cos(turned), 0.0])
        assert visible_from(place, wall, lift, rays, np.array([0])).size == expected


def test_what_stands_between_hides() -> None:
    geometry = geometry_of([box((0, -2, 0), 1.0)])
    rays = RayCaster(geometry)
    wall = _wall(np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]))
    seen = visible_from(np.array([0.0, -5.0, 0.0]), wall, np.full(2, 1e-5), rays, np.arange(2))
    assert seen.tolist() == [1]


def test_largest_singular_value() -> None:
    m = np.random.default_rng(2).normal(size=(300, 2, 2))
    np.testing.assert_allclose(
        largest_singular_value(m), np.linalg.svd(m, compute_uv=False)[:, 0], rtol=1e-10
    )


def test_gain_is_what_the_score_rises_by() -> None:
    weight = np.array([0.5, 0.3, 0.2])
    quality = np.array([0.0, 0.4, 1.0])
    seen = Seen(np.array([0, 1, 2]), np.array([2.0, 1.0, 4.0]))
    after = joined(quality, seen)
    np.testing.assert_allclose(after, [0.5, 1.0, 1.0])
    assert gain(seen, quality, weight) == pytest.approx(weight @ (score(after) - score(quality)))
    # Filling a hole however coarsely is worth more than sharpening anything.
    assert score(np.array([1e-6]))[0] > 1.0 - score(np.array([1e-6]))[0]
