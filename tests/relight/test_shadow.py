# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps: against the float64 twin, against closed forms, and against traced rays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.glsl.shader import read_texture
from addon.relight.light_points.light_contact import touches_surface
from addon.relight.light_points.light_sample import LightSample, light_sample
from addon.relight.shadows.shadow_frustum import ShadowSettings, shadow_frustum
from addon.relight.shadows.shadow_pass import ShadowMap, ShadowPass
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from tests.reference import light_pass as light_twin
from tests.reference import shadow as twin
from tests.reference.surfaces import Surfaces, surfaces
from tests.synthetic import Tracer, box, geometry_of, looking_at, room_with_box

from .drawing import drawn_light

pytestmark = pytest.mark.usefixtures("gpu_context")

SETTINGS = ShadowSettings(resolution=512, cube_resolution=256)
WHITE = np.ones(3)
SQUARE = np.array([[0, 1, 2], [0, 2, 3]])


def square(
    half: float, z: float, center: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A square that faces up."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half + center
    return np.column_stack([corners, np.full(4, z)]), SQUARE


@dataclass(frozen=True)
class Lit:
    """Surfaces lit by one point of a light, with and without its shadow map."""

    shadow: ShadowMap
    visibility: NDArray[np.float64]


def lit(
    geometry: SceneGeometry,
    light: Light,
    surface: Surfaces,
    settings: ShadowSettings = SETTINGS,
    sample: LightSample | None = None,
) -> Lit:
    """The shadow's share: light that arrives, over light that would without shadows."""
    sample = sample or light_sample(light, 0, 1)
    buffer = GeometryBuffer(geometry, surface.origin)
    points = surface.position[..., :3].reshape(-1, 3) + surface.origin
    shadow = ShadowPass(buffer, settings).draw(light, sample, geometry.bounds, points)
    both = [
        drawn_light(surface, light, [sample], shadow=chosen)[..., 0] for chosen in (shadow, None)
    ]
    share = np.divide(both[0], both[1], out=np.zeros_like(both[0]), where=both[1] > 0.0)
    return Lit(shadow, share)


def floor_points(
    xs: NDArray[np.float64], ys: NDArray[np.float64], z: float = 0.0
) -> NDArray[np.float64]:
    x, y = np.meshgrid(xs, ys)
    return np.stack([x, y, np.full_like(x, z)], axis=-1)


def light_at(
    kind: str, place: tuple[float, float, float], target: tuple[float, float, float], **more: float
) -> Light:
    up = (0, 1, 0) if place[:2] == target[:2] else (0, 0, 1)
    return Light(kind, kind, looking_at(place, target, up), 100.0, WHITE, **more)  # type: ignore[arg-type]


EDGE_LIGHTS = {
    "point": light_at("POINT", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0)),
    "spot": light_at("SPOT", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), spot_size=1.6),
    "wide spot": light_at("SPOT", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), spot_size=3.0),
    "area": light_at("AREA", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), size=0.2),
    "sun": light_at("SUN", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("name", EDGE_LIGHTS)
@pytest.mark.parametrize("far_away", [(0.0, 0.0, 0.0), (3e5, -2e5, 1e4)])
def test_edge_of_a_square(name: str, far_away: tuple[float, float, float]) -> None:
    """A square of half side a, at height h below a light at height H, casts a shadow of half
    side a H / (H - h) (sun: a); the edge is found to a texel."""
    a, h, H = 0.4, 1.0, 3.0
    moved = np.array(far_away)
    geometry = geometry_of([square(2.0, 0.0), square(a, h)])
    geometry = replace(geometry, vertices=geometry.vertices + moved)
    light = EDGE_LIGHTS[name]
    place = light.world_from_light.copy()
    place[:3, 3] += moved
    light = replace(light, world_from_light=place)
    edge = a if light.type == "SUN" else a * H / (H - h)
    xs = np.linspace(0.0, 1.2, 241)
    points = floor_points(xs, np.linspace(-0.2, 0.2, 5))
    surface = surfaces(points, np.array([0.0, 0.0, 1.0]), origin=far_away)
    result = lit(geometry, light, surface)
    frustum = result.shadow.frustum
    texel = (
        2.0 * frustum.half_extents[-1] / frustum.resolution * (1.0 if light.type == "SUN" else H)
    )
    # 2x2 texels are mixed: a ramp of two texels; and points are 5 mm apart.
    margin = 2.0 * texel + 0.005
    assert (result.visibility[:, xs < edge - margin] == 0.0).all()
    assert (result.visibility[:, xs > edge + margin] > 0.9999).all()
    # The mean share along a row gives the edge itself, to half a texel.
    found = 1.2 - result.visibility.mean() * 1.2
    assert found == pytest.approx(edge, abs=0.5 * texel + 0.005)


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
@pytest.mark.parametrize("tilt", [0.0, 60.0, 89.0, 89.999])
def test_nothing_shadows_a_plane(kind: str, tilt: float) -> None:
    """No acne: a lone plane is wholly lit up to grazing incidence, far from the origin too."""
    angle = np.radians(tilt)
    direction = np.array([np.sin(angle), 0.0, np.cos(angle)])
    offset = np.array([1000.0, -2000.0, 500.0])
    geometry = geometry_of([square(4.0, 0.0)])
    geometry = replace(geometry, vertices=geometry.vertices + offset)
    light = light_at(kind, tuple(direction * 5.0), (0.0, 0.0, 0.0), spot_size=1.2)
    place = light.world_from_light.copy()
    place[:3, 3] += offset
    light = replace(light, world_from_light=place)
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-1.5, 1.5, (100, 100, 2)), np.zeros((100, 100, 1))], -1)
    surface = surfaces(points, np.array([0.0, 0.0, 1.0]), origin=tuple(offset))
    result = lit(geometry, light, surface)
    unlit = light_twin.incidence(surface, light, light_sample(light, 0, 1))[1] <= 0.0
    assert (result.visibility[~unlit] == 1.0).all()


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA"])
def test_a_wall_behind_does_not_shadow_a_floor(kind: str) -> None:
    """Over a floor at grazing incidence a texel's ray passes just above it and meets a wall far
    behind: that is before where the ray meets the floor, but does not hide the floor here."""
    wall = np.array([[-5.0, -4.0, 0.0], [-5.0, 4.0, 0.0], [-5.0, 4.0, 3.0], [-5.0, -4.0, 3.0]])
    geometry = geometry_of([square(5.0, 0.0), (wall, SQUARE)])
    light = light_at(kind, (4.0, 0.0, 0.01), (0.0, 0.0, 0.0), spot_size=1.2)
    xs, ys = np.linspace(-4.5, 1.0, 60), np.linspace(-0.5, 0.5, 9)
    surface = surfaces(floor_points(xs, ys), np.array([0.0, 0.0, 1.0]))
    result = lit(geometry, light, surface)
    reached = light_twin.incidence(surface, light, light_sample(light, 0, 1))[1] > 0.0
    assert (result.visibility[reached] == 1.0).all()


