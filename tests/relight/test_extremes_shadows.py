# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps and traced shadows in scenes of a millimetre, a hundred kilometres, and a million
metres from the origin: nothing shadows a lone plane or ball, and contacts keep their shadows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.relight.light_points.light_sample import light_sample
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.relight.shadows.traced_shadow import TracedShadowPass
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from tests.reference import light_pass as light_twin
from tests.reference.surfaces import Surfaces, surfaces
from tests.synthetic import box, geometry_of

from .drawing import TABLES, drawn
from .extremes import Array, unit
from .test_shadow import EDGE_LIGHTS, SQUARE, floor_points, light_at, square
from .test_traced_shadow import PLACES, moved, placed

pytestmark = pytest.mark.usefixtures("gpu_context")

UP = np.array([0.0, 0.0, 1.0])
SETTINGS = ShadowSettings(resolution=256, cube_resolution=128)
METHODS = ["map", "traced"]
_passes: dict[Any, Any] = {}


def share(geometry: SceneGeometry, light: Light, surface: Surfaces, method: str) -> Array:
    """(H, W) of the light that arrives, over what would without a shadow."""
    from addon.relight.lights.light_pass import LightPass

    sample = light_sample(light, 0, 1)
    buffer = surface.upload()
    if method == "traced":
        shadow: Any = TracedShadowPass(geometry).draw(buffer, light, sample)
    else:
        casters = GeometryBuffer(geometry, surface.origin)
        points = surface.position[..., :3].reshape(-1, 3) + surface.origin
        shadow = ShadowPass(casters, SETTINGS).draw(light, sample, geometry.bounds, points)
    light_pass = _passes.setdefault("light", LightPass(TABLES, surface.layout))
    light_pass.set_layout(surface.layout)
    height, width, _ = surface.position.shape
    both = [
        drawn(
            width,
            height,
            lambda target, s=s: light_pass.draw(buffer, light, sample, target, shadow=s),  # type: ignore[misc]
        )[..., 0]
        for s in (shadow, None)
    ]
    return np.divide(both[0], both[1], out=np.zeros_like(both[0]), where=both[1] > 0.0)


def ball(segments: int) -> tuple[Array, Any]:
    """A unit ball of flat facets."""
    v, u = np.meshgrid(
        np.linspace(0.0, np.pi, segments + 1), np.arange(2 * segments) * np.pi / segments,
        indexing="ij",
    )  # fmt: skip
    points = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
    row, column = np.meshgrid(np.arange(segments), np.arange(2 * segments), indexing="ij")
    a = row * 2 * segments + column
    b = row * 2 * segments + (column + 1) % (2 * segments)
    faces = np.stack([a, a + 2 * segments, b + 2 * segments, a, b + 2 * segments, b], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 3)


def on_triangles(geometry: SceneGeometry, side: int) -> tuple[Array, Array]:
    """(side, side, 3) points all over a geometry, and the normals of their triangles."""
    rng = np.random.default_rng(3)
    pick = rng.choice(len(geometry), side * side, p=geometry.area / geometry.area.sum())
    u, v = rng.random((2, side * side, 1))
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    a, b, c = geometry.vertices[geometry.triangles[pick]].swapaxes(0, 1)
    shape = (side, side, 3)
    return (a + u * (b - a) + v * (c - a)).reshape(shape), geometry.normal[pick].reshape(shape)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
def test_nothing_shadows_a_plane(kind: str, where: str, method: str) -> None:
    """Up to a thousandth of a degree above it."""
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    geometry = moved(geometry_of([square(4.0, 0.0)]), scale, offset)
    rng = np.random.default_rng(0)
    points = np.append(rng.uniform(-1.5, 1.5, (64, 64, 2)), np.zeros((64, 64, 1)), axis=-1)
    surface = surfaces(points * scale, UP, origin=tuple(offset), eye=(0.0, 0.0, 10.0 * scale))
    for tilt in (0.0, 60.0, 89.0, 89.999):
        angle = np.radians(tilt)
        toward = 5.0 * np.array([np.sin(angle), 0.0, np.cos(angle)])
        light = placed(light_at(kind, tuple(toward), (0.0, 0.0, 0.0), spot_size=1.2), scale, offset)
        reached = light_twin.incidence(surface, light, light_sample(light, 0, 1))[1] > 0.0
        assert (share(geometry, light, surface, method)[reached] == 1.0).all(), tilt


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_nothing_shadows_a_balls_lit_side(kind: str, where: str, method: str) -> None:
    """Facets that face the light are lit up to the terminator: a convex thing has no shadow on
    its own lit facets. Positions are as far off these as float32 makes them at their size."""
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    geometry = moved(geometry_of([ball(12)]), scale, offset)
    points, normal = on_triangles(geometry, 64)
    light = placed(light_at(kind, (2.0, -1.0, 3.0), (0.0, 0.0, 0.0)), scale, offset)
    toward = -light.direction if kind == "SUN" else unit(light.position - points)
    outward = np.sum(normal * (points - offset), axis=-1, keepdims=True)
    normal = np.where(outward < 0.0, -normal, normal)
    surface = surfaces(points - offset, normal, origin=tuple(offset), eye=(0.0, 0.0, 10.0 * scale))
    facing = np.sum(normal * toward, axis=-1) > 1e-3
    assert facing.mean() > 0.2
    got = share(geometry, light, surface, method)[facing]
    # A pixel of a map's border may show the next facet; a traced one nothing.
    assert (got > 0.999).mean() == 1.0 if method == "traced" else (got > 0.999).mean() > 0.999


