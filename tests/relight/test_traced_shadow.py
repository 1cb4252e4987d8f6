# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced shadows: against closed forms, in scenes from a millimetre to a hundred kilometres."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.glsl.shader import read_texture, texture_from_array
from addon.relight.light_points.light_cells import SPOTS
from addon.relight.light_points.light_sample import LightSample, light_sample
from addon.relight.light_points.turned_disk import turned_way
from addon.relight.shading.picture_tiles import PictureTiles
from addon.relight.shadows.receivers import SeenReceivers
from addon.relight.shadows.traced_shadow import TracedShadow, TracedShadowPass
from addon.scene.geometry import Cutout, SceneGeometry
from addon.scene.light import Light
from tests.reference import light_pass as light_twin
from tests.reference.cutout import mask_alpha
from tests.reference.surfaces import Surfaces, random_surfaces, surfaces
from tests.synthetic import box, geometry_of, looking_at

from .drawing import drawn_light
from .test_shadow import EDGE_LIGHTS, WHITE, floor_points, light_at, square

pytestmark = pytest.mark.usefixtures("gpu_context")

UP = np.array([0.0, 0.0, 1.0])
Array = NDArray[np.float64]


def traced(
    geometry: SceneGeometry,
    light: Light,
    surface: Surfaces,
    sample: LightSample | None = None,
    casters: NDArray[np.bool_] | None = None,
    *,
    sparse: bool = False,
) -> tuple[TracedShadow, Array]:
    """The shadow, and its share: light that arrives over light that would without shadows."""
    sample = sample or light_sample(light, 0, 1)
    buffer = surface.upload()
    shadow = TracedShadowPass(geometry).draw(buffer, light, sample, casters=casters, sparse=sparse)
    both = [
        drawn_light(surface, light, [sample], shadow=chosen)[..., 0] for chosen in (shadow, None)
    ]
    return shadow, np.divide(both[0], both[1], out=np.zeros_like(both[0]), where=both[1] > 0.0)


def placed(light: Light, scale: float, offset: Array) -> Light:
    """The light in a scene that is scaled and moved, as bright there."""
    place = light.world_from_light.copy()
    place[:3, 3] = place[:3, 3] * scale + offset
    power = 1.0 if light.type == "SUN" else scale * scale
    return replace(
        light,
        world_from_light=place,
        energy=light.energy * power,
        size=light.size * scale,
        shadow_soft_size=light.shadow_soft_size * scale,
    )


def moved(geometry: SceneGeometry, scale: float, offset: Array) -> SceneGeometry:
    return replace(geometry, vertices=geometry.vertices * scale + offset)


PLACES = {
    "a room": (1.0, (0.0, 0.0, 0.0)),
    "a millimetre": (1e-3, (0.0, 0.0, 0.0)),
    "a hundred kilometres": (1e5, (0.0, 0.0, 0.0)),
    "a million metres away": (1.0, (1e6, -1e6, 1e6)),
}


@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("name", EDGE_LIGHTS)
def test_edge_of_a_square(name: str, where: str) -> None:
    """A square of half side a, at height h below a light at height H, casts a shadow of half
    side a H / (H - h) (sun: a); each pixel is on the right side of that edge."""
    a, h, H = 0.4, 1.0, 3.0
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    geometry = moved(geometry_of([square(2.0, 0.0), square(a, h)]), scale, offset)
    light = placed(EDGE_LIGHTS[name], scale, offset)
    edge = a if light.type == "SUN" else a * H / (H - h)
    xs = np.linspace(0.0, 1.2, 241) + 1e-4
    points = floor_points(xs, np.linspace(-0.2, 0.2, 5)) * scale
    eye = (0.0, 0.0, 10.0 * scale)
    surface = surfaces(points, UP, origin=tuple(offset), eye=eye)
    _, share = traced(geometry, light, surface)
    assert np.array_equal(share, np.broadcast_to(xs > edge, share.shape).astype(float))


