# SPDX-License-Identifier: GPL-3.0-or-later
"""The first picture after a camera move: what lights reach, and what fewer rays find."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.corrmap.local_scene import LocalScene
from addon.corrmap.surface_buffer import SurfaceBuffer
from addon.corrmap.traced_triangles import TrianglesByRay
from addon.corrmap.visible_surface import VisibleSurface, VisibleSurfacePass
from addon.glsl.shader import read_texture
from addon.relight.light_points.light_sample import light_sample
from addon.relight.lights.light_reach import ReachPass
from addon.relight.lights.plain_reach import PlainReach
from addon.relight.shadows.even_places import lies_between
from addon.relight.shadows.receivers import SeenReceivers
from addon.relight.shadows.sparse_rays import HIDDEN, SEEN, look_sparsely
from addon.relight.shadows.traced_shadow import TracedShadowPass
from addon.scene.light import Light
from tests import synthetic
from tests.reference.surfaces import surfaces

from .test_shadow import EDGE_LIGHTS, floor_points, light_at, square
from .test_terminator import ball

UP = np.array([0.0, 0.0, 1.0])
SPACING = 2.0**-24

# As in addon/glsl/lib/traced_shadow.glsl.
SIDE_IS_KNOWN = 65536.0


def lights() -> dict[str, Light]:
    """One of each kind; matrices that stretch, narrow cones, no blend."""
    tilted = synthetic.looking_at((0.4, -0.3, 1.5), (0.1, 0.2, -1.0)) @ np.diag([2.0, 0.5, 3.0, 1])
    make: Any = lambda kind, **more: Light("l", kind, tilted, 1.0, np.ones(3), **more)  # noqa: E731
    return {
        "point": make("POINT"),
        "sun": make("SUN"),
        "spot": make("SPOT", spot_size=1.1, spot_blend=0.5),
        "hard spot": make("SPOT", spot_size=0.3, spot_blend=0.0),
        "wide spot": make("SPOT", spot_size=3.1, spot_blend=0.1),
        "area": make("AREA", size=0.3),
        "narrow area": make("AREA", size=0.3, spread=0.6),
    }


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("name", lights())
def test_reach_is_the_shader_s(gpu_context: None, name: str, scale: float) -> None:
    """All that the light's own shader lights, the way to it, and no more than a hair beyond."""
    light = lights()[name]
    place = light.world_from_light.copy()
    place[:3, 3] *= scale
    light = replace(light, world_from_light=place, size=light.size * scale)
    rng = np.random.default_rng(3)
    points = rng.uniform(-2.0, 2.0, (120, 160, 3)) * scale
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    buffer = surfaces(points, normals, eye=(0.0, 0.0, 9.0 * scale)).upload()
    sample = light_sample(light, 0, 1)
    drawn = ReachPass().draw(buffer, light, sample, both_sides=True).reshape(-1, 4)
    plain = PlainReach.of(light, sample, buffer.origin)
    assert plain is not None
    way = plain.way(points.reshape(-1, 3).T)
    shines = plain.shines(way)
    lit = drawn[:, 3] != 0.0
    assert lit.any()
    assert not (lit & ~shines).any()
    # A share of 1e-5 radians of pixels that lie anywhere.
    assert np.mean(shines & ~lit) < 5e-4
    length = np.linalg.norm(way, axis=0)
    np.testing.assert_allclose(drawn[lit, :3] / length[lit, None], (way / length).T[lit], atol=1e-5)


def test_what_is_shaped_asks_the_shader() -> None:
    """Each receiver's own point of a disk is left to those that know it."""
    light = light_at("POINT", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), shadow_soft_size=0.5)
    sample = light_sample(light, 1, 4, per_receiver=True)
    assert PlainReach.of(light, sample, np.zeros(3)) is None


def seen_of(drawn: VisibleSurface, scene: LocalScene) -> SeenReceivers:
    return SeenReceivers.of(buffer_of(drawn, scene.origin), scene)