@pytest.mark.parametrize("where", PLACES)
def test_contact_is_shadowed_by_maps(where: str) -> None:
    """From two texels on (at this slope four on the floor) the foot of a box is dark, and nothing
    before it is. (Traced ones, see test_traced_shadow.py, have no such gap.)"""
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    geometry = moved(geometry_of([square(4.0, 0.0), box((0.0, 0.0, 0.5), 1.0)]), scale, offset)
    light = placed(light_at("POINT", (3.0, 0.0, 2.0), (0.0, 0.0, 0.0)), scale, offset)
    texel = 4.1 * 2.0 / SETTINGS.cube_resolution
    for xs, lit in (
        (-0.5 - np.linspace(4.0 * texel, 0.6, 40), 0.0),
        (np.linspace(0.6, 2, 40), 1.0),
    ):
        points = floor_points(xs, np.linspace(-0.2, 0.2, 5)) * scale
        surface = surfaces(points, UP, origin=tuple(offset), eye=(0.0, 0.0, 10.0 * scale))
        assert (share(geometry, light, surface, "map") == lit).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA"])
def test_a_shade_in_a_large_scene(kind: str, method: str) -> None:
    """A lamp shade of a millimetre in a landscape of 200 km: its shadow is not clipped away."""
    plain = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 1e5
    geometry = geometry_of([(plain, SQUARE), square(1e-3, 2.999)])
    light = light_at(kind, (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), spot_size=2.5, size=1e-6)
    # The shade hides the light up to 45 degrees.
    xs = np.array([0.0, 1.0, 2.0, 2.5, 3.5, 5.0, 8.0])
    surface = surfaces(floor_points(xs, np.zeros(1)), UP, eye=(0.0, 0.0, 10.0))
    got = share(geometry, light, surface, method)[0]
    assert got.tolist() == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
def test_the_farthest_caster_is_not_clipped(kind: str) -> None:
    """A card at a far corner of all that casts shadows still casts its own on what is behind."""
    card = square(4.0, -99.0, (30.0, 0.0))
    geometry = geometry_of([square(1e-3, 2.0, (0.0, 50.0)), card])
    light = light_at(kind, (30.0, 0.0, 1.0), (30.0, 0.0, -99.0), spot_size=0.3)
    surface = surfaces(
        np.array([[[30.0, 0.0, -103.0], [30.0, 12.0, -103.0]]]), UP, eye=(0.0, 0.0, 10.0)
    )
    assert share(geometry, light, surface, "map")[0].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("method", "height"), [("map", 1e-5), ("map", 1e-3), ("traced", 1e-6), ("traced", 1e-3)]
)
def test_a_light_just_above_a_plane(height: float, method: str) -> None:
    """Which it lights all over, to a million times its height away; and nothing from below. A map
    is drawn from positions that are off by 6e-8 of their triangle's size, here of 4 m: a lamp has
    to stand well above that, and 1e-6 m is left to rays."""
    geometry = geometry_of([square(4.0, 0.0)])
    light = light_at("POINT", (0.0, 0.0, height), (0.0, 0.0, 0.0))
    rng = np.random.default_rng(1)
    away = 10.0 ** rng.uniform(-6.0, 0.0, (32, 32))
    around = rng.uniform(0.0, 2.0 * np.pi, (32, 32))
    points = np.stack([away * np.cos(around), away * np.sin(around), 0.0 * away], axis=-1)
    surface = surfaces(points, UP, eye=(0.0, 0.0, 10.0))
    assert (share(geometry, light, surface, method) == 1.0).all()
    place = light.world_from_light.copy()
    place[2, 3] = -height
    below = replace(light, world_from_light=place)
    assert not share(geometry, below, surface, method).any()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", EDGE_LIGHTS)
def test_a_light_far_away(name: str, method: str) -> None:
    """A million metres up, it casts the shadow of what lies a metre above the floor: as large,
    to the millionth. A map tells apart what lies more than 8e-6 of the light's distance behind one
    another (ROUNDING in shadow.glsl, for the plane and the receiver): so it gets 20 m."""
    geometry = geometry_of([square(2.0, 0.0), square(0.4, 1.0 if method == "traced" else 20.0)])
    place = light_at("SUN", (0.0, 0.0, 1e6), (0.0, 0.0, 0.0)).world_from_light
    light = replace(EDGE_LIGHTS[name], world_from_light=place, spot_size=1e-5)
    xs = np.array([0.0, 0.2, 0.6, 1.0]) if method == "map" else np.array([0.0, 0.399, 0.401, 1.0])
    surface = surfaces(floor_points(xs, np.zeros(1)), UP, eye=(0.0, 0.0, 10.0))
    got = share(geometry, light, surface, method)[0]
    if method == "map" and name in ("point", "area"):
        # All six faces of a cube: a texel of 16 km. What it hides is what its centre sees.
        assert np.isfinite(got).all()
    else:
        assert got.tolist() == [0.0, 0.0, 1.0, 1.0]
