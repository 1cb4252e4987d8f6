# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheer layers come off nearest first, with what each lets through, as rays in float64 say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry, Sheer
from addon.scene.mask_value_reader import Extension
from tests import synthetic
from tests.reference.sheer import shares, transmission

SIZE = 48
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def stack(seed: int, scale: float = 1.0, extension: Extension = "REPEAT") -> SceneGeometry:
    """Five leaning sheets before a wall: sheet 2 opaque, the others sheer, two of them textured."""
    rng = np.random.default_rng(seed)
    parts: list[tuple[NDArray[np.float64], NDArray[np.int64]]] = []
    uv = []
    for _ in range(5):
        slope, middle = 0.3 * rng.standard_normal((2, 2)), rng.uniform(-0.4, 0.4, 2)
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        # The opaque one hides a part of what is behind it.
        corners *= 0.6 if len(parts) == 2 else 1.0 + 0.3 * len(parts)
        # Apart from each other, so that their order is the same all over.
        depth = 1.5 * len(parts) + 0.4 * np.tanh(corners @ slope[0])
        place = np.stack([corners[:, 0] + middle[0], depth, corners[:, 1] + middle[1]], axis=1)
        parts.append((place * scale, FACES))
        uv.append((1.3 * corners - 0.2)[FACES])
    wall = np.array([[-9.0, 9, -9], [9.0, 9, -9], [9.0, 9, 9], [-9.0, 9, 9]])
    parts.append((wall * scale, FACES))
    uv.append(np.zeros((2, 3, 2)))
    # As the sheets lie: nearest to the viewer, which looks along +Y, first.
    sheers = []
    for material in (0, 1, 3, 4):
        side = (6, 4) if material in (1, 3) else (1, 1)
        values = rng.random((*side, 3)).astype(np.float32)
        sheers.append(Sheer(material, values, extension, np.array([0.2, 0.5, 0.9], np.float32)))
    return replace(
        synthetic.geometry_of(parts),
        sheers=tuple(sheers),
        uv=np.concatenate(uv).astype(np.float32),
    )


def hits(
    geometry: SceneGeometry, origin: NDArray[np.float64], way: NDArray[np.float64]
) -> list[tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]]:
    """Of each part where (N,) rays meet it, at which distance, and its transmission there (N, 3):
    0 of what is opaque."""
    result = []
    sheers = {sheer.material_id: sheer for sheer in geometry.sheers}
    for part in range(len(geometry.material_names)):
        met, along = np.zeros(len(way), bool), np.full(len(way), np.inf)
        through = np.zeros((len(way), 3))
        for triangle in np.flatnonzero(geometry.material_id == part):
            a, b, c = geometry.vertices[geometry.triangles[triangle]]
            # t d - u (b - a) - v (c - a) = a - o.
            system = np.stack(
                [way, *np.broadcast_to([a - b, a - c], (len(way), 2, 3)).swapaxes(0, 1)], -1
            )
            t, u, v = np.linalg.solve(system, np.broadcast_to(a - origin, way.shape)[..., None])[
                ..., 0
            ].T
            inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
            met |= inside
            along[inside] = t[inside]
            if part in sheers and geometry.uv is not None:
                corner = geometry.uv[triangle].astype(np.float64)
                uv = (
                    (1.0 - u - v)[:, None] * corner[0]
                    + u[:, None] * corner[1]
                    + v[:, None] * corner[2]
                )
                through[inside] = transmission(sheers[part], uv)[inside]
        result.append((met, along, through))
    return result


@pytest.mark.parametrize(
    ("seed", "extension", "scale"),
    [
        (0, "REPEAT", 1.0),
        (1, "EXTEND", 1.0),
        (2, "CLIP", 1.0),
        (3, "MIRROR", 1.0),
        (4, "REPEAT", 1e-3),
        (5, "REPEAT", 1e5),
    ],
)
def test_layers_are_what_rays_meet(
    gpu_context: None, seed: int, extension: Extension, scale: float
) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    geometry = stack(seed, scale, extension)
    eye = np.array([0.1, -4.0, 0.2]) * scale
    view = synthetic.perspective_view(
        synthetic.looking_at(eye, (0.0, 3.0 * scale, 0.0)), SIZE, SIZE, 0.9,
        near=0.01 * scale, far=100.0 * scale,
    )  # fmt: skip
    drawn = VisibleSurfacePass(GeometryBuffer(geometry, view.origin)).draw(view)
    centres = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), -1).reshape(-1, 2)
    origin, way = view.rays(centres)
    parts = hits(geometry, np.asarray(origin).reshape(-1, 3)[0], way)
    # The sheets lie in the order of their numbers; what lies behind sheet 2 is not seen through it.
    hidden = parts[2][0]
    near = [*parts[:2], *((met & ~hidden, t, through) for met, t, through in parts[3:5])]
    count = np.sum([met for met, _, _ in near], axis=0)
    assert len(drawn.before) == count.max() >= 3
    expected = [np.zeros(SIZE * SIZE) for _ in range(5)]
    share = [np.ones((SIZE * SIZE, 3)) for _ in range(5)]
    for pixel in range(SIZE * SIZE):
        seen = [n for n, (met, _, _) in zip((0, 1, 3, 4), near, strict=True) if met[pixel]]
        through = shares([parts[n][2][pixel] for n in seen] or [np.ones(3)])
        for slot, part in enumerate(seen):
            expected[slot][pixel] = 1 + part
            share[slot][pixel] = through[slot]
        share[4][pixel] = through[-1]
    off = np.zeros(SIZE * SIZE, dtype=bool)
    for slot, layer in enumerate(drawn.before):
        off |= read_texture(layer.position)[..., 3].ravel() != expected[slot]
    # Only where a ray meets an outline within rounding may one be on the other side.
    assert off.mean() < 2e-3
    for slot, layer in enumerate(drawn.before):
        some = ~off & (expected[slot] > 0.0)
        if layer.through is None:
            assert slot == 0
            continue
        found = read_texture(layer.through)[..., :3].reshape(-1, 3)
        # Texture coordinates are interpolated in float32, by the rasterizer: 4e-4 of a texel.
        assert np.abs(found - share[slot])[some].max() < 2e-3
        place = read_texture(layer.position).reshape(-1, 4)[:, :3] + view.origin
        number = np.maximum(expected[slot].astype(int) - 1, 0)
        along = np.choose(number, [t for _, t, _ in parts])
        wanted = eye + np.where(some, along, 1.0)[:, None] * way
        assert np.abs(place - wanted)[some].max() < 2e-5 * scale
    assert drawn.through is not None
    found = read_texture(drawn.through)[..., :3].reshape(-1, 3)
    assert np.abs(found - share[4])[~off].max() < 2e-3


