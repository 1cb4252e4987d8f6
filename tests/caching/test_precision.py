# SPDX-License-Identifier: GPL-3.0-or-later
"""Half precision where it holds a channel, float32 where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from addon.caching.precision import ROUNDING, wide_channels


def channel(*texels: float | tuple[float, ...]) -> np.ndarray:
    """(1, N, components)."""
    return np.array(texels, dtype=np.float32).reshape(1, len(texels), -1)


def is_wide(name: str, *texels: float | tuple[float, ...], material: tuple[int, ...] = ()) -> bool:
    channels = {name: channel(*texels)}
    if material:
        channels["material_id"] = channel(*material)
    return name in wide_channels(channels)


@pytest.mark.parametrize("grey", [1e-9, 5e-8, 3.13e-6, 65505.0, 1e9, -1e5])
def test_colors_that_half_loses_are_wide(grey: float) -> None:
    assert is_wide("diffuse_color", (grey, grey, grey), (grey, grey, grey))


@pytest.mark.parametrize("grey", [0.0, 2.0**-24, 6.2e-5, 1e-3, 0.18, 1.0, 300.1, 65504.0])
def test_what_half_holds_is_not(grey: float) -> None:
    assert not is_wide("diffuse_color", (grey, grey, grey), (0.0, 0.0, 0.0))
    held = float(np.float32(np.float16(np.float32(grey))))
    assert abs(held - grey) <= ROUNDING * grey * (1.0 + 1e-6)  # grey itself is rounded here


def test_a_component_that_is_nothing_beside_another_is_none() -> None:
    assert not is_wide("diffuse_color", (0.8, 1e-7, 0.0))
    assert is_wide("diffuse_color", (1e-7, 1e-7, 0.0))


def test_a_black_corner_of_a_bright_texture_is_none_but_a_black_material_is() -> None:
    bright, dark = (0.8, 0.8, 0.8), (1e-7, 1e-7, 1e-7)
    assert not is_wide("diffuse_color", bright, dark, material=(1, 1))
    assert is_wide("diffuse_color", bright, dark, material=(1, 2))


@pytest.mark.parametrize("name", ["roughness", "ambient_occlusion"])
def test_shares_are_measured_against_one(name: str) -> None:
    assert not is_wide(name, 1e-7, 3e-6)
    assert is_wide(name, 1e6)


def test_normals_are_measured_against_one() -> None:
    assert not is_wide("normal", (1e-7, 3e-6, 1.0), (0.0, 0.0, 0.0))


def test_material_numbers_are_exact() -> None:
    assert not is_wide("material_id", *range(2049))
    assert is_wide("material_id", 0, 2049)


def test_what_is_float32_anyway_is_not_wide() -> None:
    assert not wide_channels({"depth": channel(1e9)})
