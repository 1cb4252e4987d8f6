# SPDX-License-Identifier: GPL-3.0-or-later
"""Where samples fall, and which surface rays meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.area_samples import sample_area
from addon.camplace.rays import RayCaster
from addon.camplace.samples import tangent_basis
from addon.camplace.view_samples import sample_view, side_seen
from addon.scene.geometry import Cutout, SceneGeometry
from addon.scene.view import View
from tests.synthetic import box, geometry_of, looking_at, perspective_view

SHEET = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def _sheets(*sheets: np.ndarray) -> SceneGeometry:
    return geometry_of([(sheet, SHEET) for sheet in sheets])


def test_equation_2_shares_points_by_weight_and_area() -> None:
    geometry = _sheets(SQUARE, SQUARE * 3 + (5, 0, 0), np.add(SQUARE, (0, 5, 0)))
    weight = np.array([1.0, 1.0, 0.5, 0.5, 0.0, 0.0])
    bounds = geometry.bounds + np.array([[-1e-6], [1e-6]])
    point, triangle = sample_area(geometry, weight, bounds, 1100, np.random.default_rng(0))
    share = weight * geometry.area / (weight @ geometry.area)
    assert len(point) == 1100
    # A systematic draw gives each triangle its share up to one point; thinning the spare
    # points out evenly is off by one more.
    np.testing.assert_allclose(np.bincount(triangle, minlength=6), 1100 * share, atol=2.0)


def test_points_are_uniform_on_a_triangle() -> None:
    geometry = replace(_sheets(SQUARE), triangles=np.array([[0, 1, 3]], dtype=np.int32))
    bounds = np.array([[-1.0] * 3, [2.0] * 3])
    point, _ = sample_area(geometry, np.ones(1), bounds, 20000, np.random.default_rng(1))
    # The centroid is (1/3, 1/3) and x varies by 1/18; five standard errors.
    np.testing.assert_allclose(point[:, :2].mean(axis=0), 1 / 3, atol=5 / np.sqrt(18 * 20000))
    assert (point[:, :2].sum(axis=-1) <= 1.0 + 1e-12).all()


def test_a_ground_far_larger_than_the_box_does_not_use_up_the_points() -> None:
    geometry = _sheets((SQUARE - 0.5) * [1e6, 1e6, 0], np.add(SQUARE, (0, 0, 1)))
    bounds = np.array([[-1.0, -1, -1], [1.5, 1.5, 2]])
    point, triangle = sample_area(geometry, np.ones(4), bounds, 1000, np.random.default_rng(2))
    assert len(point) > 900
    assert ((point >= bounds[0]) & (point <= bounds[1])).all()
    on_ground = (triangle < 2).mean()
    # 6.25 square metres of ground and 1 of the sheet; pieces that stick out cost some points.
    assert on_ground == pytest.approx(6.25 / 7.25, abs=0.02)


def test_an_empty_box_gives_no_points() -> None:
    bounds = np.array([[10.0] * 3, [11.0] * 3])
    point, triangle = sample_area(_sheets(SQUARE), np.ones(2), bounds, 9, np.random.default_rng())
    assert point.shape == (0, 3)
    assert triangle.shape == (0,)


def test_view_samples_lie_on_what_is_seen_and_face_the_view() -> None:
    geometry = geometry_of([box((0, 0, 0), 6.0), box((0, 0, 0), 1.0)])
    view = perspective_view(looking_at((2.5, -2.0, 1.0), (0, 0, 0)), 320, 200, 1.1)
    samples = sample_view(view, geometry, RayCaster(geometry), 1000, np.random.default_rng(3))
    assert len(samples) == pytest.approx(1000, rel=0.1)
    outer = np.abs(samples.point).max(axis=-1) > 2.0
    size = np.abs(samples.point).max(axis=-1)
    np.testing.assert_allclose(size, np.where(outer, 3.0, 0.5), rtol=1e-6)
    assert 0.05 < (~outer).mean() < 0.6
    towards = view.origin - samples.point
    assert (np.einsum("sx,sx->s", towards, samples.normal) > 0.0).all()
    x, y = view.project(samples.point)[:, :2].T
    # One sample in each cell of the raster, so both halves of the picture have as many.
    assert (x < 160).mean() == pytest.approx(0.5, abs=0.02)
    assert (y < 100).mean() == pytest.approx(0.5, abs=0.02)


def test_clips_of_the_view_are_kept() -> None:
    geometry = _sheets(*((SQUARE - [0.5, 0.5, 0]) * 100 + (0, 0, z) for z in (-1.0, -3.0, -9.0)))
    view = perspective_view(np.eye(4), 100, 100, 0.5, near=2.0, far=5.0)
    rays = RayCaster(geometry)
    samples = sample_view(view, geometry, rays, 100, np.random.default_rng(0))
    np.testing.assert_allclose(samples.point[:, 2], -3.0)
    beyond = perspective_view(np.eye(4), 100, 100, 0.5, near=4.0, far=5.0)
    assert len(sample_view(beyond, geometry, rays, 100, np.random.default_rng(0))) == 0


@pytest.mark.parametrize("perspective", [True, False])
def test_the_side_that_a_view_sees(perspective: bool) -> None:
    geometry = _sheets((SQUARE - 0.5) * [4, 4, 0], SQUARE * 0.5 + (0.5, 0.5, 1))
    view = perspective_view(looking_at((0, 0, 3), (0, 0, 0), (0, 1, 0)), 100, 100, 1.2)
    if not perspective:
        clip = np.diag([0.5, 0.5, -2.0 / 9.9, 1.0])
        clip[2, 3] = -10.1 / 9.9
        view = View(view.world_from_camera, clip, 100, 100, perspective=False)
    rays = RayCaster(geometry)
    samples = sample_view(view, geometry, rays, 400, np.random.default_rng(1))
    turned = replace(samples, normal=samples.normal * [[1, 1, -1]])
    lift = rays.lift(samples.point, samples.triangle)
    assert (side_seen(view, samples, rays, lift) == 1).all()
    assert (side_seen(view, turned, rays, lift) == -1).all()
    hidden = replace(samples, point=samples.point * 0 + (0.7, 0.7, 0.0))
    if not perspective:  # straight below the smaller sheet
        assert (side_seen(view, hidden, rays, lift) == 0).all()


def test_tangents_are_orthonormal_to_the_normal_everywhere() -> None:
    normal = np.random.default_rng(4).normal(size=(1000, 3))
    normal[:6] = np.array(
        [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0, 1, -0.0], [1e-9, 0, -1]]
    )
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    frame = np.concatenate([tangent_basis(normal), normal[..., None]], axis=-1)
    product = np.swapaxes(frame, -1, -2) @ frame
    np.testing.assert_allclose(product, np.tile(np.eye(3), (1000, 1, 1)), atol=1e-12)


def test_rays_pass_where_a_cutout_is_cut_away() -> None:
    """The left half of the upper sheet is cut away; below it lies a whole sheet."""
    geometry = _sheets(np.add(SQUARE, (0, 0, 1)), SQUARE)
    corner = SQUARE[:, :2].astype(np.float32)
    cutout = Cutout(0, np.array([[0.0, 1.0]], dtype=np.float32), "EXTEND")
    geometry = replace(geometry, uv=corner[np.tile(SHEET, (2, 1))], cutouts=(cutout,))
    rays = RayCaster(geometry)
    x = np.array([0.1, 0.4, 0.6, 0.9])
    origins = np.stack([x, np.full(4, 0.5), np.full(4, 2.0)], axis=-1)
    down = np.tile([0.0, 0.0, -1.0], (4, 1))
    np.testing.assert_allclose(rays.first_hit(origins, down).distance, [2, 2, 1, 1], rtol=1e-5)
    assert rays.occluded(origins, origins - [0, 0, 1.5]).tolist() == [False, False, True, True]
    assert rays.occluded(origins, origins - [0, 0, 2.5]).all()
    np.testing.assert_allclose(rays.first_triangle(origins, down).distance, 1.0, rtol=1e-5)


def test_what_cameras_do_not_see_hides_nothing() -> None:
    geometry = _sheets(np.add(SQUARE, (0, 0, 1)), SQUARE)
    visible = np.array([False, False, True, True])
    rays = RayCaster(replace(geometry, camera_visible=visible))
    hits = rays.first_hit(np.array([[0.3, 0.4, 2.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert hits.distance[0] == pytest.approx(2.0)
    assert hits.triangle[0] in (2, 3)
