# SPDX-License-Identifier: GPL-3.0-or-later
"""The profile filter against its float64 twin."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from addon.scene.light_profile import LightProfile
from tests.reference.light_profile import over_area as over_area_of
from tests.reference.light_profile import profile
from tests.reference.surfaces import surfaces
from tests.synthetic import looking_at

from .drawing import drawn_light

pytestmark = pytest.mark.usefixtures("gpu_context")

PIXELS = np.random.default_rng(3).random((9, 12, 3)).astype(np.float32)
PROFILES = {
    "around": LightProfile(PIXELS),
    "across": LightProfile(PIXELS, half_width=0.7),
    "linear": LightProfile(PIXELS, exponent=1.0),
    "constant, smooth": LightProfile(PIXELS, half_width=2.0, exponent=2.0, smooth=0.5),
}


@pytest.mark.parametrize("radius", [0.0, 0.2])
@pytest.mark.parametrize("name", PROFILES)
def test_the_filter_is_its_twin(name: str, radius: float) -> None:
    """Software OpenGL has atan and asin to 2e-4 radians, a 2500th of these texels; pictures
    across the beam have no need of them."""
    place = looking_at((0.3, -0.2, 2.0), (0.1, 0.4, -1.0))
    light = Light("l", "POINT", place, 1.0, np.ones(3), shadow_soft_size=radius)
    rng = np.random.default_rng(5)
    lit = rng.normal(size=(32, 32, 3)) * np.exp(rng.normal(size=(32, 32, 1)))
    lit = (light.position + lit).astype(np.float32).astype(np.float64)
    sample = light_sample(light, 0, 2 if radius else 1)
    normal = sample.position - lit
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    surface = surfaces(lit, normal, eye=(0.0, 0.0, 0.0))
    surface = replace(surface, eye=light.position + normal[0, 0], perspective=True)
    plain = drawn_light(surface, light, [sample])[..., :3]
    shaped = replace(light, profile=PROFILES[name])
    assert (plain > 0.0).all()
    got = drawn_light(surface, shaped, [sample])[..., :3] / plain
    want = profile(shaped, lit, sample.position)
    white = replace(shaped, profile=replace(PROFILES[name], pixels=np.ones_like(PIXELS)))
    gain = profile(white, lit, sample.position)
    tolerance = 1e-5 if PROFILES[name].half_width else 1e-3
    assert (np.abs(got - want) <= tolerance * np.maximum(gain, 1e-30)).all()


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_it_is_finite_at_every_distance(size: float) -> None:
    light = Light("l", "POINT", np.eye(4), 1.0, np.ones(3))
    lit: Any = np.array([[[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]]) * size
    surface = surfaces(lit, -lit / size, eye=(0.0, 0.0, 0.0))
    surface = replace(surface, eye=np.array([0.0, 0.0, 0.5]), perspective=True)
    for own in PROFILES.values():
        shaped = replace(light, profile=own)
        assert np.isfinite(drawn_light(surface, shaped, [light_sample(light, 0, 1)])).all()


@pytest.mark.parametrize("count", [1, 2, 3, 5, 64, 5000])
def test_places_of_an_area_light_are_their_twin(count: int) -> None:
    """Float32 texels, over a pyramid of them."""
    place = looking_at((0.3, -0.2, 2.0), (0.1, 0.4, -1.0)) @ np.diag([-1.0, 1.5, 1.0, 1.0])
    over_area = np.random.default_rng(6).random((16, 16, 3)).astype(np.float32)
    own = LightProfile(np.ones((1, 1, 3), dtype=np.float32), over_area=over_area)
    light = Light("l", "AREA", place, 1.0, np.ones(3), shape="RECTANGLE", size=0.8, size_y=0.5)
    lit = np.array([[[0.1, 0.2, -1.0], [0.5, 0.1, -0.5]]])
    for k in range(min(count, 4)):
        sample = light_sample(light, k, count)
        normal = sample.position - lit
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        surface = surfaces(lit, normal, eye=(0.0, 0.0, 0.0))
        surface = replace(surface, eye=light.position + normal[0, 0], perspective=True)
        plain = drawn_light(surface, light, [sample])[..., :3]
        got = drawn_light(surface, replace(light, profile=own), [sample])[..., :3]
        want = plain * over_area_of(replace(light, profile=own), sample.position, count)
        assert (plain > 0.0).all()
        np.testing.assert_allclose(got, want, rtol=1e-4)


def test_profiles_compile_for_traced_shadows() -> None:
    """The pass that sends rays asks the same filters, with less around them."""
    from addon.relight.lights.light_reach import ReachPass

    lit = np.array([[[0.0, 0.0, -1.0]]])
    surface = surfaces(lit, np.array([[[0.0, 0.0, 1.0]]]), eye=(0.0, 0.0, 0.0))
    for own in (*PROFILES.values(), LightProfile(PIXELS, over_area=np.ones((2, 2, 3), "f4"))):
        kind: Any = "POINT" if own.over_area is None else "AREA"
        light = Light("l", kind, np.eye(4), 1.0, np.ones(3), profile=own)
        reach = ReachPass().draw(surface.upload(), light, light_sample(light, 0, 1))
        np.testing.assert_allclose(reach[0, 0], (0.0, 0.0, 1.0, 1.0), atol=1e-6)