def test_contact_is_shadowed() -> None:
    """No gap between a box and the shadow at its foot, wider than the texels there."""
    geometry = geometry_of([square(4.0, 0.0), box((0.0, 0.0, 0.5), 1.0)])
    light = light_at("POINT", (3.0, 0.0, 2.0), (0.0, 0.0, 0.0))
    xs = -0.5 - np.linspace(0.0, 0.2, 101)[1:]
    surface = surfaces(floor_points(xs, np.linspace(-0.3, 0.3, 7)), np.array([0.0, 0.0, 1.0]))
    result = lit(geometry, light, surface)
    texel = 4.1 * 2.0 / SETTINGS.cube_resolution
    # At this slope (2 : 3.5) a texel across the ray is two on the floor.
    assert (result.visibility[:, xs < -0.5 - 2.0 * 2.0 * texel] == 0.0).all()


SOFT = {
    kind: light_at(kind, (0.0, 0.0, 0.02), (0.6, 0.0, 5.0), spot_size=1.3, shadow_soft_size=0.1)
    for kind in ("POINT", "SPOT")
}


@pytest.mark.parametrize("kind", SOFT)
def test_lamp_on_a_wall(kind: str) -> None:
    """A lamp h before a wall, seen at an angle t from the wall's normal: Cycles turns its disk
    of radius r towards the receiver, and the wall hides the disk's segment beyond the chord at
    h / sin t from its centre. For x = h / (r sin t) < 1 that leaves
    1 - (acos x - x sqrt(1 - x^2)) / pi of it."""
    light = SOFT[kind]
    geometry = geometry_of([square(4.0, 0.0)])
    assert touches_surface(light, geometry)
    angle = np.radians(np.arange(15.0, 42.0, 3.0))
    points = 5.0 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    surface = surfaces(points[None], -points[None] / 5.0)
    count = 64
    share = np.zeros(len(angle))
    for k in range(count):
        sample = light_sample(light, k, count, touching=True)
        share += lit(geometry, light, surface, sample=sample).visibility[0] / count
    x = np.minimum(0.02 / (0.1 * np.sin(angle)), 1.0)
    want = 1.0 - (np.arccos(x) - x * np.sqrt(1.0 - x * x)) / np.pi
    # The shares range from 0.94 to 0.70, and are all 1 without turned disks. A receiver gets a
    # mean over disks turned up to 14 degrees off with a spot's seven, 37 with a point's twelve.
    assert share == pytest.approx(want, abs=0.07 if kind == "SPOT" else 0.15)
    assert share.mean() == pytest.approx(want.mean(), abs=0.04)


