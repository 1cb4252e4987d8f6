# SPDX-License-Identifier: GPL-3.0-or-later
"""Channels come out of the packed textures as they went in."""

from __future__ import annotations

import numpy as np
import pytest

from addon.caching.channels import CHANNEL_BY_NAME, CHANNELS
from addon.caching.packing import make_packing


def test_every_component_has_one_place() -> None:
    stored = tuple(channel.name for channel in CHANNELS)
    packing = make_packing(stored, {})
    components = [c for texture in packing.textures for c in texture.components]
    expected = [(c.name, i) for c in CHANNELS if c.name != "depth" for i in range(c.components)]
    assert sorted(components) == sorted(expected)
    for texture in packing.textures:
        precisions = {CHANNEL_BY_NAME[name].precision for name, _ in texture.components}
        assert precisions == {"float32" if texture.texture_format == "RGBA32F" else "half"}


def test_packed_pixels_hold_the_components() -> None:
    packing = make_packing(("depth", "normal", "diffuse_color", "roughness"), {})
    rng = np.random.default_rng(3)
    channels = {
        name: rng.random((4, 4, CHANNEL_BY_NAME[name].components), dtype=np.float32)
        for name in packing.stored
    }
    for texture in packing.textures:
        pixels = packing.pack(channels, texture)
        for slot, (name, component) in enumerate(texture.components):
            assert np.array_equal(pixels[..., slot], channels[name][..., component])


def test_constants_are_written_into_the_shader() -> None:
    packing = make_packing(("depth", "normal"), {"roughness": (0.25,), "layer_f0": (3.0,)})
    text = packing.glsl()
    assert "s.roughness = 0.25;" in text
    assert "s.layer_f0 = 3.0;" in text
    # What the scene does not need has its neutral value.
    assert "s.emission = vec3(0.0, 0.0, 0.0);" in text
    assert "s.ambient_occlusion = 1.0;" in text


def test_unknown_channels_are_refused() -> None:
    with pytest.raises(KeyError, match="sparkle"):
        make_packing(("sparkle",), {})


def test_wide_channels_lie_in_float32_textures() -> None:
    wide = [frozenset[str](), frozenset({"diffuse_color"})]
    packing = make_packing(("depth", "normal", "diffuse_color", "roughness"), {}, wide)
    formats = {
        name: texture.texture_format
        for texture in packing.textures
        for name, _ in texture.components
    }
    assert formats == {"normal": "RGBA16F", "roughness": "RGBA16F", "diffuse_color": "RGBA32F"}
    # The shader reads them from where they lie now.
    assert "s.diffuse_color = vec3(texels[1].x, texels[1].y, texels[1].z);" in packing.glsl()
