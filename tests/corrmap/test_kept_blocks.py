# SPDX-License-Identifier: GPL-3.0-or-later
"""What is dropped is seen better by another camera; nothing else is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.camplace.camera import CachingCamera
from addon.corrmap.kept_blocks import MARGIN, MOST_RIVALS, SeenSurface, kept_blocks
from addon.corrmap.tile_layout import BLOCK
from addon.progress import silent
from addon.scene.geometry import SceneGeometry
from tests import synthetic

SIDE = 8 * BLOCK

Part = tuple[NDArray[np.float64], NDArray[np.int64]]


def wall(
    half: float, y: float = 0.0, centre: tuple[float, float] = (0.0, 0.0), facing: int = -1
) -> Part:
    """A square in the plane of x and z."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::facing]
    places = [(centre[0] + half * x, y, centre[1] + half * z) for x, z in corners]
    return np.array(places), np.array([[0, 1, 2], [0, 2, 3]])


def camera(number: int, distance: float, x: float = 0.0, side: int = SIDE) -> CachingCamera:
    """In front of the wall at y = 0, looking at it head on; 90 degrees wide."""
    looking = synthetic.looking_at((x, -distance, 0.0), (x, 0.0, 0.0))
    return CachingCamera(number, looking, 0.5 * np.pi, 0.01, 100.0, side, "PERSPECTIVE", 0)


def seen(geometry: SceneGeometry, cameras: Sequence[CachingCamera]) -> list[SeenSurface]:
    tracer = synthetic.Tracer(geometry)
    result = []
    for one in cameras:
        channels = synthetic.trace_framebuffer(geometry, tracer, one, np.ones_like).channels
        ids = channels["material_id"][..., 0].astype(np.uint16)
        result.append(SeenSurface(one, channels["depth"][..., 0], ids))
    return result


