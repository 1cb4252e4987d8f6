# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays from all over a pixel: where that can be, and what it makes of shadows' edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.view_looks import PLACES, ViewLooks
from addon.glsl.shader import read_texture
from addon.relight.light_points.light_cells import SPOTS
from addon.relight.light_points.light_sample import light_sample
from addon.relight.shadows.flat_places import flat_steps
from addon.relight.shadows.receivers import Receivers
from addon.relight.shadows.shadow_rays import LIFT
from addon.relight.shadows.traced_shadow import TracedShadow, TracedShadowPass
from addon.scene.view import PixelFilter
from tests import synthetic
from tests.reference.surfaces import surfaces

from .test_shadow import floor_points, light_at, square
from .test_traced_shadow import PLACES as SCENE_PLACES
from .test_traced_shadow import moved, placed

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
SPACING = 2.0**-24


def receivers(place: Array, normal: Array) -> Receivers:
    """Of (H, W, 3) places and normals, all seen."""
    rows = np.ascontiguousarray(place.reshape(-1, 3).T)
    facing = np.broadcast_to(normal, place.shape).reshape(-1, 3).T.astype(np.float32)
    lift = (LIFT * np.abs(rows).max(axis=0)).astype(np.float32)
    return Receivers(rows, facing, lift, np.zeros(rows.shape[1], dtype=np.int32))


def grid(height: int = 12, width: int = 16) -> tuple[Array, Array]:
    row, column = np.indices((height, width)).astype(float)
    return row, column


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_steps_along_a_tilted_plane(scale: float) -> None:
    row, column = grid()
    right, up = np.array([0.1, 0.02, 0.03]) * scale, np.array([-0.01, 0.2, 0.05]) * scale
    place = column[..., None] * right + row[..., None] * up + np.array([3.0, -2.0, 1.0]) * scale
    normal = np.cross(right, up)
    hit = np.ones(row.shape, dtype=np.bool_)
    steps = flat_steps(receivers(place, normal / np.linalg.norm(normal)), hit)
    steps = steps.reshape(2, 3, *row.shape)
    inner = np.zeros_like(hit)
    inner[2:-2, 2:-2] = True
    for step, wanted in zip(steps, (right, up), strict=True):
        assert np.abs(step[:, inner].T - wanted).max() <= 2.0 * SPACING * np.abs(wanted).max()
        # Nobody is known beyond the picture.
        assert not step[:, ~inner].any()


def test_none_beside_a_crease_a_hole_or_the_end_of_a_picture() -> None:
    row, column = grid()
    bent = np.stack([column, row, np.maximum(column - 7.5, 0.0)], axis=-1)
    hit = np.ones(row.shape, dtype=np.bool_)
    normal = np.where((column > 7.5)[..., None], np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0), UP)
    flat = flat_steps(receivers(bent, normal), hit).any(axis=(0, 1)).reshape(row.shape)
    assert flat[2:-2, [2, 5, 10, 13]].all()
    assert not flat[:, 6:10].any()

    flat_floor = receivers(np.stack([column, row, 0.0 * row], axis=-1), UP)
    hit[5, 6] = False
    seen = hit.ravel()
    some = Receivers(
        flat_floor.place[:, seen], flat_floor.normal[:, seen], flat_floor.lift[seen],
        flat_floor.triangle[seen],
    )  # fmt: skip
    has_steps = np.zeros(row.shape, dtype=np.bool_)
    has_steps[hit] = flat_steps(some, hit).any(axis=(0, 1))
    around = (np.abs(row - 5) <= 1) & (np.abs(column - 6) <= 2)
    around |= (np.abs(row - 5) <= 2) & (np.abs(column - 6) <= 1)
    assert not has_steps[around].any()
    assert has_steps[2:-2, 2:-2][~around[2:-2, 2:-2]].sum() > 60

    hit[:] = True
    below = flat_steps(flat_floor, hit, 8).any(axis=(0, 1)).reshape(row.shape)
    assert below[2:6, 2:-2].all()
    assert not below[6:].any()


def test_parts_of_a_picture_know_of_each_other() -> None:
    """One so wide that few rows are worked on at once."""
    row, column = grid(11, 9000)
    hit = np.ones(row.shape, dtype=np.bool_)
    steps = flat_steps(receivers(np.stack([column, row, 0.0 * row], axis=-1), UP), hit)
    flat = steps.any(axis=(0, 1)).reshape(row.shape)
    assert flat[2:-2, 2:-2].all()
    assert np.count_nonzero(flat) == 7 * 8996


