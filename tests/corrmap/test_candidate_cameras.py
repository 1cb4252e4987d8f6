# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists of candidates lead to the map that trying all cameras gives, and their bounds hold."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from addon.camplace.camera import CachingCamera
from addon.scene.view import View
from tests import synthetic
from tests.reference import correspondence as twin
from tests.reference.candidate_cameras import best_scores

if TYPE_CHECKING:
    from addon.corrmap.tile_pages import TilePages

PLAN = ChannelPlan(("depth", "material_id", "normal", "diffuse_color"), {}, ("one", "two"))
ORIGIN = np.zeros(3)
# Not whole tiles.
SIZE = (61, 45)


def random_cameras(
    count: int, *, scale: float = 1.0, offset: NDArray[np.float64] = ORIGIN, seed: int = 5
) -> list[CachingCamera]:
    """Anywhere in the room, looking anywhere, of different widths and resolutions."""
    random = np.random.default_rng(seed)
    cameras = []
    for number in range(count):
        place = offset + scale * random.uniform(-1.9, 1.9, 3)
        looking = synthetic.looking_at(place, place + random.normal(size=3))
        fov, side = random.uniform(0.3, 2.0), int(random.choice([12, 24, 40]))
        cameras.append(
            CachingCamera(number, looking, fov, 1e-4 * scale, 100.0 * scale, side, "PERSPECTIVE", 0)
        )
    return cameras


def room_pictures(
    cameras: list[CachingCamera], scale: float = 1.0, offset: NDArray[np.float64] = ORIGIN
) -> list[DeepFramebuffer]:
    geometry = synthetic.room_with_box(scale, offset)
    tracer = synthetic.Tracer(geometry)
    return [synthetic.trace_framebuffer(geometry, tracer, c, np.ones_like) for c in cameras]


def maps(
    pictures: list[DeepFramebuffer],
    view: View,
    scale: float = 1.0,
    offset: NDArray[np.float64] = ORIGIN,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The map with lists, and that of all cameras."""
    from addon.corrmap.correspondence import CorrespondencePass
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurfacePass

    pages = upload_tiles(pictures, PLAN, drop=False)
    geometry = GeometryBuffer(synthetic.room_with_box(scale, offset), view.origin)
    visible = VisibleSurfacePass(geometry).draw(view)
    listed = CorrespondencePass(pages, view.origin, tried_all=0)
    whole = CorrespondencePass(pages, view.origin, tried_all=len(pictures))
    return listed.draw(visible).read(), whole.draw(visible).read()


def room_view(
    scale: float = 1.0, offset: NDArray[np.float64] = ORIGIN, size: tuple[int, int] = SIZE
) -> View:
    place = offset + scale * np.array([-1.5, -1.6, 0.9])
    looking = synthetic.looking_at(place, offset + scale * np.array([0.3, 0.2, -0.6]))
    return synthetic.perspective_view(looking, *size, 1.2, near=0.01 * scale, far=100.0 * scale)


def parallel_view() -> View:
    view = room_view()
    clip_from_camera = np.diag([0.8, 0.8, -0.02, 1.0])
    clip_from_camera[2, 3] = -1.0  # from the camera on
    return replace(view, clip_from_camera=clip_from_camera, perspective=False)


def close_view() -> View:
    """A hand's breadth of a wall, at a slant."""
    looking = synthetic.looking_at((1.9, 1.0, 0.2), (2.0, 1.6, 0.3))
    return synthetic.perspective_view(looking, *SIZE, 0.5, near=1e-3, far=100.0)


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1.0, (0, 0, 0)), (1e-3, (0, 0, 0)), (1e5, (0, 0, 0)), (1.0, (1e6, -1e6, 1e6))],
)
def test_lists_give_the_map_of_all_cameras(
    gpu_context: None, scale: float, offset: tuple[float, float, float]
) -> None:
    moved = np.array(offset, dtype=np.float64)
    pictures = room_pictures(random_cameras(90, scale=scale, offset=moved), scale, moved)
    listed, whole = maps(pictures, room_view(scale, moved), scale, moved)
    assert np.array_equal(listed, whole)
    # As many as are better than others somewhere: the lists did not have it easy.
    assert len(np.unique(whole[..., 0])) > 20


@pytest.mark.parametrize("view", [parallel_view(), close_view()], ids=["parallel", "close"])
def test_other_views_too(gpu_context: None, view: View) -> None:
    listed, whole = maps(room_pictures(random_cameras(90, seed=6)), view)
    assert np.array_equal(listed, whole)
    assert (whole[..., 0] >= 0.0).any()


def test_the_map_equals_its_twin(gpu_context: None) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    view, pictures = room_view(), room_pictures(random_cameras(60))
    listed, _ = maps(pictures, view)
    visible = VisibleSurfacePass(GeometryBuffer(synthetic.room_with_box(), view.origin)).draw(view)
    place, normal = (
        read_texture(texture)[..., :3].reshape(-1, 3).astype(np.float64)
        for texture in (visible.position, visible.normal)
    )
    expected = twin.correspondence(pictures, place + view.origin, normal, view.origin)
    # Where two cameras score alike, or a texel lies on its bound, rounding decides.
    assert (listed.reshape(-1, 4)[:, 0] == expected[:, 0]).mean() > 0.998


