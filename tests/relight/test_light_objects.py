# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects in the light pass and in shadow maps: against the float64 twin and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.corrmap.visible_surface import VisibleSurfacePass
from addon.glsl.shader import PassShader, ShaderProgram, read_texture
from addon.relight.light_points.light_contact import touches_surface
from addon.relight.light_points.light_sample import light_sample
from addon.relight.lights.light_objects import LightObjects
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.scene.geometry import Cutout, SceneGeometry
from addon.scene.light import Light
from addon.scene.light_linking import (
    LightLinking,
    LinkedObjects,
    ObjectSelection,
    ObjectWeight,
)
from tests.reference import light_pass as twin
from tests.reference.surfaces import random_surfaces, surfaces
from tests.synthetic import box, geometry_of, looking_at, perspective_view

from .drawing import drawn_light
from .test_passes import assert_close

pytestmark = pytest.mark.usefixtures("gpu_context")

WHITE = np.ones(3)
SETTINGS = ShadowSettings(resolution=256, cube_resolution=128)


def many_boxes(count: int) -> SceneGeometry:
    """Small boxes in rows of 50, a metre apart."""
    return geometry_of([box((i % 50, i // 50, 0.0), 0.4) for i in range(count)])


def light_with(linking: LightLinking, place: tuple[float, float, float] = (0, 0, 9)) -> Light:
    at = looking_at(place, (0.1, 0.2, 0.0))
    return Light("l", "POINT", at, 100.0, WHITE, linking=linking)


def random_selection(rng: np.random.Generator, count: int) -> ObjectSelection:
    weights = 10.0 * rng.random((count // 2, 2)) * (rng.random((count // 2, 2)) < 0.8)
    return ObjectSelection(
        tuple(ObjectWeight(f"part {i}", *map(float, w)) for i, w in enumerate(weights)), 0.5
    )


@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("shadowed", [False, True])
def test_light_pass(lobes: int, shadowed: bool) -> None:
    """Weights of 3000 objects, of which a third cast no shadow of this light."""
    rng = np.random.default_rng(0)
    count = 3000
    geometry = many_boxes(count)
    excluded = frozenset(f"part {i}" for i in range(0, count, 3))
    linking = LightLinking(
        blockers=LinkedObjects(excluded=excluded), selection=random_selection(rng, count)
    )
    light = light_with(linking)
    surface = random_surfaces(3, lobes=lobes)
    place = surface.origin + np.array([1.0, -2.0, 3.0])
    light = replace(light, world_from_light=looking_at(place, surface.origin))
    ids = rng.integers(0, count, surface.hit.shape)
    surface = replace(surface, objects=np.where(surface.hit, ids, -1))
    shares, sample = LightObjects(geometry).of(light), light_sample(light, 0, 1)
    assert not shares.blocks[0]
    assert shares.blocks[1]
    shadow, seen = None, None
    if shadowed:
        # The boxes are far from the surfaces: nothing but a surface itself hides the light.
        buffer = GeometryBuffer(geometry, surface.origin)
        around = np.array([[-3.0] * 3, [3.0] * 3]) + surface.origin
        shadow = ShadowPass(buffer, SETTINGS).draw(
            light, sample, geometry.bounds, around, objects=np.zeros(count, dtype=np.bool_)
        )
        seen = np.ones(surface.hit.shape)
    got = drawn_light(surface, light, [sample], shadow=shadow, shares=shares)[..., :3]
    want = twin.light_layer(surface, light, sample, seen, shares)
    if shadowed:
        # At the horizon the texels about a surface's own may look away from its plane.
        L = twin.incidence(surface, light, sample)[0]
        grazing = np.abs((L * surface.geometric_normal[..., :3]).sum(axis=-1)) < 0.05
        got[grazing] = want[grazing] = 0.0
    assert_close(got, want)
    assert got.any()


def test_nothing_for_lights_that_need_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """No table, no sampler, no define; and one table for lights that are linked alike."""
    geometry = many_boxes(4)
    objects = LightObjects(geometry)
    plain = objects.of(light_with(LightLinking()))
    assert (plain.casters, plain.texture) == (None, None)
    every = LinkedObjects(frozenset(f"part {i}" for i in range(4)))
    all_named = objects.of(light_with(LightLinking(every, every)))
    assert (all_named.casters, all_named.texture) == (None, None)
    some = LightLinking(LinkedObjects(frozenset(["part 1"])))
    assert objects.of(light_with(some)) is objects.of(light_with(some, (1, 2, 3)))

    described: list[PassShader] = []
    build = PassShader.build

    def listed(description: PassShader) -> ShaderProgram:
        described.append(description)
        return build(description)

    monkeypatch.setattr(PassShader, "build", listed)
    surface = replace(random_surfaces(1), objects=np.zeros((96, 96), dtype=np.int64))
    light = light_with(some)
    for shares in (plain, objects.of(light)):
        drawn_light(surface, light, [light_sample(light, 0, 1)], shares=shares)
    without, with_objects = (d for d in described if d.fragment == "light")
    assert not any("object" in name for name, _ in without.samplers)
    assert "HAS_OBJECTS" not in dict(without.defines)
    assert "HAS_OBJECTS" in dict(with_objects.defines)


def test_hidden_objects_count_for_nothing() -> None:
    """What no camera sees needs no table, however it is lit; what casts nothing is no caster."""
    geometry = many_boxes(3)
    hidden = geometry.object_id != 1
    linking = LightLinking(LinkedObjects(excluded=frozenset(["part 1"])))
    assert LightObjects(geometry).of(light_with(linking)).texture is not None
    unseen = replace(geometry, camera_visible=hidden)
    assert LightObjects(unseen).of(light_with(linking)).texture is None
    uncast = replace(geometry, shadow_visible=hidden)
    shares = LightObjects(uncast).of(light_with(LightLinking()))
    assert shares.casters is None
    assert shares.texture is not None
    no_shadow = replace(light_with(LightLinking()), use_shadow=False)
    assert LightObjects(uncast).of(no_shadow).texture is None


def with_cutout(geometry: SceneGeometry) -> SceneGeometry:
    """The third object has an opaque mask, so that it is drawn by another program."""
    opaque = Cutout(2, np.ones((1, 1), dtype=np.float32), "EXTEND")
    return replace(geometry, cutouts=(opaque,), uv=np.zeros((len(geometry), 3, 2), np.float32))


@pytest.mark.parametrize("masked", [False, True])
def test_objects_of_pixels(masked: bool) -> None:
    """Each box under its own pixel, exactly, and the surfaces the same as without."""
    geometry = many_boxes(2500)
    # Triangles need not be sorted by object.
    order = np.random.default_rng(1).permutation(len(geometry))
    per_triangle = ("triangles", "object_id", "material_id", "weight", "camera_visible",
                    "shadow_visible")  # fmt: skip
    geometry = replace(geometry, **{name: getattr(geometry, name)[order] for name in per_triangle})
    if masked:
        geometry = with_cutout(geometry)
    far = looking_at((24.5, 24.5, 200.0), (24.5, 24.5, 0.0), (0, 1, 0))
    view = perspective_view(far, 50, 50, 2.0 * float(np.arctan(25.0 / 200.0)), far=300.0)
    visible = VisibleSurfacePass(GeometryBuffer(geometry, view.origin))
    plain, numbered = visible.draw(view), visible.draw(view, with_objects=True)
    assert plain.objects is None
    numbers = read_texture(numbered.objects)[..., 0]
    np.testing.assert_array_equal(numbers.ravel(), 1.0 + np.arange(2500))
    np.testing.assert_array_equal(read_texture(plain.position), read_texture(numbered.position))
    np.testing.assert_array_equal(read_texture(plain.normal), read_texture(numbered.normal))


def shadowed_floor(geometry: SceneGeometry, light: Light) -> NDArray[np.bool_]:
    """(50,) whether there is shadow right under the middle of each box of one row."""
    x = np.arange(50, dtype=np.float64)
    points = np.stack([x, np.zeros(50), np.full(50, -0.3)], axis=-1)[None]
    surface = surfaces(points, np.array([0.0, 0.0, 1.0]), eye=(25.0, 0.0, 50.0))
    sample, shares = light_sample(light, 0, 1), LightObjects(geometry).of(light)
    shadow = ShadowPass(GeometryBuffer(geometry, np.zeros(3)), SETTINGS).draw(
        light, sample, geometry.bounds, points[0], objects=shares.casters
    )
    return np.asarray(drawn_light(surface, light, [sample], shadow=shadow)[0, :, 0] == 0.0)


@pytest.mark.parametrize("masked", [False, True])
def test_shadows_of_chosen_objects(masked: bool) -> None:
    """Each box's shadow is there exactly when it blocks: none, all, every other, some."""
    geometry = many_boxes(50)
    if masked:
        geometry = with_cutout(geometry)
    down = looking_at((0, 0, 9), (0, 0, 0), (0, 1, 0))
    sun = Light("l", "SUN", down, 3.0, WHITE)
    rng = np.random.default_rng(2)
    for blocks in (
        np.zeros(50, dtype=np.bool_),
        np.ones(50, dtype=np.bool_),
        np.arange(50) % 2 == 0,
        rng.random(50) < 0.3,
    ):
        excluded = frozenset(f"part {i}" for i in np.flatnonzero(~blocks))
        light = replace(sun, linking=LightLinking(blockers=LinkedObjects(excluded=excluded)))
        np.testing.assert_array_equal(shadowed_floor(geometry, light), blocks)


def test_a_lamp_touches_only_what_blocks_it() -> None:
    geometry = many_boxes(2)
    lamp = Light(
        "l",
        "POINT",
        looking_at((0, 0, 0.5), (0, 0, 0), (0, 1, 0)),
        1.0,
        WHITE,
        shadow_soft_size=0.4,
    )
    assert touches_surface(lamp, geometry)
    assert not touches_surface(lamp, geometry, np.array([False, True]))
    assert touches_surface(lamp, geometry, np.array([True, False]))