def test_none_on_a_ball() -> None:
    """A place between two on it would lie inside."""
    row, column = grid()
    direction = np.stack([0.02 * (column - 8), 0.02 * (row - 6), np.ones_like(row)], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    hit = np.ones(row.shape, dtype=np.bool_)
    assert not flat_steps(receivers(direction, direction), hit).any()


@pytest.mark.parametrize("bend", [0.3, 0.6, 0.9])
def test_none_in_a_bowl(bend: float) -> None:
    """What bends by less than the height at which rays start hides them two pixels away."""
    row, column = grid()
    x, y = 0.01 * (column - 8.0), 0.01 * (row - 6.0)
    hollow = bend * LIFT * 1e3 / 0.01**2
    place = np.stack([x + 1e3, y, hollow * (x * x + y * y)], axis=-1)
    normal = np.stack([-2.0 * hollow * x, -2.0 * hollow * y, np.ones_like(x)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    hit = np.ones(row.shape, dtype=np.bool_)
    assert not flat_steps(receivers(place, normal), hit).any()


def test_none_near_a_horizon() -> None:
    """Steps between rows grow there, and lead elsewhere than the pixel is."""
    row, column = np.indices((40, 16)).astype(float)
    away = 40.0 / (40.5 - row)
    place = np.stack([(column - 8.0) * away * 0.02, away, np.full_like(away, -1.0)], axis=-1)
    hit = np.ones(row.shape, dtype=np.bool_)
    steps = flat_steps(receivers(place, UP), hit)[1].reshape(3, *row.shape)
    assert steps[1, 2:-14, 2:-2].all()
    assert not steps[:, -8:].any()
    exact = 40.0 / (40.5 - (row + 1.0)) - away
    used = steps[1] != 0.0
    assert np.abs(steps[1][used] / exact[used] - 1.0).max() < 0.1


@pytest.mark.parametrize("where", SCENE_PLACES)
@pytest.mark.parametrize("tilt", [0.0, 89.0, 89.99])
def test_a_lone_plane_is_wholly_lit(gpu_context: None, tilt: float, where: str) -> None:
    """No acne from places beside the pixel's own."""
    angle = np.radians(tilt)
    toward = np.array([np.sin(angle), 0.0, np.cos(angle)]) * 5.0
    scale, offset = SCENE_PLACES[where][0], np.array(SCENE_PLACES[where][1])
    geometry = moved(synthetic.geometry_of([square(4.0, 0.0)]), scale, offset)
    light = placed(light_at("AREA", tuple(toward), (0.0, 0.0, 0.0), size=1e-3), scale, offset)
    along = 0.03 * np.arange(-20.0, 20.0)
    surface = surfaces(
        floor_points(along, along) * scale, UP, origin=tuple(offset), eye=(0.0, 0.0, 10.0 * scale)
    )
    looks = ViewLooks(synthetic.perspective_view(np.eye(4), 40, 40, 1.0), None)  # type: ignore[arg-type]
    for k in range(3):
        seen = replace(surface.upload(), around=looks.around(k))
        drawn = TracedShadowPass(geometry).draw(seen, light, light_sample(light, k, 16))
        assert (open_spots(drawn) == SPOTS).all()


def test_places_farther_away_than_the_plane_is_known_are_left(gpu_context: None) -> None:
    """Those of a wide pixel filter: a ray might start in what stands beside the plane."""
    sheet = np.array([[0.0, -9.0, 1.0], [9.0, -9.0, 1.0], [9.0, 9.0, 1.0], [0.0, 9.0, 1.0]])
    shapes = [square(3.0, 0.0), (sheet, np.array([[0, 1, 2], [0, 2, 3]]))]
    light = light_at("AREA", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), size=0.1)
    along = 0.05 * np.arange(-12.0, 12.0)
    surface = surfaces(floor_points(along, along), UP, eye=(0.0, 0.0, 0.5)).upload()
    view = synthetic.perspective_view(np.eye(4), 24, 24, 1.0)
    seen = {}
    for width in (1.5, 3.0):
        wide = replace(view, pixel_filter=PixelFilter(width=width))
        around = ViewLooks(wide, None).around(0)  # type: ignore[arg-type]
        # A pass each: it keeps what it knows of a sample.
        rays = TracedShadowPass(synthetic.geometry_of(shapes))
        spread = replace(surface, around=around)
        seen[width] = open_spots(rays.draw(spread, light, light_sample(light, 0, 16)))
    rays = TracedShadowPass(synthetic.geometry_of(shapes))
    one = open_spots(rays.draw(surface, light, light_sample(light, 0, 16)))
    assert np.array_equal(seen[3.0], one)
    assert not np.array_equal(seen[1.5], one)


def open_spots(drawn: TracedShadow) -> Array:
    """(H, W) of all pixels how many spots of the light's cell they see."""
    bits = np.abs(read_texture(drawn.spots)[..., 0]).astype(np.int64) & ((1 << SPOTS) - 1)
    return np.bitwise_count(bits).astype(np.float64)


def test_places_of_all_samples_fill_the_pixel(gpu_context: None) -> None:
    """Those of each sample have the filter's mean and variance nearly, those of all samples much
    more nearly."""
    view = synthetic.perspective_view(np.eye(4), 16, 12, 1.0)
    looks = ViewLooks(view, None)  # type: ignore[arg-type]
    assert PLACES == SPOTS
    each = np.array([looks.around(k) + looks.offset(k) for k in range(16)])
    x = np.linspace(-view.pixel_filter.width, view.pixel_filter.width, 4001)
    phase = np.pi * (x / view.pixel_filter.width + 1.0)
    window = np.cos(phase[:, None] * np.arange(4)) @ [0.35875, -0.48829, 0.14128, -0.01168]
    variance = np.sum(window * x * x) / window.sum()
    # So they are where a pixel looks from the same one in all samples.
    for axis in (0, 1):
        assert np.abs(each.mean(axis=axis)).max() < 0.15 * np.sqrt(variance)
    assert np.abs(each.mean(axis=(0, 1))).max() < 0.02 * np.sqrt(variance)
    assert np.abs(each.var(axis=(0, 1)) / variance - 1.0).max() < 0.02


TURNS = (0.3, 0.8, 1.2, 2.1, 2.7)


@pytest.mark.parametrize("half", [0.02, 0.06, 0.2])
def test_edges_of_narrow_penumbras(gpu_context: None, half: float) -> None:
    """Half a plane before a square light: 16 samples beside all places of the filter and the light,
    where a pixel is 0.05 wide and the penumbra about one to eleven of them."""
    off = {spread: [edge_errors(t, half, spread=spread) for t in TURNS] for spread in (True, False)}
    error, before = (np.sqrt(np.mean(np.concatenate(off[each]) ** 2)) for each in (True, False))
    # 256 pairs of a place and a spot: 0.008 to 0.018 as measured. The same 16 of each: 0.046, 0.055
    # and 0.024. The narrower the penumbra, the more does what is seen depend on the place alone.
    assert error < 0.02
    assert error < 0.5 * before
    assert max(abs(np.mean(each)) for each in off[True]) < 0.005


def edge_errors(turn: float, half: float, *, spread: bool) -> Array:
    """Of the pixels at the shadow's edge: by how much of the light the mean of 16 samples is off.

    Args:
        turn: of the half plane's edge, radians.
        half: of the light's width, metres.
        spread: whether rays start all over the pixel.
    """
    h, H, pixel, count = 1.0, 2.0, 0.05, 16
    normal = np.array([np.cos(turn), np.sin(turn)])
    # So far and wide that its other edges cast nothing here.
    vertices = np.array([[0.0, -9.0], [9.0, -9.0], [9.0, 9.0], [0.0, 9.0]])
    across = np.array([normal, [-normal[1], normal[0]]])
    sheet = np.column_stack([vertices @ across, np.full(4, h)]), np.array([[0, 1, 2], [0, 2, 3]])
    rays = TracedShadowPass(synthetic.geometry_of([square(3.0, 0.0), sheet]))
    light = light_at("AREA", (0.0, 0.0, H), (0.0, 0.0, 0.0), size=2.0 * half)
    looks = ViewLooks(synthetic.perspective_view(np.eye(4), 48, 36, 1.0), None)  # type: ignore[arg-type]
    xs, ys = (pixel * (np.arange(float(size)) - 0.5 * size) for size in (48, 36))
    total = np.zeros((36, 48))
    for k in range(count):
        x, y = looks.offset(k)
        points = floor_points(xs + x * pixel, ys + y * pixel)
        seen = surfaces(points, UP, eye=(0.0, 0.0, 0.5)).upload()
        seen = replace(seen, around=looks.around(k) if spread else None)
        total += open_spots(rays.draw(seen, light, light_sample(light, k, count))) / SPOTS

    many = np.concatenate([looks.around(k) + looks.offset(k) for k in range(16)]) * pixel
    along = (np.arange(16) + 0.5) / 16
    lit_from = half * (2.0 * np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2) - 1.0)
    reach = (many @ normal)[:, None] * (1.0 - h / H) + (lit_from @ normal) * (h / H)
    crossing = (floor_points(xs, ys)[..., :2] @ normal) * (1.0 - h / H)
    want = np.searchsorted(np.sort(reach, axis=None), -crossing) / reach.size
    # Where rays have all of the pixel to start from, and the shadow has its edge.
    chosen = np.zeros(want.shape, dtype=np.bool_)
    chosen[2:-2, 2:-2] = True
    chosen &= (want > 0.02) & (want < 0.98)
    assert chosen.sum() > 20
    return np.asarray(total[chosen] / count - want[chosen])
