# SPDX-License-Identifier: GPL-3.0-or-later
"""What counts as covered, and how finely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.aim import look
from addon.camplace.camera import CachingCamera
from addon.camplace.coverage import (
    GLANCING,
    LEAST_COSINE,
    SEEN,
    WELL,
    WELL_TEXEL,
    Seen,
    gain,
    joined,
    largest_singular_value,
    seen_by_camera,
    texel_size,
    visible_from,
    visible_from_each,
    well_seen_by,
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


def test_a_surface_seen_edge_on_has_endless_texels() -> None:
    wall = _wall(np.array([[2.0, 0.0, 0.0], [2.0, 1.0, 0.5]]))
    camera = _camera([0, 0, 0], [1, 0, 0], 0.5 * np.pi, 512)
    with np.errstate(all="raise"):
        texel = texel_size(camera, wall, np.arange(2))
    assert texel[0] == np.inf
    assert np.isfinite(texel[1])
    seen = seen_by_camera(camera, wall, np.arange(2))
    assert seen.worth[0] == GLANCING * SEEN
    assert np.isfinite(gain(seen, np.zeros(2), wall.weight))


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


def _sheet() -> RayCaster:
    """A square in the plane y = 0, ten across."""
    corners = np.array([[-5.0, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5]])
    return RayCaster(geometry_of([(corners, np.array([[0, 1, 2], [0, 2, 3]]))]))


def test_only_the_facing_side_is_seen() -> None:
    rays = _sheet()
    wall = _wall(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]]))
    lift = rays.lift(wall.point, wall.triangle)
    both = np.arange(2)
    assert visible_from(np.array([0.0, -3.0, 0.0]), wall, lift, rays, both).tolist() == [0, 1]
    assert visible_from(np.array([0.0, 3.0, 0.0]), wall, lift, rays, both).size == 0


@pytest.mark.parametrize(("beyond", "usable"), [(-0.01, True), (0.01, False)])
def test_a_glancing_look_is_no_hole_but_not_well_seen(beyond: float, *, usable: bool) -> None:
    rays = _sheet()
    wall = _wall(np.array([[0.0, 0.0, 0.0]]))
    lift = rays.lift(wall.point, wall.triangle)
    turned = np.arccos(LEAST_COSINE) + beyond
    place = 3.0 * np.array([np.sin(turned), -np.cos(turned), 0.0])
    camera = _camera(place.tolist(), (-place).tolist(), 0.5, 2048)
    index = visible_from(place, wall, lift, rays, np.array([0]))
    assert index.tolist() == [0]
    seen = seen_by_camera(camera, wall, index)
    assert seen.usable.tolist() == [usable]
    # A texel is far smaller than a pixel here (one unit), so only the angle matters.
    np.testing.assert_allclose(seen.worth, 1.0 if usable else GLANCING)
    assert (well_seen_by(camera, wall, index).size > 0) == usable


def test_several_places_see_what_each_sees_alone() -> None:
    geometry = geometry_of([box((0, -2, 0), 1.0), box((0.5, -3, 2), 1.0)])
    rays = RayCaster(geometry)
    rng = np.random.default_rng(3)
    wall = _wall(np.stack([rng.uniform(-4, 4, 200), np.zeros(200), rng.uniform(-4, 4, 200)], -1))
    lift = rays.lift(wall.point, np.zeros(200, dtype=np.int64))
    wanted = np.flatnonzero(rng.random(200) < 0.6)
    places = np.concatenate([rng.uniform(-5, 5, (7, 3)), [[0.0, 9.0, 0.0]]])
    together = visible_from_each(places, wall, lift, rays, wanted)
    assert len(together) == len(places)
    for place, seen in zip(places, together, strict=True):
        np.testing.assert_array_equal(seen, visible_from(place, wall, lift, rays, wanted))
    assert 0 < sum(len(seen) for seen in together) < len(places) * len(wanted)
    assert together[-1].size == 0  # behind the wall


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


def test_gain_is_what_the_mean_worth_rises_by() -> None:
    weight = np.array([0.5, 0.2, 0.2, 0.1])
    worth = np.array([0.0, 0.94, 1.0, 0.0])
    texel = np.array([2.0, 1.0, 4.0, 0.5])
    seen = Seen(np.arange(4), texel, np.array([True, True, True, False]))
    after = joined(worth, seen)
    np.testing.assert_allclose(after, [WELL, 1.0, 1.0, GLANCING])
    assert gain(seen, worth, weight) == pytest.approx(weight @ (after - worth))


def test_holes_count_most_then_glancing_looks_then_blur() -> None:
    coarse, glancing = Seen(np.arange(2), np.array([1e6, 1.0]), np.array([True, False])).worth
    assert coarse == pytest.approx(SEEN, abs=1e-6)
    assert 0.0 < 1.0 - coarse < 1.0 - glancing < coarse
    edge = Seen(np.arange(2), WELL_TEXEL * np.array([1.0, 1.001]), np.ones(2, dtype=np.bool_))
    assert (edge.worth >= WELL).tolist() == [True, False]
