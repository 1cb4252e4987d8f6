# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of lights of 1e-9 W and 1e9 W in one picture: each is exact by itself, and their sum is
to its own last digits; however light is amplified, nothing is infinite."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.glsl.shader import read_texture, texture_from_array
from addon.relight.layers.light_mix import LightMix, MixPart
from addon.relight.layers.sum_pass import Addend, SumPass
from addon.relight.lights.light_edit import layer_scale, layer_tint
from addon.scene.light import Light
from addon.scene.light_controls import Falloff, LightControls, ShadowControls
from tests.synthetic import box, cube_cameras, geometry_of, looking_at, perspective_view

from .drawing import drawn
from .extremes import SPACING
from .test_session import make_store, open_session, point_light

pytestmark = pytest.mark.usefixtures("gpu_context")

ENERGIES = (1e-9, 1.0, 1e9)


@pytest.fixture(scope="module")
def room() -> Any:
    floor = np.array([[-2.0, -2, -1], [2.0, -2, -1], [2.0, 2, -1], [-2.0, 2, -1]])
    geometry = geometry_of([(floor, np.array([[0, 1, 2], [0, 2, 3]])), box((0.2, 0.1, -0.2), 0.6)])
    store = make_store(geometry, cube_cameras((-1.2, -1.0, 1.0), 64))
    view = perspective_view(looking_at((-1.5, -1.6, 0.9), (0.3, 0.2, -0.6)), 48, 36, 1.2)
    return geometry, store, view


def lamps(energies: tuple[float, ...] = ENERGIES) -> list[Light]:
    places = ((0.0, -0.5, 1.5), (1.0, 0.5, 1.2), (-1.0, 0.5, 2.0))
    return [
        replace(point_light(f"l{k}", place, energy), color=np.array([1.0, 0.5, 0.1]))
        for k, (place, energy) in enumerate(zip(places, energies, strict=True))
    ]


def test_sums_of_every_size() -> None:
    """A product and a sum round once for each addend, of the sum of all sizes."""
    rng = np.random.default_rng(3)
    layers = (10.0 ** rng.uniform(-9.0, 9.0, (20, 16, 16, 4))).astype(np.float32)
    factors = np.array([np.float32(10.0**p) for p in rng.uniform(-9.0, 9.0, 20)])
    addends = [
        Addend(texture_from_array(layer, "RGBA32F"), (float(f),) * 4)
        for layer, f in zip(layers, factors, strict=True)
    ]
    got = drawn(16, 16, lambda target: SumPass().draw(addends, target))
    terms = layers.astype(np.float64) * factors.astype(np.float64)[:, None, None, None]
    assert (
        np.abs(got - terms.sum(axis=0)) <= (len(terms) + 1) * 0.5 * SPACING * terms.sum(0)
    ).all()