@pytest.mark.parametrize("count", [2, 3, 5, 16])
def test_no_light_behind_the_wall_of_a_lamp(count: int) -> None:
    """No disk of radius 0.1 that is turned less than 44 degrees (37 of the nearest face, and
    what the faces are wider) reaches a wall 0.08 away: straight behind it no light arrives."""
    place = np.eye(4)
    place[2, 3] = 0.08
    light = Light("l", "POINT", place, 100.0, WHITE, shadow_soft_size=0.1)
    geometry = geometry_of([square(4.0, 0.0)])
    surface = surfaces(np.array([[[0.0, 0.0, -2.0]]]), np.array([0.0, 0.0, 1.0]))
    for k in range(count):
        sample = light_sample(light, k, count, touching=touches_surface(light, geometry))
        assert lit(geometry, light, surface, sample=sample).visibility == 0.0


def test_contact_with_surfaces() -> None:
    """A ball touches a triangle's face, edge or corner; not what casts no shadow."""
    light = Light("l", "POINT", np.eye(4), 1.0, WHITE, shadow_soft_size=0.1)
    for at, touches in (
        ((0.0, 0.0, 0.099), True),
        ((0.0, 0.0, 0.101), False),
        ((1.07, 1.07, 0.0), True),
        ((1.071, 1.071, 0.0), False),
    ):
        place = np.eye(4)
        place[:3, 3] = at
        geometry = geometry_of([square(1.0, 0.0)])
        assert touches_surface(replace(light, world_from_light=place), geometry) is touches
        unseen = replace(geometry, shadow_visible=np.zeros(len(geometry), dtype=bool))
        assert not touches_surface(replace(light, world_from_light=place), unseen)
    assert not touches_surface(replace(light, shadow_soft_size=0.0), geometry_of([square(1, 0)]))


