# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures that the GPU cannot have."""

from __future__ import annotations

import pytest

from addon.errors import InputError
from addon.glsl.shader import max_texture_width, texture_2d


@pytest.mark.parametrize("size", [(100_000, 4), (4, 100_000)])
def test_a_picture_larger_than_any_texture(gpu_context: None, size: tuple[int, int]) -> None:
    assert max_texture_width() < 100_000
    with pytest.raises(InputError, match=f"at most {max_texture_width()} .* {size[0]}x{size[1]}"):
        texture_2d(*size)
