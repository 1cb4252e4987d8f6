# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light, from 1e-9 to 1e9, on surfaces that are seen down to 1e-7 above them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.glsl.shader import read_texture
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.relight.world.environment_pass import DirectionPass, RayPass
from addon.relight.world.equirect import directions
from addon.relight.world.world_directions import Directions, sobol_points
from addon.relight.world.world_light import prepare_world
from addon.relight.world.world_pass import AmbientPass, WorldTextures
from addon.relight.world.world_split import split_world
from addon.scene.world import World
from tests.reference import environment as twin
from tests.reference import world_pass as world_twin
from tests.reference.surfaces import Surfaces
from tests.synthetic import geometry_of

from .drawing import TABLES, drawn
from .extremes import Array, around, held, unit
from .test_shadow import square

pytestmark = pytest.mark.usefixtures("gpu_context")

SIDE = 32
BRIGHTNESS = [1e-9, 1.0, 1e9]
COLOR = np.array([0.2, 0.5, 2.0])


def lit_all_over(seed: int) -> Surfaces:
    surface = around(seed, SIDE, distances=np.array([1e-6, 1.0, 1e3]))
    one = np.ones((SIDE, SIDE, 1))
    return replace(surface, channels={**surface.channels, "ambient_occlusion": one})


SURFACE = lit_all_over(2)


def gradient(brightness: float) -> World:
    x, y, z = np.moveaxis(directions(64, 128), -1, 0)
    picture = brightness * np.stack([1.0 + 0.5 * x, 1.0 + 0.4 * y * z, 1.2 - 0.7 * z], axis=-1)
    return World(None, picture.astype(np.float32))


@pytest.mark.parametrize("brightness", BRIGHTNESS)
@pytest.mark.parametrize("kind", ["one colour", "picture"])
def test_ambient(kind: str, brightness: float) -> None:
    world = World(brightness * COLOR) if kind == "one colour" else gradient(brightness)
    light = None
    if world.equirect is not None:
        light = prepare_world(world.equirect.astype(np.float64))
    rule = held(lambda surface: world_twin.ambient(surface, world, light), SURFACE)
    got = drawn(
        SIDE,
        SIDE,
        lambda target: AmbientPass(TABLES, SURFACE.layout).draw(
            SURFACE.upload(), WorldTextures.upload(world), target
        ),
    )[..., :3]
    # Vulkan lets atan be off by 4096 units in the last place: 8e-4 radians, of a picture that
    # changes by no more than its brightness in one.
    driver = 0.0 if light is None else 8e-4 * brightness
    replace(rule, bound=rule.bound + driver).assert_holds(got)


def test_a_picture_scales() -> None:
    """Its suns, what is left and their blurs, to float32's rounding at any brightness."""
    plain = gradient(1.0)
    assert plain.equirect is not None
    picture = plain.equirect.copy()
    picture[40, 30] += 1e4
    parts, levels = split_world(picture), prepare_world(picture.astype(np.float64)).levels
    assert len(parts.suns) == 1
    for brightness in (1e-9, 1e9):
        scaled = (picture.astype(np.float64) * brightness).astype(np.float32)
        found = split_world(scaled)
        assert len(found.suns) == 1
        np.testing.assert_allclose(found.residual + found.suns[0], scaled, rtol=1e-12)
        np.testing.assert_allclose(found.suns[0], parts.suns[0] * brightness, rtol=1e-5,
                                   atol=1e-2 * brightness)  # fmt: skip
        blurred = prepare_world(scaled.astype(np.float64)).levels
        # Sums of 8,192 float32 products, pairwise: some tens of roundings.
        np.testing.assert_allclose(blurred, levels * np.float32(brightness), rtol=1e-5)


@pytest.mark.parametrize("brightness", BRIGHTNESS)
@pytest.mark.parametrize("kind", ["one colour", "picture"])
def test_rays_are_finite(kind: str, brightness: float) -> None:
    """Of mirrors and chalk, grazing ones too; what they bring has the world's brightness."""
    world = World(brightness * COLOR) if kind == "one colour" else gradient(brightness)
    textures, rays = WorldTextures.upload(world), RayPass(TABLES, SURFACE.layout)
    buffer = SURFACE.upload()
    for k in range(8):
        point = np.append(sobol_points(k, 1), 0.37)
        ray, arriving = (
            read_texture(each).astype(np.float64)
            for each in rays.send(buffer, textures, point, number=1, directions=0)
        )
        sent = ray[..., 3] > 0.0
        assert sent.mean() > 0.3
        np.testing.assert_allclose(np.linalg.norm(ray[sent][:, :3], axis=-1), 1.0, atol=1e-6)
        assert np.isfinite(arriving).all()
        assert (arriving >= 0.0).all()
        assert not arriving[~sent].any()
        # By visible normals a ray's weight is the reflectance times masking over its mean:
        # with what bounces between facets, less than 4 of a world that is 2.4 at most.
        assert arriving.max() < 10.0 * brightness


def test_directions_graze() -> None:
    """Those that all pixels share, at every angle to the surfaces, with nothing in the way."""
    rng = np.random.default_rng(3)
    toward = unit(rng.normal(size=(4, 3)))
    some = Directions(toward, 1e9 * rng.random((4, 3)), 1e-9 + rng.random(4))
    vertices, faces = square(1e-3, 0.0)
    below = geometry_of([(vertices - [0.0, 0.0, 1e3], faces)])
    places = SURFACE.position[..., :3].reshape(-1, 3)
    maps = ShadowPass(GeometryBuffer(below, SURFACE.origin), ShadowSettings())
    shadow = maps.draw_parallel(toward, below.bounds, places, 64)
    setting = twin.Setting(rays=1)

    def want(surface: Surfaces) -> Array:
        total = np.zeros((SIDE, SIDE, 3))
        for L, radiance, density in zip(toward, some.radiance, some.density, strict=True):
            one = twin.one_direction(surface, L, float(density), np.ones((SIDE, SIDE)), setting)
            total += one * radiance / density
        return total

    rule = held(want, SURFACE)
    got = drawn(
        SIDE,
        SIDE,
        lambda target: DirectionPass(TABLES, SURFACE.layout).draw(
            SURFACE.upload(), some, shadow, target, rays=1, control=False, lambert=True,
            diffuse=True, specular=True,
        ),
    )[..., :3]  # fmt: skip
    assert np.isfinite(got).all()
    # At the horizon of a surface it is a step whether a direction lights it.
    heights = np.abs(SURFACE.geometric_normal[..., :3] @ toward.T).min(axis=-1, keepdims=True)
    steps = np.where(heights < 1e-5, np.inf, 0.0)
    replace(rule, bound=rule.bound + steps).assert_holds(got)