def buffer_of(drawn: VisibleSurface, origin: NDArray[np.float64]) -> SurfaceBuffer:
    width, height = drawn.position.width, drawn.position.height
    return replace(
        surfaces(np.zeros((height, width, 3)), UP).upload(),
        origin=origin,
        eye=drawn.eye[:3],
        perspective=bool(drawn.eye[3] > 0.0),
        position=drawn.position,
        geometric_normal=drawn.normal,
        triangles=drawn.seen_triangles,
    )


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_receivers_of_rays(gpu_context: None, scale: float, offset: float) -> None:
    """Places that rays found are those that the rasterizer found, without a look at its picture;
    a part of the view sees nothing."""
    place = np.array([offset, -offset, offset])
    parts = [square(2.0, 0.0), synthetic.box((0.3, 0.2, 0.3), 0.6)]
    geometry = synthetic.geometry_of(parts)
    geometry = replace(geometry, vertices=geometry.vertices * scale + place)
    eye = np.array([-3.0, -2.4, 1.6]) * scale + place
    view = synthetic.perspective_view(
        synthetic.looking_at(eye, np.array([0.3, 0.2, 0.5]) * scale + place),
        64, 48, 1.2, near=1e-3 * scale, far=1e2 * scale,
    )  # fmt: skip
    origin = eye + scale * np.array([0.7, -0.4, 0.9])
    buffer, scene = GeometryBuffer(geometry, origin), LocalScene(geometry, origin)
    scene.mesh(geometry.camera_visible)
    surface_pass = VisibleSurfacePass(buffer)
    by_ray = surface_pass.draw_traced(
        view, (0.0, 0.0), TrianglesByRay(buffer, scene, 0, software=True)
    )
    assert by_ray is not None
    assert by_ray.hits is not None
    traced, rasterized = (seen_of(each, scene) for each in (by_ray, surface_pass.draw(view)))
    assert 0.2 < traced.hit.mean() < 0.9
    both = traced.hit & rasterized.hit
    # But at outlines.
    assert np.mean(traced.hit != rasterized.hit) < 0.01
    one, other = (
        [
            values[..., seen.number[both]]
            for values in (known.place, known.normal, known.lift, known.triangle)
        ]
        for seen, known in ((seen, seen.receivers) for seen in (traced, rasterized))
    )
    same = one[3] == other[3]
    assert same.mean() > 0.98
    assert np.array_equal(one[1][:, same], other[1][:, same])
    # Embree's distances are off by some spacings, more where the surface is seen from the side.
    apart = np.linalg.norm(one[0] - other[0], axis=0)[same]
    assert apart.max() < 100.0 * SPACING * np.linalg.norm(eye - place)
    np.testing.assert_allclose(one[2][same], other[2][same], rtol=1e-4)


def test_places_between_others() -> None:
    """On a plane all are; at a step, beside nothing and at the last column none."""
    row, column = np.mgrid[0:9, 0:12].astype(np.float64)
    place = np.stack([column, row, np.where(column >= 5, 10.0, 0.0)])
    place[:, 3:6, 8] = np.nan
    even = lies_between(place.astype(np.float32))
    want = np.zeros(even.shape, dtype=np.bool_)
    want[:, 1::2] = want[1::2] = True
    # Between columns 4 and 6, and after column 10.
    want[:, [5, 11]] = False
    # Beside what sees nothing: (4, 8) is one of even row and column.
    want[3:6, 7:10] = False
    # Of these, every other.
    coarse = np.zeros((5, 6), dtype=np.bool_)
    coarse[:, 1::2] = coarse[1::2] = True
    # Between columns 4 and 8 it is no middle, nor beside what sees nothing; none comes after 8.
    coarse[:, [3, 5]] = False
    coarse[1:4:2, 4] = False
    want[::2, ::2] = coarse
    assert np.array_equal(even, want)


