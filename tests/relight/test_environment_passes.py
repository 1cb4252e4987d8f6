# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of the world's light against their float64 twins, and against closed forms."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.glsl.shader import read_texture
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.relight.world.environment_pass import DirectionPass, RayPass
from addon.relight.world.equirect import bilinear, directions, place_of
from addon.relight.world.world_directions import Directions, sobol_points
from addon.relight.world.world_pass import WorldTextures
from addon.scene.world import World
from tests.reference import environment as twin
from tests.reference.bsdf import Lobe, dot
from tests.reference.surfaces import Surfaces, random_surfaces, surfaces
from tests.synthetic import geometry_of

from .drawing import TABLES, drawn

pytestmark = pytest.mark.usefixtures("gpu_context")

Part = tuple[NDArray[np.float64], NDArray[np.float64]]

SETTINGS = {
    "as lights": twin.Setting(),
    "a control and rays": twin.Setting(rays=2, control=True),
    "nothing for Lambert": twin.Setting(rays=1, control=True, lambert=False),
    "no diffuse": twin.Setting(diffuse=False),
    "no gloss": twin.Setting(rays=1, specular=False),
}


def some_directions() -> Directions:
    rng = np.random.default_rng(3)
    toward = rng.normal(size=(4, 3))
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    return Directions(toward, rng.random((4, 3)), 0.1 + rng.random(4))


@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("name", SETTINGS)
def test_direction_pass(name: str, lobes: int) -> None:
    surface = random_surfaces(4, 48, lobes=lobes)
    drawn_directions, setting = some_directions(), SETTINGS[name]
    # A square so large and near that it hides all that comes from above, and nothing else.
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 50.0
    roof = geometry_of([(surface.origin + corners + [0, 0, 4.0], np.array([[0, 1, 2], [0, 2, 3]]))])
    places = surface.position[surface.hit][:, :3] + surface.origin
    shadow = ShadowPass(GeometryBuffer(roof, surface.origin), ShadowSettings()).draw_parallel(
        drawn_directions.toward, roof.bounds, places, 64
    )
    got = drawn(
        48,
        48,
        lambda target: DirectionPass(TABLES, surface.layout).draw(
            surface.upload(), drawn_directions, shadow, target, **asdict(setting)
        ),
    )
    want = np.zeros((48, 48, 3))
    for L, radiance, density in zip(
        drawn_directions.toward, drawn_directions.radiance, drawn_directions.density, strict=True
    ):
        is_open = np.full((48, 48), float(L[2] <= 0.0))
        each = twin.one_direction(surface, L, float(density), is_open, setting)
        want += each * radiance / density
    scale = np.abs(want).max(axis=-1, keepdims=True)
    # With a control large terms cancel: of their size, not of what is left.
    floor = 1e-4 * np.median(scale[surface.hit])
    wrong = (np.abs(got[..., :3] - want) > 2e-3 * scale + floor).any(axis=-1)
    # Where light grazes a surface its own plane is within the shadow map's rounding.
    NgoL = np.einsum("hwk,dk->hwd", surface.geometric_normal[..., :3], drawn_directions.toward)
    wrong &= (np.abs(NgoL) > 5e-3).all(axis=-1)
    assert wrong.mean() < 1e-3, f"{wrong.sum()} pixels are off"
    assert np.isfinite(got).all()
    assert not got[..., 3].any()


def picture_world(peak: float = 0.0) -> World:
    """Smooth, so that the last digits of a direction do not matter; and a sun of four texels."""
    x, y, z = np.moveaxis(directions(128, 256), -1, 0)
    picture = np.stack([1.0 + 0.5 * x, 1.0 + 0.4 * y * z, 1.2 - 0.7 * z], axis=-1)
    picture[80:82, 60:62] += peak
    return World(None, picture.astype(np.float32))


@pytest.mark.parametrize("kind", ["constant", "picture", "picture with a sun"])
def test_what_arrives_along_a_ray(kind: str) -> None:
    """Of the direction that was drawn the twin computes the same contribution."""
    surface = random_surfaces(7, 48)
    world = World(np.array([0.2, 0.5, 2.0]))
    if kind != "constant":
        world = picture_world(0.0 if kind == "picture" else 1e4)
    textures = WorldTextures.upload(world)
    assert (textures.sun_source is not None) == kind.endswith("sun")
    number, of_world = 2, 4
    ray, arriving = RayPass(TABLES, surface.layout).send(
        surface.upload(), textures, np.array([0.3, 0.6, 0.2]), number=number, directions=of_world
    )
    toward, got = read_texture(ray).astype(np.float64), read_texture(arriving).astype(np.float64)
    sent = toward[..., 3] > 0.0
    assert sent.mean() > 0.3
    assert not got[~sent].any()
    L = np.where(sent[..., None], toward[..., :3], surface.geometric_normal[..., :3])
    np.testing.assert_allclose(np.linalg.norm(L, axis=-1), 1.0, atol=1e-6)
    assert (dot(L, surface.geometric_normal[..., :3])[sent] > 0.0).all()
    lobe = Lobe(surface)
    rough = lobe.roughness > 0.05  # mirrors have no density
    density = number * twin.mirrored_density(lobe, L)
    want = lobe.specular(L, np.zeros(L.shape[:2])) * _over(textures, L, density, of_world)
    off = (np.abs(got[..., :3] - want) > 5e-3 * want.max(axis=-1, keepdims=True) + 1e-6).any(-1)
    # A sun's flank is steep: what is 1e-4 of a radian there is some per cent of its light.
    flank = np.zeros(sent.shape, dtype=np.bool_)
    if textures.sun_source is not None:
        flank = L @ textures.sun_source.middles.toward[0] > np.cos(np.radians(8.0))
        sums = [values[sent & rough & flank].sum() for values in (got[..., :3], want)]
        assert sums[0] == pytest.approx(sums[1], rel=0.05)
        assert sums[1] > 0.0
    assert off[sent & rough & ~flank].mean() < 5e-3
    assert sent[rough].mean() > 0.3
    mirrors = sent & (lobe.roughness == 0.0)
    R = 2.0 * dot(lobe.N_specular, lobe.V)[..., None] * lobe.N_specular - lobe.V
    np.testing.assert_allclose(toward[mirrors][:, :3], R[mirrors], atol=1e-5)


