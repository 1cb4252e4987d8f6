# SPDX-License-Identifier: GPL-3.0-or-later
"""Glowing objects as lights: against closed forms, the float64 twin, and Cycles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.corrmap.surface_layout import SurfaceLayout
from addon.relight.light_points.light_sample import light_sample
from addon.relight.lights.mesh_lights import Glow, glow, mesh_lights, shares
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.relight.shadows.traced_shadow import TracedShadowPass
from addon.scene.light import Light
from addon.scene.mesh_light import MeshLight, mesh_light
from tests.reference import light_pass as light_twin
from tests.reference.surfaces import random_surfaces, surfaces
from tests.synthetic import box, geometry_of

from .drawing import drawn_light
from .test_shadow import WHITE, floor_points, square

pytestmark = pytest.mark.usefixtures("gpu_context")

UP = np.array([0.0, 0.0, 1.0])
Array = NDArray[np.float64]


def glowing(vertices: Array, triangles: NDArray[np.int64], radiance: Any = 1.0) -> MeshLight:
    corners = vertices[triangles]
    return mesh_light("glow", corners, np.broadcast_to(radiance, (len(corners), 3)) * 1.0)


def test_points_are_where_the_power_is() -> None:
    """Triangles of other sizes and colours get points by their power; the mean tint is one."""
    rng = np.random.default_rng(4)
    corners = rng.normal(size=(40, 3, 3))
    radiance = rng.random((40, 3)) * rng.choice([0.1, 5.0], (40, 1))
    light = mesh_light("glow", corners, radiance)
    count = 4096
    samples = [light_sample(light, k, count) for k in range(count)]
    tints = np.array([s.emitter.tint for s in samples if s.emitter is not None])
    assert len(tints) == count
    assert tints.mean(axis=0) == pytest.approx(np.ones(3), abs=0.005)
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert light.intensity == pytest.approx(areas @ radiance)
    # Each point lies on a triangle, even over it: the mean place is that of the power.
    power = areas * (radiance @ [0.2126, 0.7152, 0.0722])
    middle = np.average(corners.mean(axis=1), axis=0, weights=power)
    found = np.mean([s.position for s in samples], axis=0)
    assert found == pytest.approx(middle, abs=0.01)


@pytest.mark.parametrize("radiance", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_under_a_square(scale: float, radiance: float, side: float) -> None:
    """Below the middle of a square of half side a, at a distance h, the form factor is
    4 / pi * q atan(q) with q = x / sqrt(1 + x^2) and x = a / h: four times that below a corner
    (Siegel and Howell, Thermal Radiation Heat Transfer, configuration 4). Both sides glow."""
    a, h = 0.5, 0.8
    vertices, triangles = square(a * scale, side * h * scale)
    light = glowing(vertices, triangles, radiance)
    x = a / h
    q = x / np.sqrt(1.0 + x * x)
    want = 4.0 / np.pi * q * np.arctan(q) * radiance
    surface = surfaces(np.zeros((1, 1, 3)), side * UP, eye=(0, 0, side * 10.0 * scale))
    count = 256
    samples = [light_sample(light, k, count) for k in range(count)]
    got = drawn_light(surface, light, samples)[0, 0]
    assert got[:3] == pytest.approx(want, rel=0.005)


def test_a_furnace() -> None:
    """Inside a glowing cube a white Lambert surface is as bright as the walls, wherever it is and
    however it is turned."""
    light = glowing(*box((0.0, 0.0, 0.0), 2.0), radiance=[0.5, 1.0, 2.0])
    rng = np.random.default_rng(2)
    normal = rng.normal(size=(24, 24, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    surface = surfaces(rng.uniform(-0.6, 0.6, (24, 24, 3)), normal, eye=(0, 0, 0))
    count = 1024
    samples = [light_sample(light, k, count) for k in range(count)]
    got = drawn_light(surface, light, samples)[..., :3] / [0.5, 1.0, 2.0]
    # The noise of 1,024 shared points is 1 to 2 % of a pixel; over all pixels little is left.
    assert got.mean() == pytest.approx(1.0, abs=0.005)
    assert got.std() < 0.03


def test_against_the_twin() -> None:
    surface = random_surfaces(7)
    rng = np.random.default_rng(3)
    corners = np.array([100.0, -50.0, 23.0]) + rng.uniform(-1.0, 1.0, (30, 3, 3))
    light = mesh_light("glow", corners, rng.random((30, 3)))
    for k in range(4):
        sample = light_sample(light, k, 8)
        want = light_twin.light_layer(surface, light, sample)
        got = drawn_light(surface, light, [sample])[..., :3]
        size = np.abs(want) + 1e-4 * np.abs(want).mean()
        assert np.percentile(np.abs(got - want) / size, 99.5) < 1e-3


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("away", [0.0, 1e6])
def test_it_does_not_hide_itself(scale: float, away: float) -> None:
    """Rays end before the glowing triangle, and start above what they leave; a thing between
    hides the light, and a closed glowing box its own far side."""
    if away and scale != 1.0:
        scale = 1e3 if scale > 1.0 else 1e-1
    offset = np.full(3, away)
    parts = [square(2.0, 0.0), square(0.5, 1.0), square(0.6, 0.5, (3.0, 0.0))]
    geometry = geometry_of(parts)
    geometry = replace(geometry, vertices=geometry.vertices * scale + offset)
    own = geometry.triangles[geometry.object_id == 1]
    light = mesh_light("glow", geometry.vertices[own], np.ones((len(own), 3)))
    xs = np.linspace(-1.5, 1.5, 24)
    surface = surfaces(
        floor_points(xs, xs) * scale, UP, origin=tuple(offset), eye=(0, 0, 10.0 * scale)
    )
    shadows, buffer = TracedShadowPass(geometry), surface.upload()
    for k in range(8):
        sample = light_sample(light, k, 8)
        shadow = shadows.draw(buffer, light, sample)
        lit = [drawn_light(surface, light, [sample], shadow=s)[..., 0] for s in (shadow, None)]
        assert np.array_equal(lit[0], lit[1])
        assert (lit[0] > 0.0).all()


def test_it_does_not_hide_itself_from_aslant() -> None:
    """A ceiling a hundred times as wide as it is high: embree finds its plane as exactly as its
    far corners are known, and slanting rays meet that long before their end."""
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    geometry = geometry_of([square(2.0, 0.0), square(100.0, 1.0)])
    geometry = replace(geometry, vertices=geometry.vertices @ turn.T)
    own = geometry.triangles[geometry.object_id == 1]
    light = mesh_light("glow", geometry.vertices[own], np.ones((len(own), 3)))
    xs = np.linspace(-1.5, 1.5, 24)
    surface = surfaces(floor_points(xs, xs) @ turn.T, turn @ UP, eye=tuple(turn @ UP * 0.9))
    shadows, buffer = TracedShadowPass(geometry), surface.upload()
    for k in range(16):
        sample = light_sample(light, k, 16)
        shadow = shadows.draw(buffer, light, sample)
        lit = [drawn_light(surface, light, [sample], shadow=s)[..., 0] for s in (shadow, None)]
        assert np.array_equal(lit[0], lit[1])
        assert (lit[0] > 0.0).all()


@pytest.mark.parametrize("traced", [True, False], ids=["traced", "map"])
def test_what_is_between_hides_it(traced: bool) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer

    geometry = geometry_of([square(2.0, 0.0), square(0.1, 1.0), square(0.3, 0.5)])
    own = geometry.triangles[geometry.object_id == 1]
    light = mesh_light("glow", geometry.vertices[own], np.ones((len(own), 3)))
    # The penumbra reaches from 0.3 * 2 - 0.1 to 0.3 * 2 + 0.1.
    xs = np.array([0.0, 0.45, 0.75, 1.5])
    surface = surfaces(floor_points(xs, np.zeros(1)), UP)
    for k in range(8):
        sample = light_sample(light, k, 8)
        if traced:
            shadow: Any = TracedShadowPass(geometry).draw(surface.upload(), light, sample)
        else:
            buffer = GeometryBuffer(geometry, surface.origin)
            shadow = ShadowPass(buffer).draw(light, sample, geometry.bounds, np.zeros((0, 3)))
        lit = drawn_light(surface, light, [sample], shadow=shadow)[0, :, 0]
        assert (lit > 0.0).tolist() == [False, False, True, True]


def test_finite_at_the_surface() -> None:
    """On the light, in its plane, and a millionth of a metre away."""
    light = glowing(*square(1.0, 0.0))
    places = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 1e-6], [3.0, 0.0, 0.0], [0.0, 0.0, -1e-6]])
    surface = surfaces(places[None], UP)
    samples = [light_sample(light, k, 64) for k in range(64)]
    got = drawn_light(surface, light, samples)
    assert np.isfinite(got).all()
    # No surface is lit brighter than by light from everywhere.
    assert (got[..., :3] <= 1.01).all()


def test_which_objects_glow() -> None:
    """One light for each object's name, with the colours of its materials."""
    geometry = geometry_of([square(2.0, 0.0), square(0.5, 1.0), square(0.5, 2.0)])
    geometry = replace(geometry, object_names=("floor", "lamp", "lamp"))
    found = mesh_lights(
        geometry,
        Glow(
            np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [4.0, 4.0, 4.0]]),
            np.array([False, False, True]),
        ),
    )
    (light,) = found
    assert light.name == "lamp"
    assert light.intensity == pytest.approx([5.0, 6.0, 7.0])
    assert light.warnings == (
        "glowing object 'lamp': its glow varies, and lights the scene with its mean",
    )


