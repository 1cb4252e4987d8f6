# SPDX-License-Identifier: GPL-3.0-or-later
"""Every light type from a millionth of a metre to a million metres, with grazing normals, of every
radius and energy, against the float64 twin within the bound of `extremes`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.relight.light_points.light_sample import LightSample, light_sample
from addon.relight.lights.light_shape import MOST_RADIANCE, cell_radiance
from addon.scene.light import Light
from addon.scene.mesh_light import mesh_light
from tests.reference import light_pass as twin
from tests.reference.surfaces import Surfaces
from tests.synthetic import looking_at

from .extremes import SPECULAR, Array, Held, Lamps, around, held
from .test_shadow import square

pytestmark = pytest.mark.usefixtures("gpu_context")

COLOR = np.array([1.0, 0.7, 0.2])
PLACE = looking_at((0.0, 0.0, 0.0), (0.2, 0.3, -1.0))
SURFACE = around(1, 24)
MATTE = around(1).without(*SPECULAR)
SIZES = (1e-6, 1e-3, 1.0, 1e3)
ENERGIES = (1e-9, 1e9)


@pytest.fixture(scope="module")
def glossy(gpu_context: None) -> Lamps:
    return Lamps(SURFACE)


@pytest.fixture(scope="module")
def matte(gpu_context: None) -> Lamps:
    return Lamps(MATTE)


def light(kind: Any, energy: float = 100.0, **more: Any) -> Light:
    return Light("l", kind, PLACE, energy, COLOR, **more)


def lambert(surface: Surfaces, one: Light, sample: LightSample) -> Array:
    """(H, W, 3) of surfaces that only have a diffuse base."""
    L, strength, _ = twin.incidence(surface, one, sample)
    NoL = np.maximum(np.sum(surface.channel("normal") * L, axis=-1), 0.0)
    tint = np.ones(3) if sample.emitter is None else sample.emitter.tint
    albedo = surface.channel("diffuse_color") * one.intensity * tint
    return np.asarray((strength * NoL)[..., None] * albedo / np.pi)


def rule_of(lamps: Lamps, one: Light, sample: LightSample) -> Held:
    layer = lambert if lamps.surface is MATTE else twin.light_layer
    reach = 0.0 if one.type == "SUN" else float(np.linalg.norm(sample.position))
    return held(lambda surface: layer(surface, one, sample), lamps.surface, reach)


def check(lamps: Lamps, one: Light, count: int = 1, *, per_receiver: bool = False) -> None:
    for k in range(min(count, 2)):
        sample = light_sample(one, k, count, per_receiver=per_receiver)
        # A ball's light has a step at its own surface, where a few of the places lie.
        is_ball = one.has_disk and not one.use_soft_falloff
        rule_of(lamps, one, sample).assert_holds(lamps.drawn(one, sample), edges=2e-3 * is_ball)


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN"])
def test_lamps_without_extent(glossy: Lamps, kind: str, energy: float) -> None:
    """On lobes from mirrors to chalk, seen and lit at up to 1e-7 from the horizon."""
    check(glossy, light(kind, energy, angle=0.0, spot_size=2.8, spot_blend=0.7))


def test_the_bound_says_something(glossy: Lamps) -> None:
    """Half of what is lit is held to a thousandth: the rest is grazing, or in a narrow lobe."""
    one = light("POINT")
    rule = rule_of(glossy, one, light_sample(one, 0, 1))
    assert rule.share_held_to(1e-3) > 0.5
    assert rule.share_held_to(1e-5) > 0.1


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("soft", [True, False], ids=["disk", "ball"])
@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_lamps_of_every_radius(matte: Lamps, kind: str, soft: bool, count: int) -> None:
    """Surfaces inside and outside of the lamp, on its centre's side of a sample and beyond it."""
    for radius in SIZES:
        check(matte, light(kind, 1e9, shadow_soft_size=radius, use_soft_falloff=soft), count)


@pytest.mark.parametrize("soft", [True, False], ids=["disk", "ball"])
@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_own_points_of_receivers(matte: Lamps, kind: str, soft: bool) -> None:
    for radius in SIZES:
        one = light(kind, 1e-9, shadow_soft_size=radius, use_soft_falloff=soft)
        check(matte, one, 4, per_receiver=True)


@pytest.mark.parametrize("spread", [1.0, 20.0, 179.9, 180.0])
def test_areas_of_every_size(matte: Lamps, spread: float) -> None:
    for size in SIZES:
        one = light("AREA", 1e9, shape="RECTANGLE", size=size, size_y=1e-3 * size,
                    spread=float(np.radians(spread)))  # fmt: skip
        check(matte, one, 4)


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e3])
def test_glowing_triangles_of_every_size(matte: Lamps, size: float) -> None:
    vertices, triangles = square(size, 0.0)
    glow = mesh_light("l", vertices[triangles], np.tile(1e9 * COLOR, (2, 1)))
    check(matte, glow, 4)


@pytest.mark.parametrize("angle", [0.0, 0.01, 30.0, 179.0, 180.0])
def test_suns_of_every_width(matte: Lamps, angle: float) -> None:
    check(matte, light("SUN", 1e-9, angle=float(np.radians(angle))), 4)


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
def test_highlights_of_every_size(glossy: Lamps, kind: str) -> None:
    """What a lobe sees of a whole lamp. Float32 takes it from differences of angles: of the least
    mass that is taken so that leaves 2e-3 (highlight.glsl); where another formula begins a few
    pixels differ by more. At views below 1e-2 one direction says little of a whole cell, in float64
    too: there it is finite, and of a sun no brighter than the sun's own radiance."""
    grazing = np.sum(SURFACE.channel("normal") * SURFACE.toward_viewer, axis=-1) < 1e-2
    for size in SIZES:
        one = light(kind, 1.0, shadow_soft_size=size, size=size, angle=min(size, 3.0),
                    spot_size=2.8)  # fmt: skip
        sample = light_sample(one, 0, 1)
        rule, got = rule_of(glossy, one, sample), glossy.drawn(one, sample)
        bound = rule.bound + 2e-3 * rule.want
        bound[grazing] = np.inf
        replace(rule, bound=bound).assert_holds(got, edges=0.02)
        if kind != "SUN" or size < 1.0:
            continue  # single points of a light, and 1 / d^2, have no such bound
        brightest = one.intensity * cell_radiance(one, 1)
        matte_part = rule_of(glossy, replace(one, specular_factor=0.0), sample).want
        # The lobes' bounces between facets add less than their albedo once more.
        assert (got - 1.01 * matte_part <= 2.0 * brightest).all()


def test_a_radiance_beyond_float32_is_clamped() -> None:
    speck = Light("Speck", "AREA", np.eye(4), 100.0, np.ones(3), size=1e-20)
    assert cell_radiance(speck, 1) == MOST_RADIANCE
