# SPDX-License-Identifier: GPL-3.0-or-later
"""What the caching benchmark works out from what it measured."""

from __future__ import annotations

import math

import pytest

from benchmarks.caching_figures import (
    Bound,
    FrameTime,
    MadeTexture,
    loss_db,
    shortfalls,
    size_bounds,
    texel_bytes,
)


@pytest.mark.parametrize(
    ("texture_format", "size"),
    [
        ("R8", 1),
        ("RG8", 2),
        ("R16F", 2),
        ("R32F", 4),
        ("RGBA8", 4),
        ("RGBA8UI", 4),
        ("SRGB8_A8", 4),
        ("RGB10_A2", 4),
        ("R11F_G11F_B10F", 4),
        ("RG16_SNORM", 4),
        ("R32UI", 4),
        ("RGBA16F", 8),
        ("RG32F", 8),
        ("RGBA32F", 16),
    ],
)
def test_bytes_of_a_texel(texture_format: str, size: int) -> None:
    assert texel_bytes(texture_format) == size
    assert MadeTexture(5, 3, 2, texture_format).size == 30 * size


@pytest.mark.parametrize("name", ["", "DEPTH24_STENCIL8", "RGBA", "RGBA64F", "R16FF"])
def test_an_unknown_format_is_no_guess(name: str) -> None:
    with pytest.raises(ValueError, match="texture format"):
        texel_bytes(name)


def test_a_frame_is_extrapolated_on_a_line() -> None:
    line = FrameTime.through({2: 10.0, 6: 18.0})
    assert (line.fixed, line.sample) == (6.0, 2.0)
    assert line.at(256) == 6.0 + 512.0
    # What was measured in between only adds; the ends say the line.
    assert FrameTime.through({2: 10.0, 4: 99.0, 6: 18.0}) == line


def test_a_disturbed_measurement_gives_no_negative_time() -> None:
    assert FrameTime.through({2: 4.0, 6: 20.0}) == FrameTime(0.0, 4.0)
    assert FrameTime.through({2: 9.0, 6: 8.0}) == FrameTime(9.0, 0.0)
    with pytest.raises(ValueError, match="two numbers"):
        FrameTime.through({2: 4.0})


def test_loss() -> None:
    assert loss_db(40.0, 39.9) == pytest.approx(0.1)
    assert loss_db(39.9, 40.0) < 0.0
    assert loss_db(math.inf, math.inf) == 0.0
    assert loss_db(math.inf, 40.0) == math.inf


def test_bounds_are_kept_at_their_ends() -> None:
    assert Bound("", 6.0, 6.0, at_least=True).kept
    assert not Bound("", 5.99, 6.0, at_least=True).kept
    assert Bound("", 0.2, 0.2, at_least=False).kept
    assert not Bound("", 0.21, 0.2, at_least=False).kept
    assert not Bound("", math.nan, 0.2, at_least=False).kept
    assert not Bound("", math.nan, 6.0, at_least=True).kept


def test_sizes_are_held_against_all_channels_in_float32() -> None:
    bounds = size_bounds(1200, disk=100, gpu=300, preset="draft")
    assert [bound.value for bound in bounds] == [12.0, 4.0]
    assert shortfalls(bounds) == ["times smaller on the GPU: 4, not at least 6"]
    assert [b.name for b in size_bounds(1200, 1, None, "balanced")] == ["times smaller on disk"]


def test_a_balanced_cache_fits_a_gibibyte() -> None:
    most = 1 << 30
    for preset, gpu, short in (
        ("balanced", most, False),
        ("balanced", most + 1, True),
        ("final", most + 1, False),
    ):
        bounds = size_bounds(100 * most, 1, gpu, preset)
        assert any("bytes on the GPU" in text for text in shortfalls(bounds)) is short
