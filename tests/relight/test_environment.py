# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light in a session: against quadrature over all directions with traced visibility,
and what it costs where it is not needed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.relight.world.equirect import bilinear, directions, place_of, solid_angles
from addon.scene.geometry import SceneGeometry
from addon.scene.view import PixelFilter, View
from addon.scene.world import World
from tests import synthetic

from .test_session import ALBEDO, MemoryStore, white

pytestmark = pytest.mark.usefixtures("gpu_context")

Array = NDArray[np.float64]
GLOSS = {
    "specular_f0": (0.3, 0.3, 0.3),
    "specular_f90": (1.0, 1.0, 1.0),
    "roughness": (0.4,),
    "distribution": (1.0,),
}
WIDTH, HEIGHT = 48, 36


def scene() -> tuple[SceneGeometry, View]:
    """A box that floats above a floor."""
    floor = np.array([[-4.0, -4, -1], [4, -4, -1], [4, 4, -1], [-4, 4, -1]])
    geometry = synthetic.geometry_of(
        [(floor, np.array([[0, 1, 2], [0, 2, 3]])), synthetic.box((0.2, 0.3, 0.0), 1.0)]
    )
    place = synthetic.looking_at((-1.5, -2.6, 1.6), (0.1, 0.2, -0.6))
    view = synthetic.perspective_view(place, WIDTH, HEIGHT, 1.0)
    # Through the pixels' centres.
    return geometry, replace(view, pixel_filter=PixelFilter("GAUSSIAN", 0.01))


def store(geometry: SceneGeometry, constants: dict[str, tuple[float, ...]]) -> MemoryStore:
    tracer = synthetic.Tracer(geometry)
    cameras = synthetic.cube_cameras((-1.5, -2.6, 1.6), 256)
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"), constants, geometry.material_names
    )
    framebuffers = [synthetic.trace_framebuffer(geometry, tracer, c, white) for c in cameras]
    return MemoryStore(plan, framebuffers)


def relit(
    geometry: SceneGeometry, view: View, world: World, samples: int, gloss: bool
) -> tuple[Any, Array]:
    from addon.relight.session import RelightSession

    cache = store(geometry, GLOSS if gloss else {})
    session = RelightSession(geometry, cast("Any", cache), samples)
    session.set_view(view)
    session.set_world(world)
    return session, session.render().layers["World"].astype(np.float64)


def sky(sun: float) -> World:
    x, y, z = np.moveaxis(directions(64, 128), -1, 0)
    picture = np.stack([1.0 + 0.8 * x, 1.0 + 0.7 * y * z, 1.2 + 0.9 * z], axis=-1)
    picture[44, 30] += sun
    return World(None, picture.astype(np.float32), camera_visible=False)


def quadrature(
    geometry: SceneGeometry, view: View, world: World, pixels: NDArray[np.int64], gloss: bool
) -> Array:
    """(N, 3) radiance of pixels (N, 2) x, y: each texel's middle, and a sun's in 64 parts."""
    assert world.equirect is not None
    picture = world.equirect.astype(np.float64)
    tracer = synthetic.Tracer(geometry)
    origin, ray = view.rays(pixels.astype(np.float64) + 0.5)
    triangle, place = tracer.hit(np.broadcast_to(origin, ray.shape), ray)
    normal = geometry.normal[triangle]
    normal = np.where((normal * ray).sum(1, keepdims=True) > 0.0, -normal, normal)
    toward, weight = directions(192, 384).reshape(-1, 3), np.repeat(solid_angles(192, 384), 384)
    radiance = bilinear(picture, *place_of(toward, 128, 64))
    result = np.zeros((len(pixels), 3))
    for i, (start, up) in enumerate(zip(place, normal, strict=True)):
        above = toward @ up > 0.0
        L, light = toward[above], radiance[above] * weight[above, None]
        begin = np.broadcast_to(start + 1e-4 * up, L.shape)
        is_open = tracer.hit(begin, L)[0] < 0
        seen = ALBEDO / np.pi * (L @ up)[:, None] * np.ones(3)
        if gloss:
            seen = seen + ggx(up, view.origin - start, L)[:, None]
        result[i] = (seen * light)[is_open].sum(axis=0)
    return result