@pytest.mark.parametrize(
    "name", ["point", "spot", "wide spot", "area", "sun", "point on a box", "spot on a box"]
)
def test_twin_and_traced_rays(name: str) -> None:
    """In a room with a box: the shader equals its twin on the stored map, and but for a texel
    or so along the edges both equal embree's shadow rays."""
    geometry = room_with_box()
    light = EDGE_LIGHTS[name.removesuffix(" on a box")]
    # So small a lamp has its disks' points where the traced rays end.
    touching = name.endswith("on a box")
    if touching:
        light = replace(light, shadow_soft_size=1e-4)
    light = replace(light, world_from_light=looking_at((0.9, -1.1, 1.5), (0.0, 0.0, -0.8)))
    if light.type == "SUN":
        # Leave the ceiling out, or no sun would come in.
        high = geometry.vertices[geometry.triangles][..., 2].min(axis=1) > 1.9
        keep = ~high
        fields = ("triangles", "object_id", "material_id", "weight")
        flags = ("camera_visible", "shadow_visible")
        geometry = replace(
            geometry, **{field: getattr(geometry, field)[keep] for field in (*fields, *flags)}
        )
    rng = np.random.default_rng(5)
    count = 120 * 120
    triangle = rng.choice(len(geometry), count, p=geometry.area / geometry.area.sum())
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    corner = geometry.vertices[geometry.triangles[triangle]]
    points = corner[:, 0] + u[:, None] * (corner[:, 1] - corner[:, 0])
    points += v[:, None] * (corner[:, 2] - corner[:, 0])
    sample = light_sample(light, 0, 2 if touching else 1, touching=touching)
    toward = sample.position - (0.0 if light.type == "SUN" else points)
    toward = np.broadcast_to(toward, points.shape)
    normal = geometry.normal[triangle]
    normal = np.where((normal * toward).sum(1, keepdims=True) < 0.0, -normal, normal)
    points = points.astype(np.float32).astype(np.float64)
    normal = normal.astype(np.float32).astype(np.float64)
    surface = surfaces(points.reshape(120, 120, 3), normal.reshape(120, 120, 3))
    result = lit(geometry, light, surface)

    reached = light_twin.incidence(surface, light, sample)[1].ravel() > 0.0
    atlas = read_texture(result.shadow.distance)[..., 0].astype(np.float64)
    want = twin.visibility(result.shadow.frustum, atlas, points, normal)
    got = result.visibility.ravel()
    # Same map, same rule: they part where a stored distance lies within rounding of the plane,
    # or a texel's border within rounding of the receiver.
    off = np.abs(got - want)[reached] > 1e-3
    assert off.mean() < 2e-3

    distance = np.linalg.norm(toward, axis=1, keepdims=True)
    start = points + normal * 1e-5
    hits, places = Tracer(geometry).hit(start, toward / distance)
    length = np.linalg.norm(places - start, axis=1)
    blocked = (hits >= 0) & ((light.type == "SUN") | (length < distance[:, 0] * (1.0 - 1e-5)))
    # Points in both states over the picture, and 2x2 texels of 256 or 512 round the edges of
    # a box and a room: some per cent of the points lie that close to an edge.
    assert 0.02 < blocked[reached].mean() < 0.98
    wrong = np.abs(got - ~blocked)[reached]
    assert (wrong > 0.5).mean() < 0.015
    assert wrong.mean() < 0.03


def test_light_without_shadow_goes_through() -> None:
    geometry = geometry_of([square(2.0, 0.0), square(0.4, 1.0)])
    surface = surfaces(floor_points(np.linspace(-1, 1, 9), np.zeros(1)), np.array([0.0, 0.0, 1.0]))
    light = EDGE_LIGHTS["point"]
    shadowed = lit(geometry, light, surface).visibility
    assert shadowed[0, 4] == 0.0
    through = drawn_light(surface, light, [light_sample(light, 0, 1)])
    assert (through[..., :3] > 0.0).all()


def test_invisible_casters_cast_nothing() -> None:
    geometry = geometry_of([square(2.0, 0.0), square(0.4, 1.0)])
    geometry = replace(geometry, shadow_visible=geometry.object_id == 0)
    surface = surfaces(floor_points(np.linspace(-1, 1, 9), np.zeros(1)), np.array([0.0, 0.0, 1.0]))
    assert (lit(geometry, EDGE_LIGHTS["point"], surface).visibility == 1.0).all()


