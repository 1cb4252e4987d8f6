# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels as lists of shading samples: against their float64 twin, and at extremes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.pixel_lists import MOST_IN_CELL, ListBuilder, PixelLists
from addon.corrmap.same_surface import MOST_BEND, same_surface
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from tests import synthetic
from tests.reference import pixel_lists as twin

pytestmark = pytest.mark.usefixtures("gpu_context")

VISIBILITY = 12


def make_view(scale: float, offset: NDArray[np.float64], size: tuple[int, int]) -> View:
    return synthetic.perspective_view(
        synthetic.looking_at(
            offset + scale * np.array([-1.5, -1.6, 0.9]),
            offset + scale * np.array([0.3, 0.2, -0.6]),
        ),
        *size, 1.2, near=0.01 * scale, far=100.0 * scale,
    )  # fmt: skip


def visible(geometry: SceneGeometry, view: View) -> tuple[Any, list[Any], list[Any]]:
    """The view's looks, what its samples see, and where in the pixels they lie."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.view_looks import ViewLooks
    from addon.corrmap.visible_surface import VisibleSurfacePass

    looks = ViewLooks(view, VisibleSurfacePass(GeometryBuffer(geometry, view.origin)))
    every = range(VISIBILITY)
    return looks, [looks.visible(k) for k in every], [looks.offset(k) for k in every]


def make_lists(looks: Any, own: Any) -> PixelLists:
    from addon.corrmap.pixel_list_pass import PixelListPass
    from addon.glsl.shader import read_texture

    builder = ListBuilder(read_texture(own.position), read_texture(own.normal)[..., :3])
    for k in range(VISIBILITY):
        PixelListPass(looks).add(builder, own, k)
    return builder.finish()


def room_lists(
    scale: float = 1.0, offset: float = 0.0, size: tuple[int, int] = (40, 30)
) -> tuple[list[Any], list[tuple[float, float]], PixelLists]:
    moved = np.full(3, offset)
    view = make_view(scale, moved, size)
    looks, seen, offsets = visible(synthetic.room_with_box(scale, moved), view)
    return seen, offsets, make_lists(looks, seen[0])


def test_the_gpus_lists_are_the_twins() -> None:
    from addon.glsl.shader import read_texture

    seen, offsets, lists = room_lists()
    position = np.stack([read_texture(each.position) for each in seen]).astype(np.float64)
    normal = np.stack([read_texture(each.normal) for each in seen])[..., :3].astype(np.float64)
    expected = twin.make_lists(position, normal, offsets)
    assert lists.visibility == VISIBILITY
    # Edges of the box and the room, but not most of the picture.
    assert 0.05 < np.mean(lists.count > 0) < 0.4
    assert lists.position.tolist() == [list(p) for p in expected.places[40 * 30 :]]
    assert [tuple(divmod(int(c), 40)) for c in lists.cell] == expected.cells[40 * 30 :]
    for pixel in range(40 * 30):
        entries = slice(lists.first[pixel], lists.first[pixel] + lists.count[pixel])
        got = dict(zip(lists.sample[entries].tolist(), lists.weight[entries], strict=True))
        want = expected.weights[divmod(pixel, 40)]
        if lists.count[pixel]:
            assert got == pytest.approx(want)
        else:
            assert want == {pixel: 1.0}


def test_pixels_are_their_lists_weighted_sums() -> None:
    from addon.corrmap.pixel_list_pass import PixelListTextures
    from addon.glsl.shader import framebuffer, read_texture, texture_2d
    from addon.relight.layers.layer_stack import LightLayer
    from addon.relight.layers.resolve_pass import ResolvePass

    seen, offsets, lists = room_lists()
    height, width = lists.height, lists.width
    rows = height - (-len(lists.cell) // width)
    shaded = np.random.default_rng(1).random((rows, width, 4)).astype(np.float32)
    layers = [texture_2d(width, height) for _ in range(2)]
    target = framebuffer(layers)
    with target.bind():
        target.clear(color=(0.0, 0.0, 0.0, 0.0))

    def shade(atlas: Any) -> None:
        from addon.glsl.shader import texture_from_array
        from addon.relight.layers.sum_pass import Addend, SumPass

        texture = texture_from_array(shaded, "RGBA32F")
        for part in atlas:
            SumPass().draw([Addend(texture)], part)

    # Of two textures, as of a layer that is split by lobes.
    layer = LightLayer(tuple(layers), target)
    resolve = ResolvePass()
    textures = PixelListTextures(lists)
    resolve.draw(layer, textures, rows, lambda _: shade([framebuffer([t]) for t in resolve.shaded]))
    position = np.stack([read_texture(each.position) for each in seen]).astype(np.float64)
    normal = np.stack([read_texture(each.normal) for each in seen])[..., :3].astype(np.float64)
    expected = twin.make_lists(position, normal, offsets)
    want = expected.resolve(shaded.reshape(-1, 4).astype(np.float64), height, width)
    for texture in layers:
        # A dozen products and sums of numbers below one, float32.
        assert np.abs(read_texture(texture) - want).max() < 2e-6
    # Rows of entries are filled up.
    rest = textures.nbytes - 16 * width * height - 8 * len(lists.sample)
    assert 0 <= rest < 8 * 4096


@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 0.0), (1e5, 0.0), (1.0, 1e6), (1e-2, 1e3)])
def test_lists_do_not_depend_on_size_and_place(scale: float, offset: float) -> None:
    _, _, plain = room_lists()
    _, _, lists = room_lists(scale, offset)
    # What falls on an edge to float32 may fall on either side of it.
    differ = (plain.count > 0) != (lists.count > 0)
    assert differ.mean() < 0.002
    assert abs(len(plain.cell) - len(lists.cell)) <= 3
    assert np.isfinite(lists.weight).all()
    listed = np.flatnonzero(lists.count)
    total = np.add.reduceat(lists.weight.astype(np.float64), lists.first[listed])
    assert np.abs(total - 1.0).max() < 1e-6


def test_a_view_without_edges_has_no_lists() -> None:
    corners = np.array([[-40.0, -40, 0], [40.0, -40, 0], [40.0, 40, 0], [-40.0, 40, 0]])
    geometry = synthetic.geometry_of([(corners, np.array([[0, 1, 2], [0, 2, 3]]))])
    # At a grazing angle the pixels are ten times as long as they are wide.
    view = synthetic.perspective_view(
        synthetic.looking_at((0, -3.0, 0.3), (0, 0, 0)), 32, 24, 0.1, far=1000.0
    )
    looks, seen, _ = visible(geometry, view)
    lists = make_lists(looks, seen[0])
    assert lists.samples_per_pixel == 1.0
    assert not lists.count.any()
    assert not len(lists.sample)


def test_a_crowded_cell_has_a_bounded_number_of_samples() -> None:
    """Each hit is on a plane of its own, as in a hedge far away."""
    count = 40
    position = np.zeros((1, 1, 4), dtype=np.float32)
    position[0, 0] = (0.0, 0.0, -1.0, 1.0)
    normal = np.array([[[0.0, 0.0, 1.0]]], dtype=np.float32)
    builder = ListBuilder(position, normal)
    middle = np.array([[0.5, 0.5]])
    for k in range(count):
        hit = np.array([[0.0, 0.0, -2.0 - k, 1.0]], dtype=np.float32)
        builder.add(
            np.zeros(1, dtype=np.int64), hit, normal[0], np.ones((1, 2), np.float32), middle
        )
    lists = builder.finish()
    assert len(lists.cell) == MOST_IN_CELL - 1
    assert lists.count[0] == MOST_IN_CELL - 1
    # The later hits count for the nearest: the last plane that has a sample.
    assert lists.weight.max() == pytest.approx((count - MOST_IN_CELL + 2) / count)


def test_there_are_no_more_samples_than_can_be_numbered() -> None:
    position = np.tile(np.array([0.0, 0.0, -1.0, 1.0], dtype=np.float32), (1, 4, 1))
    normal = np.tile(np.array([0.0, 0.0, 1.0], dtype=np.float32), (1, 4, 1))
    builder = ListBuilder(position, normal, most=6)
    film = np.array([[k + 0.5, 0.5] for k in range(4)])
    for count, depth in ((1, -2.0), (4, -3.0)):
        assert not builder.lacks_room
        hits = np.tile(np.array([0.0, 0.0, depth, 1.0], dtype=np.float32), (count, 1))
        pixel, codes = np.arange(count), np.ones((count, 2), np.float32)
        builder.add(pixel, hits, normal[0, :count], codes, film[:count])
    assert builder.lacks_room
    lists = builder.finish()
    assert lists.cell.tolist() == [0]
    # The second hits' nearest samples: the further one of the first cell, and the others' own, for
    # which they need no list.
    assert lists.sample.tolist() == [4]
    assert lists.weight.tolist() == [1.0]
    assert lists.count.tolist() == [1, 0, 0, 0]


def test_several_hits_of_one_cell_share_new_samples() -> None:
    """As where a lens or a shutter takes the hits of one sample to anywhere."""
    position = np.zeros((1, 3, 4), dtype=np.float32)
    normal = np.zeros((1, 3, 3), dtype=np.float32)
    builder = ListBuilder(position, normal)
    hits = np.array([[0.0, 0, -2, 1], [0.1, 0, -2, 1], [0.0, 0, -2, 2]], dtype=np.float32)
    facing = np.tile(np.array([0.0, 0.0, 1.0], dtype=np.float32), (3, 1))
    triangle = np.array([[1, 5], [1, 5], [1, 6]], dtype=np.float32)
    builder.add(np.arange(3), hits, facing, triangle, np.array([[-8.5, 0.5]] * 3))
    lists = builder.finish()
    assert lists.cell.tolist() == [0, 0]
    assert lists.sample.tolist() == [3, 3, 4]
    assert lists.triangle.tolist() == [[1, 5], [1, 6]]


def test_the_gpu_and_numpy_agree_on_what_one_surface_is() -> None:
    from addon.corrmap.pixel_list_pass import PixelListPass
    from addon.corrmap.visible_surface import VisibleSurface
    from addon.glsl.shader import texture_from_array

    rng = np.random.default_rng(3)
    size = (64, 64)
    p = np.concatenate([rng.normal(size=(*size, 3)), rng.integers(0, 3, (*size, 1))], axis=-1)
    n = rng.normal(size=(*size, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    m = n + rng.normal(size=(*size, 3)) * 0.1 * rng.random((*size, 1))
    m /= np.linalg.norm(m, axis=-1, keepdims=True)
    along = rng.normal(size=(*size, 3))
    along -= np.sum(along * n, axis=-1, keepdims=True) * n * (1.0 - 0.3 * rng.random((*size, 1)))
    q = np.concatenate([p[..., :3] + 1e-2 * along, p[..., 3:]], axis=-1)
    q[::4, :, 3] = rng.integers(0, 3, (16, 64))
    place, facing, other, turned = (each.astype(np.float32) for each in (p, n, q, m))

    def upload(place: NDArray[np.float32], facing: NDArray[np.float32]) -> VisibleSurface:
        wide = np.concatenate([facing, np.zeros((*size, 1), np.float32)], axis=-1)
        return VisibleSurface(
            texture_from_array(place, "RGBA32F"),
            texture_from_array(wide, "RGBA32F"),
            np.zeros(4),
            texture_from_array(np.zeros((*size, 2), np.float32), "RG32F"),
        )

    class Kept:
        pixel: NDArray[np.int64]

        def add(self, pixel: NDArray[np.int64], *_: Any, **__: Any) -> None:
            self.pixel = pixel

    class Looks:
        is_blurred = False

        def visible(self, _: int) -> VisibleSurface:
            return upload(other, turned)

        def film(self, *_: Any) -> None:
            pass

    kept: Any = Kept()
    looks: Any = Looks()
    PixelListPass(looks).add(kept, upload(place, facing), 0)
    stray = np.zeros(size, dtype=bool)
    stray.ravel()[kept.pixel] = True
    p, n, q, m = (each.astype(np.float64) for each in (place, facing, other, turned))
    want = same_surface(p, n, q, m)
    assert 0.2 < want.mean() < 0.8
    # Of 4096 pairs, those within float32 of a bound may fall on either side.
    assert np.mean(stray == want) <= 1e-3
    single = [twin.same_surface(*(each[0, i] for each in (p, n, q, m))) for i in range(64)]
    assert single == want[0].tolist()
    assert twin.MOST_BEND == MOST_BEND


@pytest.mark.parametrize("most", [4, 6, 9, 12])
def test_light_of_layers_beyond_the_most_is_not_lost(most: int) -> None:
    """Two layers before all of four pixels, with room for samples of some of them."""

    def sheet(depth: float) -> tuple[NDArray[np.float32], ...]:
        position = np.full((2, 2, 4), 1.0, dtype=np.float32)
        position[..., 2] = depth
        return position, np.ones((2, 2, 3), np.float32), np.ones((2, 2, 2), np.float32)

    behind, *layers = (sheet(depth) for depth in (3.0, 1.0, 2.0))
    builder = ListBuilder(behind[0], behind[1], most, [(a, b, c) for a, b, c in layers])
    builder.add_none()
    assert builder.lacks_room == (most < 12)
    shares = [0.125, 1.0, 0.5]
    lists = builder.finish([np.full((2, 2, 3), share, np.float32) for share in shares])
    assert len(lists.cell) == most - 4
    assert lists.sample.max() < most
    assert np.array_equal(lists.count > 0, np.ones(4, dtype=bool))
    light = np.add.reduceat(lists.weight, lists.first, axis=0)
    assert light == pytest.approx(np.full((4, 3), sum(shares)))