def ggx(N: Array, to_eye: Array, L: Array) -> Array:
    """(N,) the microfacet lobe of GLOSS times NoL (Walter et al. 2007), Schlick's Fresnel."""
    V = to_eye / np.linalg.norm(to_eye)
    H = (L + V) / np.linalg.norm(L + V, axis=-1, keepdims=True)
    a_sq = GLOSS["roughness"][0] ** 4
    NoH, NoL, NoV, LoH = H @ N, L @ N, V @ N, (L * H).sum(axis=-1)
    D = a_sq / (np.pi * (NoH**2 * (a_sq - 1.0) + 1.0) ** 2)
    masked = 1.0 + sum(0.5 * (np.sqrt(1.0 + a_sq * (1.0 / c**2 - 1.0)) - 1.0) for c in (NoL, NoV))
    F = 0.3 + 0.7 * (1.0 - LoH) ** 5
    return np.asarray(F * D / (4.0 * NoV * masked))


@pytest.mark.parametrize(("sun", "gloss"), [(0.0, False), (300.0, False), (300.0, True)])
def test_it_converges_to_quadrature(sun: float, gloss: bool) -> None:
    geometry, view = scene()
    world = sky(sun)
    rng = np.random.default_rng(2)
    pixels = np.stack([rng.integers(0, WIDTH, 60), rng.integers(0, HEIGHT, 60)], axis=-1)
    _, picture = relit(geometry, view, world, 64, gloss)
    got = picture[pixels[:, 1], pixels[:, 0]]
    seen = got.max(axis=-1) > 0.0
    want = quadrature(geometry, view, world, pixels[seen], gloss)
    error = np.abs(got[seen] - want).max(axis=-1) / want.max()
    assert seen.sum() > 30
    # 256 directions lie some five degrees apart; a sun's shadow has its edge at a few pixels.
    assert np.median(error) < 0.01
    assert (error > 0.03).mean() < 0.1
    assert got[seen].mean() == pytest.approx(want.mean(), rel=0.005)


def test_one_colour_costs_nothing_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where occlusion is baked and all is Lambert's, no direction and no ray is needed."""
    from addon.relight.session import RelightSession
    from addon.relight.world.environment import EnvironmentLight

    def refuse(*_args: Any) -> None:
        raise AssertionError("not needed")

    monkeypatch.setattr(EnvironmentLight, "_shade", refuse)
    monkeypatch.setattr(EnvironmentLight, "_trace", refuse)
    geometry, view = scene()
    cache = store(geometry, {})
    plan = replace(cache.plan, stored=(*cache.plan.stored, "ambient_occlusion"))
    half = [
        replace(
            f, channels={**f.channels, "ambient_occlusion": np.full_like(f.channels["depth"], 0.5)}
        )
        for f in cache.framebuffers
    ]
    session = RelightSession(geometry, cast("Any", MemoryStore(plan, half)), 4)
    session.set_view(view)
    session.set_world(World(np.array([2.0, 1.0, 0.5]), camera_visible=False))
    picture = session.render().layers["World"]
    seen = picture[picture.max(axis=-1) > 0.0]
    # The occlusion is stored in 8 bits.
    np.testing.assert_allclose(
        seen, ALBEDO * 0.5 * np.array([[2.0, 1.0, 0.5]] * len(seen)), rtol=5e-3
    )


@pytest.mark.parametrize("peak", [1e-9, 1e9])
def test_extremes_are_finite(peak: float) -> None:
    geometry, view = scene()
    for world in (sky(peak), World(None, np.full((1, 1, 3), peak, np.float32))):
        _, picture = relit(geometry, view, world, 2, True)
        assert np.isfinite(picture).all()
        assert picture.max() > 0.0
    _, black = relit(geometry, view, World(None, np.zeros((4, 8, 3), np.float32)), 2, True)
    assert not black.any()