def test_nothing_is_peeled_where_all_is_opaque(gpu_context: None) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass

    geometry = synthetic.room_with_box()
    view = synthetic.perspective_view(synthetic.looking_at((0, 0, 0), (0, 1, 0)), 16, 16, 1.0)
    buffer = GeometryBuffer(geometry, view.origin)
    drawn = VisibleSurfacePass(buffer).draw(view)
    assert not buffer.has_sheer
    assert drawn.before == ()
    assert drawn.through is None


@pytest.mark.parametrize("extension", ["REPEAT", "CLIP"])
def test_rays_are_dimmed_by_all_layers(extension: Extension) -> None:
    """Shadow rays have the product of what is met, whatever the order, as the twin says."""
    from addon.corrmap.local_scene import LocalScene
    from addon.relight.shadows.shadow_rays import ShadowRays

    geometry = stack(4, extension=extension)
    rng = np.random.default_rng(0)
    origin = np.array([0.0, -2.0, 0.0])
    target = np.stack([rng.uniform(-1, 1, 400), np.full(400, 8.0), rng.uniform(-1, 1, 400)], -1)
    way = target - origin
    length = np.linalg.norm(way, axis=1)
    way /= length[:, None]
    rays = ShadowRays(LocalScene(geometry, np.zeros(3)))
    assert rays.dims
    start = np.broadcast_to(origin, way.shape)
    parts = hits(geometry, origin, way)
    assert np.array_equal(rays.blocked(start, way, length), parts[2][0])
    expected = np.ones((len(way), 3))
    for part in (0, 1, 3, 4):
        met, _, through = parts[part]
        expected[met] *= through[met]
    found = rays.through(start, way, length)
    # Embree's weights of corners are float32's.
    assert found == pytest.approx(expected, abs=2e-4)
    assert (expected < 0.5).mean() > 0.2
    # What ends before the first sheet meets none.
    assert (rays.through(start, way, np.full(len(way), 0.5)) == 1.0).all()


@pytest.mark.parametrize("near", [0.01, 1e-7])
def test_layers_move_with_their_objects(gpu_context: None, near: float) -> None:
    """Through a shutter, and where depth is taken from planes, they are peeled as at rest."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    geometry = stack(6)
    camera = synthetic.looking_at((0.1, -4.0, 0.2), (0.0, 3.0, 0.0))
    view = synthetic.perspective_view(camera, SIZE, SIZE, 0.9, near=near)
    surfaces = VisibleSurfacePass(GeometryBuffer(geometry, view.origin))
    rest = surfaces.draw(view)
    # All goes up as far as the camera does.
    moved = np.tile(np.eye(4), (len(geometry.object_names), 1, 1))
    moved[:, 2, 3] = 0.25
    higher = camera.copy()
    higher[2, 3] += 0.25
    other = surfaces.draw(replace(view, world_from_camera=higher), moved=moved, with_objects=True)
    assert len(rest.before) == len(other.before) >= 3
    for one, two in zip((rest, *rest.before), (other, *other.before), strict=True):
        ids = [read_texture(each.position)[..., 3] for each in (one, two)]
        same = ids[0] == ids[1]
        assert same.mean() > 0.998
        places = [read_texture(each.position)[..., :3] for each in (one, two)]
        # Where the geometry has them, to some float32 spacings.
        assert np.abs(places[0] - places[1])[same].max() < 1e-4
        if one.through is not None and two.through is not None:
            light = [read_texture(each.through)[..., :3] for each in (one, two)]
            assert np.abs(light[0] - light[1])[same].max() < 2e-3
        assert two.objects is not None
        assert np.array_equal(read_texture(two.objects)[..., 0], ids[1])
