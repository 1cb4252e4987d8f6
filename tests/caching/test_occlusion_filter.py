# SPDX-License-Identifier: GPL-3.0-or-later
"""The occlusion filter takes noise from surfaces, and nothing over their edges."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.occlusion_filter import REACH, smooth_occlusion, without_edge_hits
from addon.camplace.camera import CachingCamera

from ..synthetic import Tracer, box, geometry_of, looking_at, trace_framebuffer
from .material_grid import add_plane, bake, camera_above, empty_scene

SIZE = 128


def camera(target: tuple[float, float, float], up: tuple[float, float, float]) -> CachingCamera:
    return CachingCamera(
        0, looking_at((0.3, 0.2, 0.1), target, up), 0.5 * np.pi, 0.01, 100.0, SIZE, "CUBE_FACE", 0
    )


@pytest.fixture
def corner() -> tuple[CachingCamera, dict[str, NDArray[np.float32]]]:
    """What a camera in a room sees of a corner of it, and of a cube before it."""
    geometry = geometry_of([box((0, 0, 0), 4.0), box((1.2, 0.9, -0.6), 0.5)])
    view = camera((2.0, 1.5, -1.0), (0, 0, 1))
    framebuffer = trace_framebuffer(geometry, Tracer(geometry), view, np.zeros_like)
    return view, framebuffer.channels


def test_noise_of_four_rays_becomes_small(
    corner: tuple[CachingCamera, dict[str, NDArray[np.float32]]],
) -> None:
    view, channels = corner
    rays = np.random.default_rng(4).random((SIZE, SIZE, 4)) < 0.5
    noisy = rays.mean(axis=-1, keepdims=True).astype(np.float32)
    smooth = smooth_occlusion(view, noisy, channels["depth"], channels["normal"], 4)
    assert smooth.shape == noisy.shape
    assert smooth.dtype == np.float32
    # The mean stays: 65536 rays of deviation 1/2 give 0.002; 4 of them.
    assert abs(smooth.mean() - 0.5) < 0.008
    # A plane shares the rays of 260 texels, deviation 0.25 / sqrt(260) = 0.016; those at edges
    # and at the picture's rim share fewer.
    assert smooth.std() < 0.03
    assert noisy.std() > 0.24


def test_each_face_keeps_its_own_value(
    corner: tuple[CachingCamera, dict[str, NDArray[np.float32]]],
) -> None:
    """A value for each direction of normal and each object, so that a leak would show."""
    view, channels = corner
    normal, ids = channels["normal"], channels["material_id"]
    value = (0.5 + normal @ np.array([0.1, 0.2, 0.05]) + 0.1 * (ids[..., 0] - 1.5))[..., None]
    value = value.astype(np.float32)
    assert len(np.unique(value.round(3))) >= 5
    smooth = smooth_occlusion(view, value, channels["depth"], channels["normal"], 4)
    # Where a face of the cube lies parallel before a wall, a texel's rounding; nothing else.
    assert np.abs(smooth - value).max() < 1e-5


def plane(size: int) -> tuple[CachingCamera, NDArray[np.float32], NDArray[np.float32]]:
    """A camera before a wall, with depth and normals of so many texels squared."""
    view = replace(camera((0.3, 0.2, -9.0), (0, 1, 0)), resolution=size)
    depth = np.full((size, size, 1), 2.0, dtype=np.float32)
    normal = np.zeros((size, size, 3), dtype=np.float32)
    normal[..., 2] = 1.0
    return view, depth, normal


def test_a_slope_is_not_bent() -> None:
    """A symmetric filter leaves what changes linearly over a plane as it is."""
    view, depth, normal = plane(2 * SIZE)
    along = np.linspace(0.3, 0.7, 2 * SIZE)[None, :, None]
    slope = np.broadcast_to(along, (2 * SIZE, 2 * SIZE, 1)).astype(np.float32)
    inside = (slice(None), slice(REACH, -REACH))
    # With four rays a texel, what is farther from a half has less noise, and so counts a little
    # less: by a twentieth of the noise that is left, 0.5 / sqrt(4 * 4280).
    smooth = smooth_occlusion(view, slope, depth, normal, 4)
    assert np.abs(smooth - slope)[inside].max() < 2e-4


def test_a_wall_that_little_light_reaches_has_little_noise() -> None:
    """Eight rays, of which one in a hundred meets nothing."""
    view, depth, normal = plane(2 * SIZE)
    rays = np.random.default_rng(5).random((2 * SIZE, 2 * SIZE, 8)) < 0.01
    share = rays.mean(axis=-1, keepdims=True).astype(np.float32)
    smooth = smooth_occlusion(view, share, depth, normal, 8)
    # All of the rays' mean is known to 1.4 %; that of 4280 texels' rays to 5.4 %, and to more where
    # a value is held for another surface's, or at the picture's rim.
    assert abs(smooth.mean() / 0.01 - 1.0) < 0.03
    assert np.sqrt(np.mean((smooth / 0.01 - 1.0) ** 2)) < 0.09


def test_a_shadow_on_a_wall_stays_where_it_is() -> None:
    """Beside what is open, a dark part of the same plane gets none of its light."""
    view, depth, normal = plane(2 * SIZE)
    truth = np.full((2 * SIZE, 2 * SIZE, 1), 0.01)
    truth[:, SIZE:] = 0.9
    rays = np.random.default_rng(6).random((2 * SIZE, 2 * SIZE, 8)) < truth
    share = rays.mean(axis=-1, keepdims=True).astype(np.float32)
    smooth = smooth_occlusion(view, share, depth, normal, 8)
    # The first level knows no noise: two texels on either side of the edge are blurred.
    dark, lit = smooth[:, SIZE - 16 : SIZE - 2].mean(axis=0), smooth[:, SIZE + 2 : SIZE + 16]
    assert dark.max() < 0.02
    assert lit.mean(axis=0).min() > 0.88


@pytest.mark.parametrize("width", [1, 2, 3, 5])
def test_what_is_thin_shares_all_of_its_rays(width: int) -> None:
    """Strips three texels apart: the noise of what they share, not of a wall as wide as the
    filter, says which values may be one."""
    view, depth, normal = plane(2 * SIZE)
    strip = np.arange(2 * SIZE) % (width + 3) < width
    depth[:, ~strip] = 0.0
    rays = np.random.default_rng(7).random((2 * SIZE, 2 * SIZE, 4)) < 0.5
    share = rays.mean(axis=-1, keepdims=True).astype(np.float32) * strip[None, :, None]
    noise = smooth_occlusion(view, share, depth, normal, 4)[:, strip].std()
    # Along one strip by itself the filter has sqrt(4 pi) 18.5 texels' rays in each column.
    assert noise < 1.3 * 0.5 / np.sqrt(4 * width * np.sqrt(4.0 * np.pi) * 18.5)


def test_where_nothing_is_hit_nothing_is_taken() -> None:
    """Half of the picture is empty: neither side reads the other."""
    view, depth, normal = plane(SIZE)
    value = np.full((SIZE, SIZE, 1), 0.25, dtype=np.float32)
    for empty in (depth, normal, value):
        empty[: SIZE // 2] = 0.0
    smooth = smooth_occlusion(view, value, depth, normal, 4)
    assert np.allclose(smooth, value, rtol=1e-6, atol=0.0)


def test_rays_that_began_on_an_edge_leave_no_line(
    corner: tuple[CachingCamera, dict[str, NDArray[np.float32]]],
) -> None:
    """Zeros along a diagonal go; zeros in the dark, and where half is open, stay."""
    view, channels = corner
    depth, normal = channels["depth"], channels["normal"]
    value = np.full((SIZE, SIZE, 1), 0.9, dtype=np.float32)
    edge = value.copy()
    edge[np.arange(SIZE), np.arange(SIZE)] = 0.0
    mended = without_edge_hits(view, edge, depth, normal, 4)
    smooth = [smooth_occlusion(view, v, depth, normal, 4) for v in (value, mended)]
    # A rounding of the mean of six equal numbers.
    assert np.abs(smooth[0] - smooth[1]).max() < 1e-6
    half = np.where(np.random.default_rng(1).random(value.shape) < 0.5, 0.0, 0.7)
    half = half.astype(np.float32)
    assert (without_edge_hits(view, half, depth, normal, 4) == half).all()


@pytest.mark.parametrize(("rays", "share"), [(4, 0.85), (8, 0.6)])
def test_more_rays_tell_edges_where_less_is_open(
    corner: tuple[CachingCamera, dict[str, NDArray[np.float32]]], rays: int, share: float
) -> None:
    view, channels = corner
    depth, normal = channels["depth"], channels["normal"]
    value = np.full((SIZE, SIZE, 1), share, dtype=np.float32)
    edge = value.copy()
    edge[:, SIZE // 2] = 0.0
    mended = without_edge_hits(view, edge, depth, normal, rays)
    assert (mended[:, SIZE // 2] == 0.0).mean() < 0.1
    assert (without_edge_hits(view, edge, depth, normal, rays // 2) == edge).all()


def test_what_is_dark_before_the_sky_stays_dark(
    corner: tuple[CachingCamera, dict[str, NDArray[np.float32]]],
) -> None:
    """A thing's outline has open surfaces beside it that are far behind, or that it stands on."""
    view, channels = corner
    depth, normal = channels["depth"], channels["normal"]
    centre = (np.arange(SIZE) + 0.5) / SIZE
    column, row = np.meshgrid(centre, centre)
    place = view.unproject(np.stack([column, row, depth[..., 0].astype(np.float64)], axis=-1))
    is_cube = (np.abs(place - (1.2, 0.9, -0.6)) < 0.2501).all(axis=-1, keepdims=True)
    assert 0.02 < is_cube.mean() < 0.5
    value = np.where(is_cube, 0.0, 1.0).astype(np.float32)
    assert (without_edge_hits(view, value, depth, normal, 4) == value).all()


def test_cycles_leaves_no_line_on_the_diagonal_of_a_plane(tmp_path: Path) -> None:
    """Texels' centres lie on the edge between the plane's two triangles."""
    scene = empty_scene()
    scene.world = bpy.data.worlds.new("grey")
    add_plane(scene, "plane", (0.0, 0.0, 0.0), bpy.data.materials.new("plain"))
    store, _ = bake(scene, [camera_above((0, 0, 0), 4.0, fov=0.2)], tmp_path)
    framebuffer = store.read_camera(0)
    seen = framebuffer.channels["depth"] > 0.0
    assert "ambient_occlusion" in framebuffer.channels
    assert framebuffer.channels["ambient_occlusion"][seen].min() > 0.999
