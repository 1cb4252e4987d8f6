# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks are numbered without gaps, places never overlap, and pages fit the GPU."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addon.corrmap.tile_layout import BLOCK, BlockNumbers, PageShape, block_table, page_shape
from addon.errors import InputError


@given(st.lists(st.sampled_from([1, 2, 15, 16, 17, 64]), min_size=1, max_size=20))
def test_blocks_are_numbered_without_gaps(resolutions: list[int]) -> None:
    numbers = BlockNumbers(tuple(resolutions))
    spans = [numbers.of(picture) for picture in range(len(resolutions))]
    assert [number for span in spans for number in range(span.start, span.stop)] == list(
        range(numbers.count)
    )
    for across, resolution in zip(numbers.across, resolutions, strict=True):
        assert (across - 1) * BLOCK < resolution <= across * BLOCK


def test_a_picture_without_texels_is_refused() -> None:
    with pytest.raises(ValueError, match="texel"):
        BlockNumbers((64, 0))


@settings(deadline=None)  # a busy machine may be slow
@given(st.integers(1, 40_000), st.sampled_from([4, 256, 2048]))
def test_pages_hold_all_blocks_and_few_more(blocks: int, most_pages: int) -> None:
    shape = page_shape(blocks, 16384, most_pages)
    assert blocks <= shape.places
    assert shape.count <= most_pages
    assert shape.side <= 16384
    # No page too many.
    assert shape.places - blocks < shape.side**2 // BLOCK**2
    corners = shape.corners(np.arange(shape.places))
    # As one number each: numpy takes long to compare rows.
    assert len(np.unique(corners @ [shape.side**2, 1, shape.side])) == shape.places
    assert (corners % [1, BLOCK, BLOCK] == 0).all()
    assert corners.max(axis=0).tolist() == [
        shape.count - 1,
        shape.side - BLOCK,
        shape.side - BLOCK,
    ]


def test_more_blocks_than_the_gpu_holds_are_refused() -> None:
    # 64 x 64 blocks on each of 2 pages.
    assert page_shape(2 * 64**2, 1024, 2) == PageShape(6, 2)
    with pytest.raises(InputError, match="place fewer cameras or bake at a lower preset"):
        page_shape(2 * 64**2 + 1, 1024, 2)


def test_the_table_holds_places_by_number() -> None:
    places = np.arange(5000)
    table = block_table(places, places[::-1])
    assert table.dtype == np.float32
    flat = table.reshape(-1, 2)
    assert np.array_equal(flat[:5000], np.stack([places, places[::-1]], axis=1))
    assert (flat[5000:] == -1.0).all()


def test_a_map_reads_the_blocks_of_its_footprints() -> None:
    numbers = BlockNumbers((64, 32))
    # The middle of block (1, 2) of picture 0; half a texel left of block (1, 1) of picture 1, at
    # its very bottom; and a hole.
    found = np.array(
        [[0, 24.0 / 64, 40.0 / 64, 1], [1, 15.7 / 32, 0.0, 1], [-1, 0.5, 0.5, 0]], dtype=np.float32
    )
    shown = numbers.shown(found[None])
    assert np.flatnonzero(shown).tolist() == [2 * 4 + 1, 16 + 0, 16 + 1]


def test_a_footprint_at_a_corner_reads_four_blocks() -> None:
    numbers = BlockNumbers((32,))
    found = np.array([[0, 0.5, 0.5, 1]], dtype=np.float32)
    assert numbers.shown(found[None]).all()
