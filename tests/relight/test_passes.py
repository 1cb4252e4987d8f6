# SPDX-License-Identifier: GPL-3.0-or-later
"""Every pass against its float64 twin, on random surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.glsl.shader import texture_from_array
from addon.relight.layers.sum_pass import Addend, SumPass
from addon.relight.light_points.light_sample import light_sample
from addon.relight.lights.light_shape import has_extent
from addon.relight.shading.surface_pass import EmissionPass
from addon.relight.world.world_light import prepare_world
from addon.relight.world.world_pass import AmbientPass, BackgroundPass, WorldTextures
from addon.scene.light import Light
from addon.scene.world import World
from tests.reference import light_pass as light_twin
from tests.reference import world_pass as world_twin
from tests.reference.surfaces import random_surfaces
from tests.synthetic import looking_at, perspective_view

from .drawing import TABLES, drawn, drawn_light

pytestmark = pytest.mark.usefixtures("gpu_context")

SURFACES = random_surfaces(1)


def placed(scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> NDArray[np.float64]:
    """A light above the random surfaces that looks into them, mirrored or stretched."""
    world_from_light = looking_at((1.0, -1.5, 3.0), (0.0, 0.0, 0.0))
    world_from_light[:3, :3] *= scale
    world_from_light[:3, 3] += SURFACES.origin
    return world_from_light


COLOR = np.array([1.0, 0.7, 0.2])
LIGHTS = {
    "point": Light("l", "POINT", placed(), 100.0, COLOR),
    "point, disk": Light("l", "POINT", placed(), 100.0, COLOR, shadow_soft_size=0.5),
    "point, sphere around some": Light(
        "l", "POINT", placed(), 100.0, COLOR, shadow_soft_size=2.5, use_soft_falloff=False
    ),
    "spot": Light("l", "SPOT", placed(), 100.0, COLOR, spot_size=1.0, spot_blend=0.4),
    "spot, soft": Light(
        "l", "SPOT", placed(), 100.0, COLOR, spot_size=1.0, spot_blend=0.4, shadow_soft_size=0.6
    ),
    "spot, hard": Light("l", "SPOT", placed(), 100.0, COLOR, spot_size=2.5, spot_blend=0.0),
    "spot, stretched and mirrored": Light(
        "l", "SPOT", placed((2.0, -0.7, 1.3)), 100.0, COLOR, spot_size=0.8, spot_blend=1.0
    ),
    "sun": Light("l", "SUN", placed(), 3.0, COLOR, angle=0.0),
    "sun, wide": Light("l", "SUN", placed(), 3.0, COLOR, angle=0.3, exposure=1.5),
    "area": Light("l", "AREA", placed(), 100.0, COLOR, size=0.8, specular_factor=0.0),
    "area, spread": Light(
        "l", "AREA", placed((1, 2, 1)), 100.0, COLOR, shape="ELLIPSE", size_y=0.3, spread=1.5,
        diffuse_factor=0.0,
    ),
    "tiny energy": Light("l", "POINT", placed(), 1e-9, COLOR),
    "huge energy": Light("l", "POINT", placed(), 1e9, COLOR, shadow_soft_size=0.1),
}  # fmt: skip


OF_CELLS = (2e-5, 1e-2)


def assert_close(
    got: NDArray[np.float64],
    want: NDArray[np.float64],
    median: float = 5e-6,
    tolerance: float = 2e-3,
) -> None:
    """Float32 against float64.

    A narrow lobe turns the 1e-7 by which float32 unit vectors are off into 1e-7 / alpha of its
    value twice over; alpha is 4e-4 and more here (roughness 0.02), which is 5e-4. One pixel in
    a thousand may be on the other side of an edge (a hard cone, a horizon).

    OF_CELLS: of a cell of a light, angles that are rounded by 1e-7 are subtracted until 1e-4 is
    left of them
    and of their moments, which are subtracted again; where a cone fades that
    is squared.
    """
    assert np.isfinite(got).all()
    scale = np.abs(want).max(axis=-1, keepdims=True)
    floor = 1e-6 * np.median(scale[scale > 0.0]) if want.any() else 0.0
    wrong = (np.abs(got - want) > tolerance * scale + floor).any(axis=-1)
    assert wrong.mean() < 1e-3, f"{wrong.sum()} pixels are off"
    if want.any():
        assert np.median(np.abs(got - want)[want > 0.0] / want[want > 0.0]) < median


SPECULAR = ("specular_f0", "specular_f90", "layer_f0", "layer_f90", "dielectric", "roughness")


@pytest.mark.parametrize("kind", ["plain", "diffuse", "two lobes"])
@pytest.mark.parametrize("name", LIGHTS)
def test_light_pass(name: str, kind: str) -> None:
    light = LIGHTS[name]
    for perspective, count in ((True, 1), (False, 7)):
        lobes = 2 if kind == "two lobes" else 1
        surface = random_surfaces(2 + count, perspective=perspective, lobes=lobes)
        if kind == "diffuse":
            surface = surface.without(*SPECULAR)
        sample = light_sample(light, 2 if count > 1 else 0, count)
        lit = drawn_light(surface, light, [sample])
        want = light_twin.light_layer(surface, light, sample)
        assert_close(lit[..., :3], want, *(OF_CELLS if has_extent(light) else ()))
        assert (lit[..., 3] == 0.0).all()
        assert lit[..., :3].any() or (light.diffuse_factor == 0.0 and kind == "diffuse")


def test_passes_add_up() -> None:
    """Two samples with half the weight are their mean."""
    light = LIGHTS["area"]
    got = drawn_light(SURFACES, light, [light_sample(light, k, 2) for k in range(2)])
    want = np.mean(
        [light_twin.light_layer(SURFACES, light, light_sample(light, k, 2)) for k in range(2)],
        axis=0,
    )
    assert_close(got[..., :3], want)


def test_black_light_adds_nothing() -> None:
    light = replace(LIGHTS["point"], color=np.zeros(3))
    assert not drawn_light(SURFACES, light, [light_sample(light, 0, 1)]).any()


def worlds() -> dict[str, World]:
    rng = np.random.default_rng(0)
    # Low frequencies, so that float32 directions do not matter at the texels' edges.
    height = 32
    v, u = np.meshgrid(np.linspace(0, 1, height), np.linspace(0, 2 * np.pi, 2 * height))
    picture = 1.5 + np.stack([np.sin(u + c) * np.cos(3 * v + c) for c in range(3)], axis=-1)
    picture = picture.transpose(1, 0, 2) + 0.1 * rng.random((height, 2 * height, 3))
    return {
        "constant": World(np.array([0.2, 0.5, 2.0])),
        "picture": World(None, picture.astype(np.float32)),
    }


@pytest.mark.parametrize("only_lambert", [False, True])
@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("kind", ["constant", "picture"])
def test_ambient_pass(kind: str, lobes: int, only_lambert: bool) -> None:
    world = worlds()[kind]
    surface = random_surfaces(1, lobes=lobes)
    light = None
    if world.equirect is not None:
        light = prepare_world(world.equirect.astype(np.float64))
    got = drawn(
        96,
        96,
        lambda target: AmbientPass(TABLES, surface.layout).draw(
            surface.upload(), WorldTextures.upload(world), target, only_lambert=only_lambert
        ),
    )
    want = world_twin.ambient(surface, world, light, only_lambert=only_lambert)
    # A look-up by direction is off by what the driver's atan is (see below): some 1e-5 here.
    assert_close(got[..., :3], want, 5e-6 if world.equirect is None else 3e-5)
    assert (got[..., 3] == 0.0).all()


@pytest.mark.parametrize("kind", ["none", "constant", "picture"])
def test_background_pass(kind: str) -> None:
    world = worlds().get(kind)
    view = perspective_view(looking_at((1, -4, 2), (0, 0, 0)), 96, 96, 1.2)
    surface = random_surfaces(5)
    position = surface.position.copy()
    position[:, 30:, 3] = 0.0
    surface = replace(surface, position=position)
    got = drawn(
        96,
        96,
        lambda target: BackgroundPass().draw(
            surface.upload(),
            WorldTextures.upload(world) if world is not None else None,
            view,
            target,
            offset=(0.3, -0.2),
        ),
    )
    want = world_twin.background(surface, world, view, (0.3, -0.2))
    # Shaders' atan may be 4096 units in the last place off (Vulkan specification, "Precision
    # and Operation of SPIR-V Instructions"): 8e-4 radians, 8e-3 of the 64 texels round the
    # horizon, times a slope of about 0.3 a texel.
    np.testing.assert_allclose(got, want, atol=2.5e-3)
    assert np.abs(got - want).mean() < 1e-4


def test_transparent_film_and_hidden_world() -> None:
    view = perspective_view(looking_at((1, -4, 2), (0, 0, 0)), 96, 96, 1.2)
    world = replace(worlds()["constant"], camera_visible=False)
    textures = WorldTextures.upload(world)
    hidden = drawn(
        96, 96, lambda target: BackgroundPass().draw(SURFACES.upload(), textures, view, target)
    )
    assert not hidden[..., :3].any()
    assert (hidden[..., 3] == 1.0).all()
    clear = drawn(
        96,
        96,
        lambda target: BackgroundPass().draw(
            SURFACES.upload(), textures, view, target, film_transparent=True
        ),
    )
    np.testing.assert_array_equal(clear[..., 3], SURFACES.hit)


def test_emission_pass() -> None:
    emission = EmissionPass(SURFACES.layout)
    got = drawn(96, 96, lambda target: emission.draw(SURFACES.upload(), target, 0.25))
    want = 0.25 * SURFACES.channel("emission") * SURFACES.hit[..., None]
    # A product of float32 numbers, one of them a power of two: exact.
    np.testing.assert_array_equal(got[..., :3], want)
    assert not got[..., 3].any()


@pytest.mark.parametrize("count", [0, 1, 3, 8, 9, 20])
def test_sum_of_layers(count: int) -> None:
    rng = np.random.default_rng(3)
    layers = rng.random((count, 8, 8, 4)).astype(np.float32)
    factors = rng.random((count, 4))
    addends = [
        Addend(texture_from_array(layer, "RGBA32F"), tuple(factor))
        for layer, factor in zip(layers, factors, strict=True)
    ]
    got = drawn(8, 8, lambda target: SumPass().draw(addends, target))
    want = (layers * factors[:, None, None]).astype(np.float64).sum(axis=0)
    # Three roundings for each, of sums below the count: 1.5 * 2^-23 * count in all.
    np.testing.assert_allclose(got, want, atol=1.8e-7 * max(count, 1) * count)


def test_a_coarse_layer_covers_more_pixels() -> None:
    coarse = np.arange(6, dtype=np.float32).reshape(2, 3, 1) * np.ones(4, dtype=np.float32)
    addend = Addend(texture_from_array(coarse, "RGBA32F"), (2.0, 1.0, 1.0, 1.0), 4)
    got = drawn(10, 7, lambda target: SumPass().draw([addend], target))
    want = coarse.repeat(4, axis=0).repeat(4, axis=1)[:7, :10] * [2.0, 1.0, 1.0, 1.0]
    np.testing.assert_array_equal(got, want)


@pytest.mark.parametrize("name", LIGHTS)
def test_no_odd_values(name: str) -> None:
    """Grazing and back-facing normals give no NaN, and no negative light."""
    lit = drawn_light(SURFACES, LIGHTS[name], [light_sample(LIGHTS[name], 0, 1)])
    assert np.isfinite(lit).all()
    assert (lit >= 0.0).all()
