# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges are found where surfaces end or fold, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from tools import edges

WIDTH, HEIGHT, PIXEL = 96, 72, 0.01  # a pixel is 10 mm wide at 1 m


def plane_depth(normal: tuple[float, float, float], distance: float) -> np.ndarray:
    """Depth along the view axis of the plane n · p = -distance, at the pixel centres.

    The camera looks down -Z, so the point of pixel (x, y) is depth · (x, y, -1).
    """
    x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) * PIXEL
    y = (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) * PIXEL
    grid_x, grid_y = np.meshgrid(x, y)
    return (distance / (normal[2] - normal[0] * grid_x - normal[1] * grid_y)).astype(np.float32)


def objects(value: float = 1.0) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), value, dtype=np.float32)


@pytest.mark.parametrize("tilt", [0.0, 0.8, 1.05])
def test_a_plane_has_no_edge_however_slanted(tilt: float) -> None:
    depth = plane_depth((np.sin(tilt), 0.0, np.cos(tilt)), 3.0)
    assert (depth > 0).all()
    assert not edges.surface_edges(depth, objects(), PIXEL).any()


def test_a_fold_is_an_edge_and_its_band_is_as_wide_as_the_radius() -> None:
    left = plane_depth((0.7, 0.0, 0.71), 3.0)
    right = plane_depth((-0.7, 0.0, 0.71), 3.0)
    found = edges.surface_edges(np.maximum(left, right), objects(), PIXEL)
    columns = np.flatnonzero(found.any(axis=0))
    middle = WIDTH / 2 - 0.5  # the fold is between two columns, and both bend
    assert columns.min() == middle - 0.5 - edges.RADIUS
    assert columns.max() == middle + 0.5 + edges.RADIUS


def test_a_gentle_fold_is_no_edge() -> None:
    left = plane_depth((0.1, 0.0, 0.995), 3.0)
    right = plane_depth((-0.1, 0.0, 0.995), 3.0)
    assert not edges.surface_edges(np.maximum(left, right), objects(), PIXEL).any()


def test_what_is_an_edge_does_not_depend_on_the_scenes_size() -> None:
    depth = np.maximum(plane_depth((0.7, 0, 0.71), 3.0), plane_depth((-0.7, 0, 0.71), 3.0))
    depth[40:, 60:] = 5.0
    small, large = (edges.surface_edges(depth * s, objects(), PIXEL) for s in (1e-3, 1e3))
    np.testing.assert_array_equal(small, large)


def test_the_background_and_other_objects_end_a_surface() -> None:
    depth, ids = np.full((HEIGHT, WIDTH), 2.0, dtype=np.float32), objects()
    depth[:, :20] = 0.0
    ids[:, 70:] = 2.0
    found = edges.surface_edges(depth, ids, PIXEL)
    expected = np.zeros(WIDTH, dtype=bool)
    expected[20 - 1 - edges.RADIUS : 20 + 1 + edges.RADIUS] = True
    expected[70 - 1 - edges.RADIUS : 70 + 1 + edges.RADIUS] = True
    np.testing.assert_array_equal(found, np.broadcast_to(expected, found.shape))


def test_without_perspective_depth_itself_is_what_bends() -> None:
    slanted = np.broadcast_to(np.linspace(1.0, 9.0, WIDTH, dtype=np.float32), (HEIGHT, WIDTH))
    assert not edges.surface_edges(slanted, objects(), PIXEL, perspective=False).any()
    folded = 3.0 + PIXEL * np.abs(np.arange(WIDTH) - 48.0)
    depth = np.broadcast_to(folded.astype(np.float32), (HEIGHT, WIDTH))
    found = edges.surface_edges(depth, objects(), PIXEL, perspective=False)
    assert np.flatnonzero(found.any(axis=0)).tolist() == list(range(46, 51))


def test_luma_edges_ignore_soft_shading() -> None:
    ramp = np.broadcast_to(np.linspace(0.1, 0.9, WIDTH)[:, None], (HEIGHT, WIDTH, 3)).copy()
    assert not edges.luma_edges(ramp).any()
    ramp[:, 50:] *= 0.5
    columns = np.flatnonzero(edges.luma_edges(ramp).any(axis=0))
    assert columns.tolist() == list(range(49 - edges.RADIUS, 51 + edges.RADIUS))


def test_dilation_grows_a_pixel_into_a_square() -> None:
    mask = np.zeros((9, 9), dtype=bool)
    mask[4, 5] = True
    grown = edges.dilate(mask, 2)
    assert grown.sum() == 25
    assert grown[2:7, 3:8].all()
