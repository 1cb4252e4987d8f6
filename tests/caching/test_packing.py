# SPDX-License-Identifier: GPL-3.0-or-later
"""Channels come out of the packed textures as they went in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.channels import ALL_CHANNELS, CHANNEL_BY_NAME, CHANNELS, MAX_LOBES
from addon.caching.packing import make_packing
from addon.caching.plan import ChannelPlan
from addon.scene.octahedral import from_codes, from_words, to_codes, to_words

SIDE = 16


def random_channels(plan: ChannelPlan, seed: int = 3) -> dict[str, NDArray[np.float32]]:
    rng = np.random.default_rng(seed)
    channels = {}
    for name in plan.stored:
        values: NDArray[Any] = rng.random((SIDE, SIDE, plan.components(name)))
        if CHANNEL_BY_NAME[name].is_direction:
            values -= 0.5
            values /= np.linalg.norm(values, axis=-1, keepdims=True)
        if name == "material_id":
            values = rng.integers(1, len(plan.material_names) + 1, values.shape)
        channels[name] = values.astype(np.float32)
    return channels


@pytest.mark.parametrize("lobes", [1, MAX_LOBES])
def test_every_component_has_one_place(lobes: int) -> None:
    table = CHANNELS if lobes == 1 else ALL_CHANNELS
    plan = ChannelPlan(tuple(c.name for c in table), {}, ("a", "b"), lobes=lobes)
    packing = make_packing(plan)
    components = [c for texture in packing.textures for c in texture.components]
    expected = [
        (c.name, index)
        for c in table
        if c.name != "depth"
        for index in range(2 if c.is_direction else c.components)
    ]
    assert sorted(components) == sorted(expected)
    for texture in packing.textures:
        size = {"8": 1, "16": 2, "16F": 2, "32F": 4}[texture.texture_format.lstrip("RGBA")]
        assert texture.bytes == texture.width * size
    assert packing.texel_bytes == sum(texture.bytes for texture in packing.textures)


def test_a_plain_scene_takes_few_bytes() -> None:
    stored = ("depth", "material_id", "normal", "diffuse_color", "ambient_occlusion")
    packing = make_packing(ChannelPlan(stored, {}, ("a", "b")))
    # Material, colour and occlusion in five bytes, the normal in four.
    assert [t.texture_format for t in packing.textures] == ["RGBA8", "R8", "RG16"]
    assert packing.texel_bytes == 9


def test_packed_pixels_hold_the_components() -> None:
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color", "specular_f0", "roughness"),
        {}, ("a", "b"), grey=frozenset({"specular_f0"}),
    )  # fmt: skip
    packing = make_packing(plan)
    channels = random_channels(plan)
    largest = np.full((SIDE, SIDE), 2.0, dtype=np.float32)
    for texture in packing.textures:
        pixels = packing.pack(channels, texture, {"diffuse_color": largest, "specular_f0": largest})
        assert pixels.shape == (SIDE, SIDE, texture.width)
        for slot, (name, component) in enumerate(texture.components):
            plane = pixels[..., slot].astype(np.float64)
            if name == "material_id":
                plane *= 255.0
            elif name in ("diffuse_color", "specular_f0"):
                plane = 2.0 * plane**2
            expected: NDArray[Any] = channels[name][..., component]
            if name == "normal":
                expected, plane = to_codes(channels[name])[..., component], plane * 65535.0
            # A root or a quotient and back, in float32.
            assert plane == pytest.approx(expected, rel=4e-7), name


def test_albedos_err_by_half_a_display_step_of_their_brightest() -> None:
    """Eight bits of the root, beside the brightest texel of the material shown at 255."""
    plan = ChannelPlan(("depth", "diffuse_color"), {}, ("a",))
    packing = make_packing(plan)
    brightest = np.float32(0.03)
    values = np.linspace(0.0, brightest, SIDE * SIDE * 3, dtype=np.float32)
    channels = {"diffuse_color": values.reshape(SIDE, SIDE, 3)}
    scale = {"diffuse_color": np.full((SIDE, SIDE), brightest)}
    pixels = packing.pack(channels, packing.textures[0], scale)[..., :3]
    stored = np.rint(pixels * 255.0) / 255.0
    shown, exact = stored, np.sqrt(channels["diffuse_color"] / brightest)
    assert np.abs(shown - exact).max() <= 0.5 / 255.0 + 1e-6


def test_what_is_nearly_closed_keeps_its_share() -> None:
    """Eight bits of the root: the error grows as the share's own root does."""
    packing = make_packing(ChannelPlan(("depth", "ambient_occlusion"), {}, ("a",)))
    share = np.geomspace(1e-5, 1.0, SIDE * SIDE, dtype=np.float32).reshape(SIDE, SIDE, 1)
    pixels = packing.pack({"ambient_occlusion": share}, packing.textures[0], {})
    stored = (np.rint(pixels[..., :1].astype(np.float64) * 255.0) / 255.0) ** 2
    # Half a step, times the slope of the square, and half a step squared.
    assert (np.abs(stored - share) <= np.sqrt(share) / 255.0 + 0.25 / 255.0**2 + 1e-7).all()
    assert stored[-1, -1] == 1.0
    assert "s.ambient_occlusion = t0.x * t0.x;" in packing.glsl({})


def test_unit_vectors_survive_folding() -> None:
    rng = np.random.default_rng(5)
    normal = rng.normal(size=(100_000, 3))
    normal[:6] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    normal[6:10] = [[1.0, 1.0, -1e-9], [-1.0, 1.0, -1e-9], [1.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    exact = normal.astype(np.float32)
    back = from_codes(to_codes(exact))
    assert (back[:6] == exact[:6]).all()
    # Half a step of 1/32767 along both axes moves a point of a face by sqrt(1.5) steps, and faces
    # are as near to the centre as 1 / sqrt(3).
    assert np.linalg.norm(back - exact, axis=1).max() < np.sqrt(4.5) / 32767.0
    assert (from_words(to_words(exact)) == back).all()
    assert (to_codes(np.zeros((1, 3), dtype=np.float32)) == 32767).all()


def test_unknown_channels_are_refused() -> None:
    with pytest.raises(ValueError, match="sparkle"):
        ChannelPlan(("sparkle",), {}, ("a",))
    with pytest.raises(ValueError, match="beyond 1"):
        ChannelPlan(("depth", "roughness_2"), {}, ("a",))


def test_wide_channels_lie_in_float32_textures() -> None:
    wide = [frozenset[str](), frozenset({"diffuse_color"})]
    packing = make_packing(
        ChannelPlan(("depth", "normal", "diffuse_color", "roughness"), {}, ("a",)), wide
    )
    formats = {
        name: texture.texture_format
        for texture in packing.textures
        for name, _ in texture.components
    }
    assert formats == {"normal": "RG16", "roughness": "R16F", "diffuse_color": "RGBA32F"}
    # Not as shares of the largest.
    assert packing.scaled == ()


def test_many_materials_take_more_than_a_byte() -> None:
    names = tuple(str(i) for i in range(256))
    packing = make_packing(ChannelPlan(("depth", "material_id", "normal"), {}, names))
    assert [t.texture_format for t in packing.textures] == ["RGBA16"]