def blobs(rng: np.random.Generator, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Large shapes without anything narrower than eight pixels."""
    coarse = rng.random((size[0] // 8, size[1] // 8)) < 0.5
    return np.kron(coarse, np.ones((8, 8), dtype=np.bool_)).astype(np.bool_)


def test_large_shapes_are_found_whole() -> None:
    """Each pixel, with fewer than half of the rays, whichever side is lit."""
    rng = np.random.default_rng(5)
    size = (64, 96)
    truth = blobs(rng, size)
    sides = np.where(blobs(rng, size), 1, -1).astype(np.int8)
    sides[rng.random(size) < 0.01] = 0
    sent = np.zeros(size, dtype=np.int64)

    def ask(pixel: NDArray[np.int64]) -> NDArray[np.bool_]:
        sent.ravel()[pixel] += 1
        return truth.ravel()[pixel]

    want = sides * np.where(truth, SEEN, HIDDEN)
    found = look_sparsely(ask, sides, np.ones(size, dtype=np.bool_))
    assert np.array_equal(found, want)
    assert sent.max() == 1
    assert sent.mean() < 0.5
    assert not sent[sides == 0].any()
    # Where nothing lies evenly every pixel is asked.
    found = look_sparsely(ask, sides, np.zeros(size, dtype=np.bool_))
    assert np.array_equal(found, want)
    assert np.array_equal(sent >= 1, sides != 0)


def test_what_lies_between_the_rays_is_lost_and_nothing_else() -> None:
    """A speck is; what is two pixels wide and eight long is there, whole, and no wider, and so is a
    crooked line that meets a single ray."""
    size = (48, 48)
    truth = np.ones(size, dtype=np.bool_)
    truth[5:8, 9:12] = False
    truth[21:23, 24:32] = False
    truth[24:32, 41:43] = False
    line = np.arange(12)
    truth[36 + line // 3, 4 + line] = False
    sides = np.ones(size, dtype=np.int8)
    found = look_sparsely(lambda pixel: truth.ravel()[pixel], sides, np.ones(size, dtype=np.bool_))
    truth[5:8, 9:12] = True
    assert np.array_equal(found == SEEN, truth)


@pytest.mark.parametrize("name", EDGE_LIGHTS)
def test_shadows_of_fewer_rays(gpu_context: None, name: str) -> None:
    """The same shadow of a square on a floor, for fewer rays."""
    geometry = synthetic.geometry_of([square(2.0, 0.0), square(0.4, 1.0)])
    points = floor_points(np.linspace(-1.0, 1.0, 90), np.linspace(-0.9, 0.9, 70))
    buffer = surfaces(points, UP, eye=(0.0, 0.0, 10.0)).upload()
    light, shadows = EDGE_LIGHTS[name], TracedShadowPass(geometry)
    every, some = (
        shadows.draw(buffer, light, light_sample(light, 0, 1), sparse=sparse)
        for sparse in (False, True)
    )
    assert np.array_equal(read_texture(some.spots), read_texture(every.spots))
    assert some.rays < 0.5 * every.rays


@pytest.mark.parametrize("name", ["point", "sun"])
def test_shadows_of_fewer_rays_on_what_is_smooth(gpu_context: None, name: str) -> None:
    """Near the terminator they start where those of an edit do; a part of the view sees nothing."""
    geometry, origin = ball(), np.zeros(3)
    view = synthetic.perspective_view(
        synthetic.looking_at((0.0, -4.0, 0.5), (0.3, 0.0, 0.0)), 160, 120, 0.7, near=0.1, far=50.0
    )
    drawn = VisibleSurfacePass(GeometryBuffer(geometry, origin)).draw(view)
    buffer = buffer_of(drawn, origin)
    light, shadows = lights()[name], TracedShadowPass(geometry)
    light = replace(light, world_from_light=synthetic.looking_at((3.0, -1.0, 1.5), (0.0, 0.0, 0.0)))
    every, some = (
        read_texture(shadows.draw(buffer, light, light_sample(light, 0, 1), sparse=sparse).spots)
        for sparse in (False, True)
    )
    assert 0.1 < np.mean(every > SIDE_IS_KNOWN + 1.0) < 0.4
    assert np.count_nonzero(some != every) <= 4