@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
@pytest.mark.parametrize("tilt", [0.0, 89.0, 89.999])
def test_nothing_shadows_a_plane(kind: str, tilt: float, where: str) -> None:
    """No acne: a lone plane is wholly lit, up to grazing incidence."""
    angle = np.radians(tilt)
    direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    geometry = moved(geometry_of([square(4.0, 0.0)]), scale, offset)
    light = light_at(kind, tuple(direction * 5.0), (0.0, 0.0, 0.0), spot_size=1.2)
    light = placed(light, scale, offset)
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-1.5, 1.5, (100, 100, 2)), np.zeros((100, 100, 1))], -1)
    eye = (0.0, 0.0, 10.0 * scale)
    surface = surfaces(points * scale, UP, origin=tuple(offset), eye=eye)
    _, share = traced(geometry, light, surface)
    reached = light_twin.incidence(surface, light, light_sample(light, 0, 1))[1] > 0.0
    assert reached.mean() > 0.5
    assert (share[reached] == 1.0).all()


@pytest.mark.parametrize("where", PLACES)
def test_contact_is_shadowed(where: str) -> None:
    """No gap between a box and the shadow at its foot, down to a hundred thousandth of its
    size; no shadow before the lit side."""
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    parts = [square(4.0, 0.0), box((0.0, 0.0, 0.5), 1.0)]
    geometry = moved(geometry_of(parts), scale, offset)
    light = placed(light_at("POINT", (3.0, 0.0, 2.0), (0.0, 0.0, 0.0)), scale, offset)
    away = np.geomspace(1e-5, 0.2, 50)
    eye = (0.0, 0.0, 10.0 * scale)
    for side, lit in ((-0.5 - away, 0.0), (0.5 + away, 1.0)):
        points = floor_points(side, np.linspace(-0.3, 0.3, 7)) * scale
        surface = surfaces(points, UP, origin=tuple(offset), eye=eye)
        assert (traced(geometry, light, surface)[1] == lit).all()


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("name", EDGE_LIGHTS)
def test_what_lies_in_another_plane_is_black(name: str, where: str, sparse: bool) -> None:
    """A square of half side a in a floor, as of Cycles; not one a little below, nor one that casts
    no shadow."""
    a, xs, ys = 0.4, np.linspace(-1.0, 1.0, 200), np.linspace(-1.0, 1.0, 100)
    scale, offset = PLACES[where][0], np.array(PLACES[where][1])
    light = placed(EDGE_LIGHTS[name], scale, offset)
    points = floor_points(xs, ys) * scale
    surface = surfaces(points, UP, origin=tuple(offset), eye=(0.0, 0.0, 10.0 * scale))
    inside = (np.abs(ys)[:, None] < a) & (np.abs(xs) < a)

    def share(below: float, casters: NDArray[np.bool_] | None = None) -> Array:
        geometry = moved(geometry_of([square(2.0, 0.0), square(a, -below)]), scale, offset)
        return traced(geometry, light, surface, None, casters, sparse=sparse)[1]

    lit = share(0.01)
    assert lit.mean() > 0.5
    assert np.array_equal(share(0.0), np.where(inside, 0.0, lit))
    assert np.array_equal(share(0.0, np.zeros(4, dtype=np.bool_)), lit)