def _over(
    textures: WorldTextures, L: NDArray[np.float64], rays: NDArray[np.float64], number: int
) -> NDArray[np.float64]:
    if textures.picture is None:
        assert textures.world.radiance is not None
        return textures.world.radiance / (number / (4.0 * np.pi) + rays)[..., None]
    residual = read_texture(textures.residual).astype(np.float64)
    parts: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = [
        (residual[..., :3], number * residual[..., 3])
    ]
    if textures.suns is not None:
        suns = read_texture(textures.suns).astype(np.float64)
        parts.append((suns[..., :3], suns[..., 3]))
    total = np.zeros(L.shape)
    for picture, density in parts:
        x, y = place_of(L, picture.shape[1], picture.shape[0])
        row = np.minimum(y.astype(np.int64), picture.shape[0] - 1)
        inside = density[row, x.astype(np.int64)]
        total += bilinear(picture, x, y) / (inside + rays)[..., None]
    return total


def plane(roughness: float, aspect: float, tilt: float, size: int = 128) -> Surfaces:
    """One surface everywhere, seen from afar at an angle, with a white microfacet lobe."""
    position, normal = np.zeros((size, size, 3)), np.array([0.0, 0.0, 1.0])
    eye = (1e4 * np.sin(tilt), 0.0, 1e4 * np.cos(tilt))
    flat = surfaces(position, normal, eye=eye, albedo=0.0)
    values: dict[str, Any] = {
        "specular_f0": np.ones(3), "specular_f90": np.ones(3), "roughness": [roughness],
        "aspect": [aspect], "tangent": [0.6, 0.8, 0.0], "distribution": [1.0],
    }  # fmt: skip
    channels = {
        name: np.broadcast_to(np.float32(v), (size, size, len(v))).astype(np.float64)
        for name, v in values.items()
    }
    return replace(flat, channels={**flat.channels, **channels})


@pytest.mark.parametrize(
    ("roughness", "aspect"), [(0.1, 1.0), (0.5, 1.0), (0.9, 1.0), (0.5, 0.5), (0.6, 1.7)]
)
def test_rays_are_unbiased(roughness: float, aspect: float) -> None:
    """Under a white world their mean is the lobe's albedo, by quadrature over all directions."""
    surface = plane(roughness, aspect, 1.0)
    textures = WorldTextures.upload(World(np.ones(3)))
    rays = RayPass(TABLES, surface.layout)
    uploaded = surface.upload()
    total = 0.0
    for k in range(16):
        point = np.append(sobol_points(k, 1), 0.0)
        _, arriving = rays.send(uploaded, textures, point, number=1, directions=0)
        total += float(read_texture(arriving)[..., 0].mean(dtype=np.float64)) / 16
    one = plane(roughness, aspect, 1.0, 1)
    z, weights = np.polynomial.legendre.leggauss(100)
    # Crowded where the lobe is: about the mirrored direction.
    z, weights = 0.5 * (z + 1.0), 0.5 * weights
    around = (np.arange(200) + 0.5) * np.pi / 100
    R = np.array([-np.sin(1.0), 0.0, np.cos(1.0)])
    across = np.array([np.cos(1.0), 0.0, np.sin(1.0)])
    cosine = 1.0 - 2.0 * z[:, None] ** 4
    sine = np.sqrt(1.0 - cosine**2)
    L = (
        cosine[..., None] * R
        + (sine * np.cos(around))[..., None] * across
        + (sine * np.sin(around))[..., None] * np.array([0.0, 1.0, 0.0])
    )
    lobe = Lobe(_broadcast(one, L.shape[:2]))
    value = lobe.specular(L, np.zeros(L.shape[:2]))[..., 0]
    want = float((value * (weights * 8.0 * z**3)[:, None]).sum() * np.pi / 100)
    # 262,144 rays of a standard deviation of 0.36 (the steepest case): four times their mean's.
    assert total == pytest.approx(want, rel=3e-3)


def _broadcast(one: Surfaces, shape: tuple[int, int]) -> Surfaces:
    def wide(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.broadcast_to(values, (*shape, values.shape[-1]))

    return replace(
        one,
        position=wide(one.position),
        geometric_normal=wide(one.geometric_normal),
        channels={name: wide(values) for name, values in one.channels.items()},
    )