def test_what_materials_send_out() -> None:
    """A constant of the scene, of each material, or the mean of what varies."""
    names = ("a", "b")
    one = ChannelPlan(("depth",), {"emission": (1.0, 2.0, 3.0)}, names)
    table = np.zeros((3, 4, 4), dtype=np.float32)
    got = glow(one, SurfaceLayout(one), table)
    assert got.radiance.tolist() == [[1.0, 2.0, 3.0]] * 2
    each = ChannelPlan(
        ("depth",), {}, names, material_constants={"emission": ((0.0, 0.0, 0.0), (1.0, 1.0, 5.0))}
    )
    got = glow(each, SurfaceLayout(each), table)
    assert got.radiance.tolist() == [[0.0, 0.0, 0.0], [1.0, 1.0, 5.0]]
    assert not got.varies.any()
    varies = ChannelPlan(("depth", "normal", "emission"), {}, names)
    table[0, 2, 3], table[1, 2, :2] = 7.0, (8.0, 9.0)
    got = glow(varies, SurfaceLayout(varies), table)
    assert got.radiance.tolist() == [[0.0, 0.0, 0.0], [7.0, 8.0, 9.0]]
    assert got.varies.tolist() == [False, True]
    grey = replace(varies, grey=frozenset({"emission"}))
    assert glow(grey, SurfaceLayout(grey), table).radiance[1].tolist() == [7.0, 7.0, 7.0]