def test_more_cameras_than_lists_hold(gpu_context: None) -> None:
    """All of them see everything that the view sees, from almost one place, and many score the
    same: the lists cannot tell them apart."""
    from addon.corrmap.candidate_cameras import LIST_LENGTH, LISTS

    view = room_view()
    random = np.random.default_rng(3)
    cameras = []
    for number in range(LISTS * LIST_LENGTH + 30):
        looking = view.world_from_camera.copy()
        looking[:3, 3] += random.choice([0.0, 1e-3], 3)
        cameras.append(
            CachingCamera(number, looking, 1.4, 1e-4, 100.0, 24, "PERSPECTIVE", 0)
        )  # fmt: skip
    listed, whole = maps(room_pictures(cameras), view)
    assert np.array_equal(listed, whole)
    assert len(np.unique(whole[..., 0])) > 4


def test_a_thousand_cameras(gpu_context: None) -> None:
    """More than a uniform block holds."""
    listed, whole = maps(room_pictures(random_cameras(1000)), room_view())
    assert np.array_equal(listed, whole)
    assert whole[..., 0].max() > 900.0


@pytest.mark.parametrize("spread", [0.0, 0.3, 3.0])
def test_bounds_hold_and_are_tight_where_a_tile_is_small(gpu_context: None, spread: float) -> None:
    """Random points and normals in tiles, of which each bound is held against all scores."""
    cameras = random_cameras(30, seed=8)
    place, normal, seen = _random_tiles(spread)
    number, bound = _lists(cameras, place, normal, seen)
    best = best_scores(cameras, place, normal, seen, 1 << _tile_bits())
    listed = np.zeros_like(best)
    rows, columns = np.meshgrid(*map(np.arange, number.shape[:2]), indexing="ij")
    for rank in range(number.shape[2]):
        which = number[..., rank]
        there = which >= 0
        listed[rows[there], columns[there], which[there]] = bound[there, rank]
    # What has a score is listed, with a bound that is no lower; lists have room for all.
    assert (listed >= best).all()
    assert (best > 0.0).sum() > 400
    if spread == 0.0:
        # Of one point all but roundings is known, and a list's texel has the greatest bound of
        # three cameras: only the first of them has its own.
        first = number[..., 0]
        exact = np.take_along_axis(best, np.maximum(first, 0)[..., None], axis=2)[..., 0]
        ratio = (bound[..., 0] / exact)[(first >= 0) & (exact > 0.0)]
        assert ratio.size > 50
        # The cosine of the normals' spread is rounded by 8 spacings, which leaves an angle of
        # sqrt(2 * 8 * 2^-23) = 0.0014: a hundredth of a score whose cosine is a seventh, as less
        # than one in four is.
        assert np.percentile(ratio, 75) < 1.01


def test_cameras_in_another_room_are_not_listed(gpu_context: None) -> None:
    """They look at this room's wall from behind the next one's; without the depths they would be
    listed, as the wall is in their pictures and they may face it."""
    from addon.corrmap.camera_table import camera_table
    from addon.corrmap.candidate_cameras import CandidatePass
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    rooms = synthetic.geometry_of(
        [synthetic.box((0, 0, 0), 4.0), synthetic.box((-4.5, 0.3, 0.1), 4.0)]
    )
    tracer = synthetic.Tracer(rooms)
    random = np.random.default_rng(4)
    cameras = []
    for number in range(20):
        here = number < 10
        place = random.uniform(-1.5, 1.5, 3) - (0.0 if here else 4.5, 0.0, 0.0)
        looking = synthetic.looking_at(place, (2.0, *random.uniform(-1.0, 1.0, 2)))
        cameras.append(CachingCamera(number, looking, 1.2, 1e-4, 1e2, 48, "PERSPECTIVE", 0))
    pictures = [synthetic.trace_framebuffer(rooms, tracer, c, np.ones_like) for c in cameras]
    pages = upload_tiles(pictures, PLAN, drop=False)
    looking = synthetic.looking_at((-1.5, 0.1, 0.2), (2.0, 0.2, 0.1))
    view = synthetic.perspective_view(looking, *SIZE, 0.8)
    visible = VisibleSurfacePass(GeometryBuffer(rooms, view.origin)).draw(view)
    rank = CandidatePass(pages.defines, pages.depth_samplers)
    listed = {}
    for name, ranges in (("here", pages.depth_ranges()), ("anywhere", _all_depths(pages))):
        known = {
            "camera_table": camera_table(pages.cameras, pages.numbers, view.origin),
            **pages.depth_textures(),
            "depth_ranges": ranges,
        }
        texels = [read_texture(texture) for texture in rank.draw(visible, known).lists]
        numbers = np.concatenate([x.reshape(len(x), -1, 4)[..., 1:].ravel() for x in texels])
        listed[name] = set(numbers[numbers >= 0].astype(int))
    assert min(listed["anywhere"]) < 10 <= max(listed["anywhere"])
    assert listed["here"] == {number for number in listed["anywhere"] if number < 10}