def test_a_kept_sum_of_every_size() -> None:
    """One layer changes again and again, from 1e-9 to 1e9 and back: nothing of it stays."""
    rng = np.random.default_rng(5)
    textures = [
        texture_from_array(rng.random((8, 8, 4)).astype(np.float32), "RGBA32F") for _ in range(5)
    ]
    values = np.array([read_texture(each) for each in textures], dtype=np.float64)
    mix = LightMix()
    for turn in range(60):
        factors = np.ones(5)
        factors[turn // 10 % 5] = 10.0 ** ((-1) ** turn * 9)
        parts = {
            str(k): MixPart((texture,), (float(factor),) * 4, 1, (k, 1))
            for k, (texture, factor) in enumerate(zip(textures, factors, strict=True))
        }
        got = read_texture(mix.draw(parts, 8, 8))
        want = np.einsum("khwc,k->hwc", values, factors)
        assert (np.abs(got - want) <= 6.0 * SPACING * want).all()
        assert turn % 10 < 2 or mix.hot == str(turn // 10 % 5)


def test_a_kept_sum_sees_other_contents() -> None:
    """While one layer's factor is edited, another is drawn again: with the same factor."""
    mix, value = LightMix(), np.ones(4)
    for turn in range(12):
        value[1] = float(1 + turn // 4)
        factor = np.array([turn + 1.0, 1.0, 1.0, 1.0])
        parts = {}
        for k in range(4):
            texture = texture_from_array(np.full((4, 4, 4), value[k], dtype=np.float32), "RGBA32F")
            parts[str(k)] = MixPart((texture,), (float(factor[k]),) * 4, 1, (k, int(value[k])))
        # Whole numbers: exact.
        assert (read_texture(mix.draw(parts, 4, 4)) == value @ factor).all()


def test_a_sum_is_kept_for_the_one_layer_that_changes() -> None:
    """Two that change at once leave none; neither does the first picture, nor one of two layers."""
    texture = texture_from_array(np.ones((4, 4, 4), dtype=np.float32), "RGBA32F")

    def drawn(mix: LightMix, *factors: float) -> str:
        parts = {
            str(k): MixPart((texture,), (factor,) * 4, 1, (k, 1))
            for k, factor in enumerate(factors)
        }
        assert (read_texture(mix.draw(parts, 4, 4)) == sum(factors)).all()
        return mix.hot

    mix = LightMix()
    assert drawn(mix, 1.0, 1.0, 1.0, 1.0) == ""
    assert drawn(mix, 2.0, 3.0, 1.0, 1.0) == ""
    assert drawn(mix, 2.0, 4.0, 1.0, 1.0) == "1"
    assert drawn(mix, 5.0, 4.0, 7.0, 1.0) == ""
    assert drawn(mix, 5.0, 4.0, 7.0) == ""
    assert drawn(mix, 5.0, 4.0, 8.0) == "2"
    two = LightMix()
    assert drawn(two, 1.0, 1.0) == ""
    assert drawn(two, 2.0, 1.0) == ""


@pytest.mark.parametrize("fill", [(0.0, 0.0, 0.0), (0.1, 0.2, 0.5)])
@pytest.mark.parametrize("energy", ENERGIES)
def test_scale_and_tint_are_the_intensity(energy: float, fill: tuple[float, float, float]) -> None:
    controls = LightControls(shadow=ShadowControls(color=fill))
    light = replace(lamps((energy, energy, energy))[0], controls=controls, exposure=3.0)
    np.testing.assert_allclose(layer_scale(light) * layer_tint(light), light.intensity, rtol=1e-15)
    # A layer holds numbers of about one, whatever the lamp.
    assert layer_tint(light).max() == 1.0


def test_one_picture_of_dark_and_bright_lights(room: Any) -> None:
    """Each layer is the one of a plain lamp times its energy; the picture is their sum."""
    session = open_session(room, 2)
    session.set_lights(lamps((1.0, 1.0, 1.0)))
    plain = session.render()
    session.set_lights(lamps())
    picture = session.render()
    total: NDArray[np.float64] = np.zeros(picture.combined[..., :3].shape)
    for light, energy in zip(lamps(), ENERGIES, strict=True):
        layer = picture.layers[light.name].astype(np.float64)
        assert layer.any()
        np.testing.assert_allclose(layer, plain.layers[light.name] * energy, rtol=4 * SPACING)
        total += layer
    np.testing.assert_allclose(picture.combined[..., :3], total, rtol=8 * SPACING)
    # Alone, the dark one is shown with all its digits.
    session.set_lights([replace(lamps()[0], solo=True), *lamps()[1:]])
    alone = session.render().combined[..., :3]
    np.testing.assert_allclose(alone, picture.layers["l0"], rtol=4 * SPACING)


def test_nothing_is_infinite(room: Any) -> None:
    """A lamp of 1e9 W that stands on the floor, with a falloff by the tenth power; muted, it is
    gone."""
    controls = LightControls(falloff=Falloff(10.0, 1e6))
    strong = replace(point_light("s", (0.5, -0.5, -1.0 + 1e-6), 1e9), controls=controls)
    session = open_session(room, 2)
    session.set_lights([strong, lamps()[0]])
    picture = session.render()
    assert np.isfinite(picture.combined).all()
    assert picture.layers["s"].max() > 1e20
    session.set_lights([replace(strong, mute=True), lamps()[0]])
    picture = session.render()
    np.testing.assert_allclose(picture.combined[..., :3], picture.layers["l0"], rtol=4 * SPACING)