def test_shares_of_the_light() -> None:
    """A square of intensity I = L A straight above gives I / d^2, as a lamp of that intensity."""
    light = glowing(*square(0.05, 10.0))
    place = np.eye(4)
    place[2, 3] = 10.0
    lamp = Light("lamp", "POINT", place, 4.0 * np.pi * light.intensity[0] * 9.0, WHITE)
    share = shares([light, lamp], [], np.zeros((5, 3)))
    assert share == pytest.approx([0.1, 0.9], rel=1e-3)
    assert shares([light], [lamp], np.zeros((5, 3))) == pytest.approx([0.1], rel=1e-3)
    assert shares([], [lamp], np.zeros((5, 3))).tolist() == []
    assert shares([light], [lamp], np.zeros((0, 3))).tolist() == [1.0]


def test_shares_beside_what_does_not_arrive() -> None:
    """A strong sun counts where it reaches a place, and is asked for that only in doubt."""
    light = glowing(*square(0.05, 10.0))
    sun = Light("sun", "SUN", np.eye(4), 1e6 * light.intensity[0], WHITE)
    asked: list[str] = []

    def reached(other: Light) -> Array:
        asked.append(other.name)
        return np.array([1.0, 1.0, 1.0, 0.0])

    places = np.zeros((4, 3))
    assert shares([light], [sun], places) == pytest.approx([1e-8], rel=1e-2)
    # One place in four has nothing but its light.
    assert shares([light], [sun], places, reached) == pytest.approx([0.25], rel=1e-6)
    assert asked == ["sun"]
    weak = replace(sun, energy=0.1 * light.intensity[0])
    assert shares([light], [weak], places, reached) == pytest.approx([1.0 / 11.0], rel=1e-3)
    assert asked == ["sun"]
