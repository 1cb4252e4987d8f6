# SPDX-License-Identifier: GPL-3.0-or-later
"""The pyramids of many pictures lie side by side in one texture, and are read from there."""

from __future__ import annotations

import numpy as np
import pytest

from addon.corrmap import candidate_cameras, depth_ranges
from addon.corrmap.depth_ranges import DepthRanges, range_places
from addon.corrmap.tile_layout import BlockNumbers, block_numbers
from addon.errors import InputError
from tests.corrmap.test_candidate_cameras import maps, random_cameras, room_pictures, room_view

# As most GPUs have it.
SIDE = 16384


def heights_of(numbers: BlockNumbers) -> np.ndarray:
    """(N,) rows of each picture's pyramid: of a side of 2^n blocks, (4^(n+1) - 1) / 3 texels."""
    levels = np.ceil(np.log2(numbers.across)).astype(int)
    return -(-((4 ** (levels + 1) - 1) // 3) // 512)


@pytest.mark.parametrize(
    ("resolution", "count", "columns"),
    [(2048, 381, 1), (2048, 382, 2), (2048, 1000, 3), (1024, 1490, 2), (16, SIDE, 1)],
)
def test_hundreds_of_large_pictures_have_room(
    monkeypatch: pytest.MonkeyPatch, resolution: int, count: int, columns: int
) -> None:
    monkeypatch.setattr(depth_ranges, "max_texture_width", lambda: SIDE)
    numbers = BlockNumbers((resolution,) * count)
    column, row = range_places(numbers).T
    assert column.max() + 1 == columns
    check_apart(column, row, heights_of(numbers), SIDE)


def test_pictures_of_all_sizes_have_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depth_ranges, "max_texture_width", lambda: SIDE)
    sizes = np.random.default_rng(2).choice([16, 100, 256, 1040, 2048], 2000)
    numbers = BlockNumbers(tuple(int(size) for size in sizes))
    column, row = range_places(numbers).T
    assert column.max() > 0
    check_apart(column, row, heights_of(numbers), SIDE)


def check_apart(column: np.ndarray, row: np.ndarray, heights: np.ndarray, side: int) -> None:
    """No pyramid lies over another or outside, and columns are about equally long."""
    ends = (row + heights)[np.append(np.flatnonzero(np.diff(column)), len(column) - 1)]
    assert ends.max() <= side
    assert np.ptp(ends) <= heights.max() + len(ends)
    taken = np.concatenate(
        [c * side + np.arange(r, r + h) for c, r, h in zip(column, row, heights, strict=True)]
    )
    assert len(np.unique(taken)) == len(taken)


def test_what_has_no_room_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depth_ranges, "max_texture_width", lambda: 1024)
    # 43 rows each: 23 of them fit a column.
    assert len(range_places(BlockNumbers((2048,) * 46))) == 46
    with pytest.raises(InputError, match=r"has 48 pictures.*place fewer cameras or bake at a low"):
        range_places(BlockNumbers((2048,) * 48))


def test_more_blocks_than_numbers_are_refused() -> None:
    assert block_numbers((2048,) * 1024).count == 1 << 24
    with pytest.raises(InputError, match=r"has 1025 pictures.*place fewer cameras or bake at a lo"):
        block_numbers((2048,) * 1025)


def test_more_pyramids_than_a_texture_has_rows(gpu_context: None) -> None:
    """As many pictures as need a second column on this GPU; each holds its own number."""
    from addon.glsl.shader import max_texture_width, read_texture

    ranges = DepthRanges()
    count = 3 * max_texture_width() // 2
    for number in range(count):
        # What `put` does, without forgetting those behind, which takes long of so many.
        ranges._pyramids[number] = np.full((1, 2), number, dtype=np.float32)
    texels = read_texture(ranges.texture())
    column, row = range_places(BlockNumbers((16,) * count)).T
    assert column.max() == 1
    assert texels.shape[1] == 1024
    np.testing.assert_array_equal(texels[row, 512 * column, 0], np.arange(count))


def test_lists_read_every_column(gpu_context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a GPU whose textures would have 64 rows, of 8 texels in a column."""
    pictures, view = room_pictures(random_cameras(60)), room_view()
    listed, whole = maps(pictures, view)
    assert np.array_equal(listed, whole)
    monkeypatch.setattr(depth_ranges, "RANGE_BITS", 3)
    monkeypatch.setattr(depth_ranges, "max_texture_width", lambda: 64)
    monkeypatch.setattr(candidate_cameras, "RANGE_DEFINES", (("RANGE_BITS", "3"),))
    numbers = BlockNumbers(tuple(picture.camera.resolution for picture in pictures))
    assert len(np.unique(range_places(numbers)[:, 0])) > 1
    again, _ = maps(pictures, view)
    assert np.array_equal(again, listed)