def test_rasterized_error_of_a_large_triangle() -> None:
    """A view that stands on a floor of 100 km gets positions that are off that floor by what
    float32 rounds there; the rays start from the floor all the same."""
    geometry = geometry_of([square(1e5, 0.0)])
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.uniform(-50, 50, (64, 64, 2)), np.zeros((64, 64, 1))], -1)
    points[..., 2] = rng.uniform(-5e-3, 5e-3, (64, 64))
    surface = surfaces(points, UP, eye=(0.0, 0.0, 1.7))
    light = light_at("POINT", (30.0, 0.0, 2.0), (0.0, 0.0, 0.0))
    assert (traced(geometry, light, surface)[1] == 1.0).all()


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_lamp_on_a_wall(kind: str) -> None:
    """A lamp h before a wall, seen at an angle t from the wall's normal: Cycles turns its disk
    of radius r towards the receiver, and the wall hides the disk's segment beyond the chord at
    h / sin t from its centre. For x = h / (r sin t) < 1 that leaves
    1 - (acos x - x sqrt(1 - x^2)) / pi of it."""
    light = light_at(kind, (0.0, 0.0, 0.02), (0.6, 0.0, 5.0), spot_size=1.3, shadow_soft_size=0.1)
    geometry = geometry_of([square(4.0, 0.0)])
    angle = np.radians(np.arange(15.0, 42.0, 3.0))
    points = 5.0 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    # Blocks of pixels that look at all spots of a cell.
    blocks = np.tile(np.repeat(points, 4, axis=0), (4, 1, 1))
    surface = surfaces(blocks, -blocks / 5.0)
    count = 256
    share = np.zeros(len(angle))
    for k in range(count):
        sample = light_sample(light, k, count, per_receiver=True)
        share += traced(geometry, light, surface, sample)[1][2, 2::4] / count
    x = np.minimum(0.02 / (0.1 * np.sin(angle)), 1.0)
    want = 1.0 - (np.arccos(x) - x * np.sqrt(1.0 - x * x)) / np.pi
    # 256 points of a low-discrepancy sequence: a few points on the wrong side of a chord. Maps
    # are allowed 0.07 and 0.15 here, for they share their disks.
    assert share == pytest.approx(want, abs=0.015)


@pytest.mark.parametrize("soft", [True, False], ids=["disk", "ball"])
@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_own_points_against_the_twin(kind: Literal["POINT", "SPOT"], soft: bool) -> None:
    """Each receiver's own point: float32 against float64, lobes and all."""
    surface = random_surfaces(3)
    place = looking_at((100.5, -49.0, 21.5), (100.0, -50.0, 19.0))
    light = Light(kind, kind, place, 40.0, WHITE, shadow_soft_size=0.4, spot_size=1.9,
                  use_soft_falloff=soft)  # fmt: skip
    for k in range(4):
        sample = light_sample(light, k, 7, per_receiver=True)
        want = light_twin.light_layer(surface, light, sample)
        got = drawn_light(surface, light, [sample])[..., :3]
        # As for other lights (test_passes.py): float32 lobes, steep where they are narrow.
        size = np.abs(want) + 1e-4 * np.abs(want).mean()
        assert np.percentile(np.abs(got - want) / size, 99.5) < 1e-3


