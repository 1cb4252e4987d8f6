# SPDX-License-Identifier: GPL-3.0-or-later
"""By how much normals turn within a part of a pixel, on the GPU beside its twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.pixel_bend import DEVIATION
from tests import synthetic
from tests.corrmap.test_correspondence import Setup, make_setup, pixel_centres
from tests.corrmap.test_shading_normals import bent, sure
from tests.reference.normal_bend import bend_covariance
from tests.reference.shading_normal import shading_normals


@pytest.fixture(scope="module")
def setup() -> Setup:
    made = make_setup(size=(64, 48))
    return replace(made, geometry=bent(made.geometry))


def seen(
    setup: Setup, step: int = 1
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """(N,) triangles, (N, 3) places and unit vectors from there to the viewer, of some pixels."""
    origins, rays = setup.view.rays(pixel_centres(setup.view)[::step])
    triangle, point = synthetic.Tracer(setup.geometry).hit(origins, rays)
    return triangle, point, -rays / np.linalg.norm(rays, axis=1, keepdims=True)


def pixel_width(setup: Setup, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) metres of a pixel in the picture's middle, at the places' distance."""
    view = setup.view
    width = 2.0 / (view.clip_from_camera[0, 0] * view.width)
    return np.asarray(width * np.linalg.norm(point - view.origin, axis=1))


@pytest.mark.parametrize("samples", [1, 16])
def test_normals_turn_as_the_twin_says(gpu_context: None, setup: Setup, samples: int) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.normal_bend import NormalBendPass
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    buffer = GeometryBuffer(setup.geometry, setup.view.origin)
    visible = VisibleSurfacePass(buffer).draw(setup.view)
    drawn = read_texture(NormalBendPass(buffer).of(visible).texture(samples)).reshape(-1, 4)
    triangle, point, toward = seen(setup)
    deviation = DEVIATION / np.sqrt(samples) * pixel_width(setup, point)
    want = bend_covariance(setup.geometry, triangle, point, toward, deviation)
    inside = sure(setup)
    d = drawn[:, :3].astype(np.float64)
    size = np.linalg.norm(d, axis=1, keepdims=True)
    N = shading_normals(setup.geometry, triangle, point)
    e = drawn[:, 3:] * np.cross(N, d / np.maximum(size, 1e-30))
    got = d[:, :, None] * d[:, None] + e[:, :, None] * e[:, None]
    scale = np.trace(want, axis1=1, axis2=2)
    # A smaller variance is told from a larger one by float32's digits of that; these come of
    # products of rounded numbers, some tens of them.
    error = np.abs(got - want).max(axis=(1, 2))
    assert (error[inside] < 1e-5 * scale[inside]).mean() > 0.995
    assert scale[inside].min() > 0.0


def test_a_small_part_turns_as_its_places_do(setup: Setup) -> None:
    """The covariance of very many normals about a place."""
    triangle, point, toward = seen(setup, 97)
    rng = np.random.default_rng(2)
    deviation = np.full(len(point), 1e-3)
    got = bend_covariance(setup.geometry, triangle, point, toward, deviation)
    n = setup.geometry.normal[triangle]
    side = np.cross(n, toward)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    facing = np.abs((n * toward).sum(axis=1))
    along = np.cross(side, n) / np.maximum(facing, 0.05)[:, None]
    g = rng.normal(size=(2, 4000, 1, 1)) * 1e-3
    places = point + g[0] * side + g[1] * along
    normals = np.stack([shading_normals(setup.geometry, triangle, each) for each in places])
    normals -= normals.mean(axis=0)
    want = np.einsum("kni,knj->nij", normals, normals) / len(normals)
    # 4000 draws know a variance to 2 %; three times that.
    scale = np.trace(want, axis1=1, axis2=2)[:, None, None]
    np.testing.assert_allclose(got / scale, want / scale, atol=0.07)


def test_no_more_than_a_triangle_is_seen(setup: Setup) -> None:
    """A part that is far larger has the variance of all of the triangle."""
    triangle, point, toward = seen(setup, 97)
    far = np.full(len(point), 1e6)
    got = bend_covariance(setup.geometry, triangle, point, toward, far)
    near = bend_covariance(setup.geometry, triangle, point, toward, 1e-4 * far)
    np.testing.assert_allclose(got, near, rtol=0.01, atol=1e-6)