def test_cascades_of_a_sun() -> None:
    """A floor 200 m long, seen from one end: shadows of posts near the eye are as sharp as the
    smallest window's texels, which one window for all could not have; nothing changes its mind
    from one cascade to the next."""
    cubes = [box((0.0, y, 1.0), 0.2) for y in (2.0, 12.0, 60.0)]
    posts = [(corners * [1.0, 1.0, 10.0] - [0.0, 0.0, 9.0], faces) for corners, faces in cubes]
    floor = np.array([[-100.0, 0, 0], [100, 0, 0], [100, 200, 0], [-100, 200, 0]])
    geometry = geometry_of([(floor, SQUARE), *posts])
    light = light_at("SUN", (-1.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    eye = np.array([0.0, 0.0, 1.7])
    rng = np.random.default_rng(3)
    away = 200.0 ** rng.random(120 * 160)
    points = np.stack([rng.uniform(-0.4, 0.4, away.size) * away, away, 0.0 * away], axis=-1)
    shadow = ShadowPass(GeometryBuffer(geometry, eye), SETTINGS).draw(
        light, light_sample(light, 0, 1), geometry.bounds, points, eye=eye
    )
    frustum = shadow.frustum
    assert len(frustum.half_extents) == 3
    # 12.5 m, 50 m and 200 m from the eye.
    assert frustum.half_extents[0] < 0.1 * frustum.half_extents[2]
    up = np.array([0.0, 0.0, 1.0])
    surface = surfaces(points.reshape(120, 160, 3) - eye, up, origin=tuple(eye))
    sample = light_sample(light, 0, 1)
    both = [drawn_light(surface, light, [sample], shadow=s)[..., 0] for s in (shadow, None)]
    got = (both[0] / both[1]).ravel()
    seen = surface.position[..., :3].reshape(-1, 3) + eye
    atlas = read_texture(shadow.distance)[..., 0].astype(np.float64)
    want = twin.visibility(frustum, atlas, seen, np.broadcast_to(up, seen.shape))
    assert (np.abs(got - want) > 1e-3).mean() < 2e-3
    # A post's shadow on the floor runs along +x from its foot, 0.2 m wide and 2 m long.
    for y, texel in zip((2.0, 12.0, 60.0), 2.0 * frustum.half_extents / 512, strict=True):
        x = np.linspace(0.3, 1.5, 25)
        across = np.linspace(-0.4, 0.4, 81)
        place = np.stack(np.broadcast_arrays(x[:, None], y + across, 0.0), axis=-1)
        share = twin.visibility(frustum, atlas, place, np.broadcast_to(up, place.shape))
        inside = np.abs(across) < 0.1 - 2.0 * texel
        outside = np.abs(across) > 0.1 + 2.0 * texel
        assert (share[:, inside] == 0.0).all()
        assert (share[:, outside] > 1.0 - 1e-12).all()


def test_beside_a_suns_window_is_as_at_its_border() -> None:
    """A ceiling keeps the sun from all of a floor, of which the map was fitted to the middle."""
    geometry = geometry_of([square(2.0, 0.0), square(4.0, 1.0)])
    light = EDGE_LIGHTS["sun"]
    points = floor_points(np.linspace(-1.5, 1.5, 31), np.linspace(-1.5, 1.5, 31))
    surface = surfaces(points, np.array([0.0, 0.0, 1.0]))
    sample = light_sample(light, 0, 1)
    middle = points[10:-10, 10:-10].reshape(-1, 3)
    shadow = ShadowPass(GeometryBuffer(geometry, surface.origin), SETTINGS).draw(
        light, sample, geometry.bounds, middle
    )
    assert not drawn_light(surface, light, [sample], shadow=shadow)[..., :3].any()


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA"])
def test_float32_cuts_nothing_off(kind: str) -> None:
    """Whatever is between `near` and `far` stays within the clip volume, with room to spare."""
    light = Light("l", kind, looking_at((-3.5, -6.0, 4.5), (0, 0, 0)), 1.0, WHITE)  # type: ignore[arg-type]
    bounds = np.array([[-3.0, -1.0, -2.0], [3.0, 1.0, 2.0]])
    frustum = shadow_frustum(light, light_sample(light, 0, 1), bounds, bounds, SETTINGS)
    clip_from_local = frustum.clip_from_local(0, np.zeros(3)).astype(np.float32)
    rays = np.random.default_rng(3).uniform(-0.3, 0.3, (1000, 3))
    rays[:, 2] = -1.0
    depth = frustum.far * np.geomspace(1e-5, 0.9, 1000)[:, None]
    points = frustum.origins[0] + depth * (rays @ frustum.face_from_world[0])
    clip = np.column_stack([points, np.ones(1000)]).astype(np.float32) @ clip_from_local.T
    assert (np.abs(clip[:, 2]) < 0.9 * clip[:, 3]).all()