def test_a_pyramid_holds_each_rectangle() -> None:
    from addon.corrmap.depth_ranges import depth_pyramid
    from addon.corrmap.tile_layout import BLOCK

    random = np.random.default_rng(1)
    side = 3 * BLOCK - 5
    depth = random.uniform(1.0, 9.0, (side, side)).astype(np.float32)
    depth[random.random(depth.shape) < 0.3] = 0.0
    depth[:BLOCK, :BLOCK] = 0.0
    kept = np.array([[True, True, False], [True, True, True], [True, False, True]])
    pyramid = depth_pyramid(depth, kept)
    assert pyramid.shape == (16 + 4 + 1, 2)
    blocks, quarters, whole = (
        pyramid[:16].reshape(4, 4, 2),
        pyramid[16:20].reshape(2, 2, 2),
        pyramid[20],
    )
    texels = depth[BLOCK : 2 * BLOCK, 2 * BLOCK :]
    assert blocks[1, 2].tolist() == [texels[texels > 0.0].min(), texels.max()]
    # Nothing is hit, nothing is held, and beyond the picture's edge.
    for empty in (blocks[0, 0], blocks[0, 2], blocks[3, 3]):
        assert empty[0] > empty[1]
    held = depth * kept.repeat(BLOCK, 0).repeat(BLOCK, 1)[:side, :side]
    part = held[: 2 * BLOCK, : 2 * BLOCK]
    assert quarters[0, 0].tolist() == [part[part > 0.0].min(), part.max()]
    assert whole.tolist() == [held[held > 0.0].min(), held.max()]


def test_a_tile_that_sees_nothing_lists_nothing(gpu_context: None) -> None:
    place, normal, seen = _random_tiles(0.3)
    seen[:8, :8] = False
    number, _ = _lists(random_cameras(30), place, normal, seen)
    assert (number[0, 0] < 0).all()
    assert (number[1, 1] >= 0).any()


def _tile_bits() -> int:
    from addon.corrmap.candidate_cameras import TILE_BITS

    return TILE_BITS


def _random_tiles(
    spread: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """(H, W, 3) points and unit normals, each tile's within `spread` of one point and one normal,
    and (H, W) which of them there are."""
    random = np.random.default_rng(7)
    side = 1 << _tile_bits()
    width, height = 157, 118

    def of_tiles(low: float, high: float) -> NDArray[np.float64]:
        middles = random.uniform(low, high, (-(-height // side), -(-width // side), 3))
        spots = middles.repeat(side, axis=0).repeat(side, axis=1)[:height, :width]
        return np.asarray(spots + spread * random.uniform(-0.5, 0.5, spots.shape))

    place, normal = of_tiles(-1.9, 1.9), of_tiles(-1.0, 1.0)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    # As float32, which is what the GPU gets.
    place, normal = (v.astype(np.float32).astype(np.float64) for v in (place, normal))
    return place, normal, random.random((height, width)) < 0.9


def _all_depths(pages: TilePages) -> Any:
    """Ranges by which cameras may show anything anywhere."""
    from addon.glsl.shader import read_texture, texture_from_array

    ranges = read_texture(pages.depth_ranges())
    return texture_from_array(np.broadcast_to((0.0, 1e9), ranges.shape).astype("f4"), "RG32F")


def _lists(
    cameras: list[CachingCamera],
    place: NDArray[np.float64],
    normal: NDArray[np.float64],
    seen: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(rows, columns, ranks) cameras' numbers and the bounds that stand with them."""
    from addon.corrmap.camera_table import camera_table
    from addon.corrmap.candidate_cameras import CandidatePass
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurface
    from addon.glsl.shader import read_texture, texture_from_array

    pages: TilePages = upload_tiles(room_pictures(cameras), PLAN, drop=False)
    padded = [
        np.concatenate([v, seen[..., None]], axis=2).astype(np.float32) for v in (place, normal)
    ]
    padded[0][~seen] = 0.0
    position, facing = (texture_from_array(values, "RGBA32F") for values in padded)
    eye = np.array([0.1, 0.2, 0.3, 1.0])
    visible = VisibleSurface(position, facing, eye, triangles=position)
    known = {
        "camera_table": camera_table(pages.cameras, pages.numbers, ORIGIN),
        **pages.depth_textures(),
        "depth_ranges": _all_depths(pages),
    }
    made = CandidatePass(pages.defines, pages.depth_samplers).draw(visible, known)
    lists = [read_texture(texture) for texture in made.lists]
    texels = np.concatenate([x.reshape(len(x), -1, 6, 4) for x in lists], axis=2)
    number = texels[..., 1:].reshape(*texels.shape[:2], -1).astype(np.int64)
    bound = texels[..., 0].repeat(3, axis=2).astype(np.float64)
    return number, bound
