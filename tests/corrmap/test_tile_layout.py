# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles never overlap, and never leave their page."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addon.corrmap.tile_layout import lay_out_tiles


@given(st.lists(st.sampled_from([1, 2, 3, 4, 7, 8, 16]), min_size=1, max_size=40))
def test_tiles_do_not_overlap(resolutions: list[int]) -> None:
    layout = lay_out_tiles(resolutions)
    used = np.zeros((layout.page_count, layout.page_size, layout.page_size), dtype=int)
    for index, size in enumerate(resolutions):
        x, y = layout.corner[index]
        assert x + size <= layout.page_size
        assert y + size <= layout.page_size
        used[layout.page[index], y : y + size, x : x + size] += 1
    assert used.max() == 1


def test_powers_of_two_leave_no_gap() -> None:
    layout = lay_out_tiles([256, 512, 256, 256, 256, 512, 512])
    assert (layout.page_size, layout.page_count) == (512, 4)


def test_an_empty_tile_is_refused() -> None:
    with pytest.raises(ValueError, match="texel"):
        lay_out_tiles([64, 0])