def blocks_of(columns: tuple[int, int], rows: tuple[int, int] | None = None) -> NDArray[np.bool_]:
    """The blocks from one corner to (not with) another."""
    result = np.zeros((SIDE // BLOCK, SIDE // BLOCK), dtype=bool)
    result[slice(*(rows or columns)), slice(*columns)] = True
    return result


FAR, NEAR = camera(0, 8.0), camera(1, 1.0)


def test_the_far_camera_keeps_what_the_near_one_does_not_see() -> None:
    pictures = seen(synthetic.geometry_of([wall(20.0)]), [FAR, NEAR])
    far, near = kept_blocks(pictures)
    assert near.all()
    # The near camera sees 2 m of the wall, of 16 m that the far one's 8 blocks show: the block in
    # its middle, less the outermost texels, which the near one's footprints do not surround. The
    # middle lies on the border of 4 blocks, each half of which it sees.
    assert far.all()
    # Seen from 2 m, it is 4 m: two blocks; the border's texels again keep one more on each side,
    # if they do not end within the near picture.
    wider, _ = kept_blocks(seen(synthetic.geometry_of([wall(20.0)]), [FAR, camera(1, 2.5)]))
    assert np.array_equal(wider, ~blocks_of((3, 5)))


def test_a_camera_as_far_drops_nothing() -> None:
    # 1.1 times nearer is a score 1.21 times as good in the middle, under the margin of 1.25, and
    # less aside. 1.2 times is 1.44 there, and 1.33 at the far corner of the blocks in the middle.
    geometry = synthetic.geometry_of([wall(20.0)])
    assert float(MARGIN) == 1.25
    for nearer, dropped in ((1.1, False), (1.2, True)):
        kept, other = kept_blocks(seen(geometry, [FAR, camera(1, 8.0 / nearer)]))
        assert other.all()
        assert (not kept.all()) == dropped


def test_more_texels_count_as_coming_nearer() -> None:
    geometry = synthetic.geometry_of([wall(20.0)])
    coarse, fine = kept_blocks(seen(geometry, [FAR, camera(1, 8.0, side=2 * SIDE)]))
    assert fine.all()
    # At the edge of the same field of view, nine texels leave the picture.
    assert not coarse[1:7, 1:7].any()
    assert coarse.any()


def test_of_many_cameras_those_are_tried_that_beat_something() -> None:
    """Near cameras side by side see a part of the wall each; most others are no better, and the
    best of all for what is behind a plate sees nothing but that."""
    geometry = synthetic.geometry_of([wall(20.0), wall(6.0, y=-0.5)])
    near = [camera(n, 3.0, x=1.5 * (n - 8)) for n in range(17)]
    hidden = [camera(17 + n, 2.0, x=0.5 * n) for n in range(6)]
    same = [camera(23 + n, 8.0, x=0.02 * n) for n in range(12)]
    every = seen(geometry, [FAR, *near, *hidden, *same])
    few = [every[0], *every[1:24]]
    assert len(few) - 1 <= MOST_RIVALS < len(every) - 1
    kept, expected = kept_blocks(every)[0], kept_blocks(few)[0]
    assert np.array_equal(kept, expected)
    assert kept.any()
    assert not kept.all()


def test_what_an_occluder_hides_from_the_near_camera_is_kept() -> None:
    # A plate of 1 m stands 1 m before the middle of the wall. From 4 m it hides 4/3 m of the wall.
    parts = [wall(20.0), wall(0.5, y=-1.0)]
    geometry = synthetic.geometry_of(parts)
    # The far camera looks from the side, past the plate.
    place = synthetic.looking_at((9.0, -8.0, 0.0), (0.0, 0.0, 0.0))
    aside = replace(camera(0, 8.0, side=8 * SIDE), world_from_camera=place)
    near = camera(1, 4.0, side=8 * SIDE)
    pictures = seen(geometry, [aside, near])
    kept = kept_blocks(pictures)
    assert kept[1].all()
    picture = pictures[0]
    points = _points(picture)
    on_wall = (picture.depth > 0.0) & (picture.material == 1)
    x, z = points[..., 0], points[..., 2]
    shadow = on_wall & (np.maximum(np.abs(x), np.abs(z)) < 0.5 * 4.0 / 3.0)
    assert shadow.any()
    whole = _of_texels(kept[0])
    assert whole[shadow].all()
    # Not so the wall beside the plate's shadow and within what the near camera sees, by more than
    # a block's width of up to 0.7 m.
    clear = on_wall & (np.abs(z) < 2.5) & (np.abs(x + 2.9) < 0.2)
    assert clear.any()
    assert not whole[clear].any()


def test_half_a_footprint_does_not_beat() -> None:
    # The far camera's texels are 1/8 m, the near one's 1/32. A slit of 1/16 m, two of its texels,
    # parts two walls: what lies beside it is kept by the far camera, and nothing else is.
    half = 10.0
    slit = 1.0 / 16.0
    first = wall(half, centre=(-half - 0.5 * slit + 1.03, 0.0))
    second = wall(half, centre=(half + 0.5 * slit + 1.03, 0.0))
    geometry = synthetic.geometry_of([first, second])
    one_material = replace(
        geometry, material_id=np.zeros_like(geometry.material_id), material_names=("one",)
    )
    kept, _ = kept_blocks(seen(one_material, [FAR, camera(1, 4.5)]))
    # The near camera sees 9 of 16 m: four blocks and a bit; the slit is in column 4 (0 to 2 m).
    expected = ~blocks_of((2, 6))
    expected[:, 4] = True
    assert np.array_equal(kept, expected)


def test_another_material_does_not_beat() -> None:
    # The near camera's picture says that the right half of the wall is of another material.
    far, near = seen(synthetic.geometry_of([wall(20.0)]), [FAR, camera(1, 4.5)])
    other = near.material.copy()
    other[:, SIDE // 2 :] += 1
    kept, _ = kept_blocks([far, replace(near, material=other)])
    # Column 3 ends where the other material begins: its last texel's nine reach over.
    assert np.array_equal(kept, ~blocks_of((2, 3), (2, 6)))


def test_the_other_side_of_a_sheet_is_another_surface() -> None:
    geometry = synthetic.geometry_of([wall(20.0)])
    behind = replace(NEAR, world_from_camera=synthetic.looking_at((0.0, 4.5, 0.0), (0.0, 0.0, 0.0)))
    assert all(blocks.all() for blocks in kept_blocks(seen(geometry, [FAR, behind])))


def test_without_the_better_camera_nothing_is_dropped() -> None:
    geometry = synthetic.geometry_of([wall(20.0)])
    both = seen(geometry, [FAR, camera(1, 4.5)])
    assert not kept_blocks(both)[0].all()
    assert kept_blocks(both[:1])[0].all()


def test_blocks_that_hit_nothing_are_dropped() -> None:
    # 4 of 16 m: the middle four blocks of the lower and upper halves.
    (kept,) = kept_blocks(seen(synthetic.geometry_of([wall(2.0)]), [FAR]))
    assert np.array_equal(kept, blocks_of((3, 5)) | _rim(blocks_of((3, 5))) & kept)
    assert kept[3:5, 3:5].all()
    (all_hits,) = kept_blocks(seen(synthetic.geometry_of([wall(2.0)]), [FAR]), drop=False)
    assert np.array_equal(all_hits, blocks_of((3, 5)))


def test_pictures_that_are_no_whole_blocks() -> None:
    geometry = synthetic.geometry_of([wall(20.0)])
    odd = seen(geometry, [camera(0, 8.0, side=SIDE + 3), camera(1, 4.5, side=5)])
    first, second = kept_blocks(odd)
    assert first.shape == (9, 9)
    assert first.all()
    # Five texels of the near one are all beaten but the outermost.
    assert second.shape == (1, 1)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_of_all_that_see_a_point_the_best_is_kept(scale: float) -> None:
    geometry = synthetic.room_with_box(scale)
    cameras = [
        *synthetic.cube_cameras(scale * np.array([-1.2, -1.0, 1.0]), 256, far=100.0 * scale),
        *synthetic.cube_cameras(scale * np.array([1.0, 1.2, -0.2]), 192, 6, far=100.0 * scale),
    ]
    pictures = seen(geometry, cameras)
    whole = [_of_texels(blocks)[: p.camera.resolution, : p.camera.resolution]
             for blocks, p in zip(kept_blocks(pictures), pictures, strict=True)]  # fmt: skip
    dropped = sum(int((~w & (p.depth > 0.0)).sum()) for w, p in zip(whole, pictures, strict=True))
    assert dropped > 0.04 * sum(picture.depth.size for picture in pictures)
    for index, picture in enumerate(pictures):
        gone = ~whole[index] & (picture.depth > 0.0)
        points = _points(picture)[gone]
        offered = np.zeros(len(points), dtype=bool)
        for other, other_kept in zip(pictures, whole, strict=True):
            offered |= _shows(other, other_kept, points)
        assert offered.all()


def test_it_says_how_far_it_is() -> None:
    told: list[float] = []
    pictures = seen(synthetic.geometry_of([wall(20.0)]), [FAR, NEAR])
    kept_blocks(pictures, lambda share, _text: told.append(share))
    assert told == [0.0, 0.5]
    kept_blocks(pictures, silent)


def _points(picture: SeenSurface) -> NDArray[np.float64]:
    side = picture.camera.resolution
    centre = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(centre, centre)
    return picture.camera.unproject(np.stack([u, v, picture.depth.astype(np.float64)], axis=-1))


def _of_texels(blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)


def _rim(blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Blocks beside these: where a texel of these is the outermost, they stay whole."""
    wide = np.pad(blocks, 1)
    around = np.zeros_like(blocks)
    for row in range(3):
        for column in range(3):
            around |= wide[row : row + len(blocks), column : column + len(blocks)]
    return around & ~blocks


def _shows(
    picture: SeenSurface, kept: NDArray[np.bool_], points: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether a kept texel of a picture is the nearest to points, and shows their surface."""
    side = picture.camera.resolution
    u, v, depth = picture.camera.project(points).T
    inside = (depth > 0.0) & (np.abs(u - 0.5) < 0.5) & (np.abs(v - 0.5) < 0.5)
    column, row = (np.clip(np.nan_to_num(x) * side, 0, side - 1).astype(int) for x in (u, v))
    # Walls are seen at slopes of up to 2 from these places: a texel's depth changes by its width
    # times that.
    close = np.abs(picture.depth[row, column] - depth) < 4.0 * depth / side
    return inside & kept[row, column] & close