@pytest.mark.parametrize(
    ("soft", "distance"),
    [(True, 0.05), (True, 0.3), (True, 30.0), (False, 0.3), (False, 1.0), (False, 30.0)],
)
def test_mean_irradiance(soft: bool, distance: float) -> None:
    """Facing a disk of radius r and intensity I at d, a white Lambert plane reflects
    I / (pi (d^2 + r^2)); facing a ball of that radius from outside I / (pi d^2)."""
    radius = 0.2
    light = Light("l", "POINT", np.eye(4), 4.0 * np.pi, WHITE, shadow_soft_size=radius,
                  use_soft_falloff=soft)  # fmt: skip
    surface = surfaces(np.array([[[distance, 0.0, 0.0]]]), np.array([-1.0, 0.0, 0.0]))
    # The nearest one sees nearly all of its light come from a sixteenth of the disk.
    count = 1024 if distance < 0.5 * radius else 256
    samples = [light_sample(light, k, count, per_receiver=True) for k in range(count)]
    got = drawn_light(surface, light, samples)[0, 0, 0]
    want = 1.0 / (np.pi * (distance**2 + (radius**2 if soft else 0.0)))
    # What the points leave where the integrand falls to a hundredth from the middle to the rim.
    assert got == pytest.approx(want, rel=0.02 if distance < radius else 0.003)


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_cut_outs(extension: str) -> None:
    """Through two masked squares light passes where both are cut away, by the bilinear test."""
    geometry = geometry_of([square(4.0, 0.0), square(1.0, 0.5), square(1.0, 0.7)])
    rng = np.random.default_rng(8)
    alpha = rng.random((8, 6)).astype(np.float32)
    corner = geometry.vertices[geometry.triangles][..., :2]
    cutouts = tuple(
        Cutout(number, alpha if number == 1 else alpha[::-1], extension)  # type: ignore[arg-type]
        for number in (1, 2)
    )
    geometry = replace(geometry, uv=corner.astype(np.float32) * 0.9 + 0.4, cutouts=cutouts)
    sun = light_at("SUN", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    xs = np.linspace(-1.3, 1.3, 160)
    points = floor_points(xs, xs)
    _, share = traced(geometry, sun, surfaces(points, UP))
    uv = points[..., :2].reshape(-1, 2) * 0.9 + 0.4
    over = (np.abs(points[..., :2]) < 1.0).all(axis=-1).ravel()
    masks = np.stack([mask_alpha(cutout.alpha, uv, extension) for cutout in cutouts])
    want = ~over | (masks < 0.5).all(axis=0)
    clear = (np.abs(masks - 0.5) > 1e-4).all(axis=0)
    assert 0.1 < want[over].mean() < 0.9
    assert np.array_equal(share.ravel()[clear] > 0.5, want[clear])


def test_many_layers_of_cut_outs() -> None:
    """Light finds its way through a hundred leaves that are cut away where it passes."""
    parts = [square(4.0, 0.0), *(square(1.0, 0.5 + 0.01 * k) for k in range(100))]
    geometry = geometry_of(parts)
    alpha = np.ones((8, 8), dtype=np.float32)
    alpha[2:6, 2:6] = 0.0
    geometry = replace(
        geometry,
        uv=(geometry.vertices[geometry.triangles][..., :2] * 0.5 + 0.5).astype(np.float32),
        cutouts=tuple(Cutout(k, alpha, "CLIP") for k in range(1, 101)),
    )
    sun = light_at("SUN", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    surface = surfaces(floor_points(np.array([0.0, 0.2, 0.8, 1.2]), np.array([0.1])), UP)
    assert traced(geometry, sun, surface)[1].tolist() == [[1.0, 1.0, 0.0, 1.0]]


def test_chosen_casters() -> None:
    """`shadow_visible` triangles cast, or those that are named instead."""
    geometry = geometry_of([square(2.0, 0.0), square(0.4, 1.0), square(0.2, 1.1, (0.8, 0.0))])
    geometry = replace(geometry, shadow_visible=geometry.object_id != 1)
    light = EDGE_LIGHTS["sun"]
    surface = surfaces(floor_points(np.array([0.0, 0.8, 1.5]), np.zeros(1)), UP)
    assert traced(geometry, light, surface)[1].tolist() == [[1.0, 0.0, 1.0]]
    only = geometry.object_id == 1
    assert traced(geometry, light, surface, casters=only)[1].tolist() == [[0.0, 1.0, 1.0]]


def test_no_ray_where_no_light_comes() -> None:
    """Behind a spot's cone, on the side that looks away, and where nothing is seen."""
    geometry = geometry_of([square(4.0, 0.0)])
    spot = light_at("SPOT", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), spot_size=0.5)
    xs = np.linspace(-2.0, 2.0, 81)
    surface = surfaces(floor_points(xs, xs), UP)
    reached = light_twin.incidence(surface, spot, light_sample(spot, 0, 1))[1] > 0.0
    assert traced(geometry, spot, surface)[0].rays == reached.sum()
    unseen = surface.position.copy()
    unseen[..., 3] = 0.0
    assert traced(geometry, spot, replace(surface, position=unseen))[0].rays == 0
    below = light_at("POINT", (0.0, 0.0, -3.0), (0.0, 0.0, 0.0))
    assert traced(geometry, below, surface)[0].rays == 0


def test_light_comes_through_what_is_translucent() -> None:
    """A leaf lit from behind: the ray starts on its other side, and a box hides the light."""
    geometry = geometry_of([square(4.0, 0.0), box((0.5, 0.0, -1.0), 0.5)])
    surface = surfaces(floor_points(np.array([-1.0, 0.5]), np.zeros(1)), UP)
    through = {"translucent_color": np.ones((1, 2, 3))}
    surface = replace(surface, channels={**surface.channels, **through})
    sun = light_at("SUN", (0.0, 0.0, -3.0), (0.0, 0.0, 0.0))
    assert traced(geometry, sun, surface)[1].tolist() == [[1.0, 0.0]]


@pytest.mark.parametrize("where", PLACES)
def test_what_holds_a_lamp_does_not_hide_it(where: str) -> None:
    """A hard lamp's point lies exactly in a pane: rays end before that."""
    scale, away = PLACES[where]
    offset = np.array(away)
    geometry = moved(geometry_of([square(4.0, 0.0), square(0.5, 1.0)]), scale, offset)
    light = placed(light_at("POINT", (0.1, 0.05, 1.0), (0.1, 0.05, 0.0)), scale, offset)
    xs = np.linspace(-3.0, 3.0, 41)
    surface = surfaces(
        floor_points(xs, xs) * scale, UP, origin=tuple(offset), eye=(0, 0, 0.9 * scale)
    )
    assert (traced(geometry, light, surface)[1] == 1.0).all()


def test_a_layer_of_fewer_pixels() -> None:
    """With a stride, each pixel of the layer asks for its own pixel of the surface."""
    geometry = geometry_of([square(2.0, 0.0), square(0.4, 1.0)])
    xs = np.linspace(-1.0, 1.0, 41)
    surface = surfaces(floor_points(xs, xs), UP).upload()
    light = EDGE_LIGHTS["point"]
    shadows = TracedShadowPass(geometry)
    sample = light_sample(light, 0, 1)
    whole, coarse = (
        read_texture(shadows.draw(surface, light, sample, stride=stride).spots) for stride in (1, 4)
    )
    middle = np.minimum(np.arange(11) * 4 + 2, 40)
    assert np.array_equal(coarse, whole[np.ix_(middle, middle)])


def test_receivers_are_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a sample of the view, also where it is laid out anew for edits of surfaces."""
    found: list[Any] = []
    real = SeenReceivers.of

    def counted(*given: Any) -> Any:
        found.append(given)
        return real(*given)

    monkeypatch.setattr(SeenReceivers, "of", counted)
    xs = np.linspace(-1.0, 1.0, 5)
    buffer = surfaces(floor_points(xs, xs), UP).upload()
    shadows = TracedShadowPass(geometry_of([square(2.0, 0.0)]))
    light = light_at("POINT", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for _ in range(3):
        shadows.draw(replace(buffer), light, light_sample(light, 0, 1))
    assert len(found) == 1
    other = surfaces(floor_points(xs, xs), UP).upload()
    shadows.draw(other, light, light_sample(light, 0, 1))
    assert len(found) == 2


@pytest.mark.parametrize("kind", ["AREA", "SUN", "POINT"])
def test_penumbra_of_few_samples(kind: Literal["AREA", "SUN", "POINT"]) -> None:
    """Below a half-plane at half the light's height: the share of the light beyond the edge, as
    seen from each place. Four samples have four cells, and 16 spots of each where it is seen in
    parts: what is left is a row of a quarter of the spots, of both cells along the edge."""
    geometry = geometry_of([square(20.0, 0.0), square(5.0, 1.0, (-5.0, 0.0))])
    size = {"size": 1.0} if kind == "AREA" else {"shadow_soft_size": 0.5}
    size = {"angle": 0.9} if kind == "SUN" else size
    light = light_at(kind, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), **size)
    # Wide enough that all spots are looked at where the light is seen in parts.
    xs = np.linspace(-4.0, 4.0, 400)
    surface = surfaces(floor_points(xs, np.linspace(-0.1, 0.1, 8)), UP)
    share, rays = np.zeros((8, 400)), 0
    for k in range(4):
        shadow = TracedShadowPass(geometry).draw(
            surface.upload(), light, light_sample(light, k, 4, per_receiver=True)
        )
        share += spot_share(shadow) / 4
        rays += shadow.rays
    # From a sun the edge is at the sine x / sqrt(1 + x^2) across the zenith.
    sine = xs / np.sqrt(1.0 + xs * xs)
    from_edge = sine / np.sin(0.45) if kind == "SUN" else 2.0 * xs
    x = np.clip(from_edge, -1.0, 1.0)
    want = 0.5 + 0.5 * x
    if kind != "AREA":
        want = 0.5 + (np.arcsin(x) + x * np.sqrt(1.0 - x * x)) / np.pi
    # Four points alone would leave 1/8 and more.
    assert np.abs(share - want)[2:-2].max() < 1.0 / 32.0
    assert np.abs((share - want).mean()) < 2e-3
    # The penumbra is an eighth of the picture, of each cell about the half of that.
    assert rays < 4 * share.size * 2.5


def test_spots_where_all_is_seen_take_a_ray_each() -> None:
    geometry = geometry_of([square(4.0, 0.0)])
    light = light_at("AREA", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), size=1.0)
    surface = surfaces(floor_points(np.linspace(-1.0, 1.0, 20), np.linspace(-1.0, 1.0, 20)), UP)
    shadow = TracedShadowPass(geometry).draw(surface.upload(), light, light_sample(light, 1, 4))
    assert shadow.rays == 400
    assert (spot_share(shadow) == 1.0).all()


@pytest.mark.parametrize("soft", [True, False], ids=["disk", "ball"])
def test_turned_ways_against_the_twin(soft: bool) -> None:
    """Rays go where the shader's light comes from, from inside a ball too."""
    rng = np.random.default_rng(3)
    place = looking_at((1.0, 2.0, 3.0), (0.3, -1.0, 0.0))
    light = Light("l", "SPOT", place, 1.0, WHITE, shadow_soft_size=0.5, use_soft_falloff=soft)
    receivers = light.position + rng.normal(size=(200, 3)) * rng.choice([0.2, 1.0, 30.0], (200, 1))
    on_disk = 0.5 * np.sqrt(rng.random((200, 1))) * unit(rng.normal(size=(200, 2)))
    got = turned_way(light, receivers - light.position, on_disk)
    want = [
        light_twin.turned_way(light, receiver[None, None], point)[0][0, 0]
        for receiver, point in zip(receivers, on_disk, strict=True)
    ]
    assert got == pytest.approx(np.array(want), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", ["AREA", "SUN", "POINT"])
def test_highlights_by_their_own_spots(kind: Literal["AREA", "SUN", "POINT"]) -> None:
    """What a lobe sees of a cell that is hidden in parts: float32 against float64, with shadows of
    any shape."""
    surface = random_surfaces(5, 48)
    place = looking_at((100.5, -49.0, 21.5), (100.0, -50.0, 19.0))
    light = Light(kind, kind, place, 40.0, WHITE, shadow_soft_size=0.4, size=0.8, angle=0.3)
    rng = np.random.default_rng(1)
    opened = rng.random((*surface.position.shape[:2], SPOTS)) < rng.random((48, 48, 1)).round(1)
    bits = (opened @ (1 << np.arange(SPOTS))).astype(np.float32)[..., None]
    lit = PictureTiles.around(opened.any(axis=-1))
    shadow = TracedShadow(texture_from_array(bits, "R32F"), 0, lit)
    for k in range(2):
        sample = light_sample(light, 2 * k, 7, per_receiver=True)
        want = light_twin.light_layer(surface, light, sample, opened.mean(axis=-1), spots=opened)
        got = drawn_light(surface, light, [sample], shadow=shadow)[..., :3]
        # As for other lights (test_passes.py): float32 lobes, steep where they are narrow.
        size = np.abs(want) + 1e-4 * np.abs(want).mean()
        assert np.percentile(np.abs(got - want) / size, 99.5) < 1e-3


def spot_share(shadow: TracedShadow) -> Array:
    """(H, W): of the light's spots those that are seen."""
    bits = read_texture(shadow.spots)[..., 0].astype(np.int64)
    return ((bits[..., None] >> np.arange(SPOTS)) & 1).mean(axis=-1)


def unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
