# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are on the GPU once, beside the same scene flattened."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.corrmap.triangle_codes import TriangleCodes
from addon.scene.geometry import Cutout, SceneGeometry
from addon.scene.view import View
from tests import copied_meshes, synthetic
from tests.corrmap.test_visible_extremes import BOUND, SPACING, check
from tests.reference.visible_surface import away_from_outlines, cast_rays

WIDTH, HEIGHT = 60, 40
CLIPS = (0.01, 100.0)


def forest(scale: float = 1.0, offset: float = 0.0, *, uneven: bool = True) -> SceneGeometry:
    """A room with a box, and trees within."""
    there = np.diag([scale, scale, scale, 1.0])
    there[:3, 3] = np.array([1.0, -1.0, 1.0]) * offset
    places = [there @ place for place in copied_meshes.places(7, 1.4, uneven=uneven)]
    rest = synthetic.room_with_box(scale, there[:3, 3])
    return copied_meshes.with_copies(copied_meshes.tree(), places, rest)


def view_of(scale: float = 1.0, offset: float = 0.0, near: float = 0.01) -> View:
    place = np.array([1.0, -1.0, 1.0]) * offset
    pose = synthetic.looking_at(
        np.array([-1.6, -1.5, 1.1]) * scale + place, np.array([0.3, 0.2, -0.3]) * scale + place
    )
    return synthetic.perspective_view(
        pose, WIDTH, HEIGHT, 1.2, near=near * scale, far=100.0 * scale
    )


def flattened(geometry: SceneGeometry) -> SceneGeometry:
    return replace(geometry, copies=())


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("near", [1e-2, 1e-4])
def test_places_are_those_of_rays(
    gpu_context: None, scale: float, offset: float, near: float
) -> None:
    """The bound of triangles that are there once, uneven and mirrored sizes too; near clips of 0.1
    mm take the depth of planes."""
    geometry, view = forest(scale, offset), view_of(scale, offset, near)
    seen = check(geometry, view, (near * scale, 100.0 * scale))
    assert (seen >= 24).mean() > 0.1
    assert len(np.unique(geometry.object_id[seen[seen >= 0]])) > 4


def drawn(geometry: SceneGeometry, view: View, **more: Any) -> Any:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass

    buffer = GeometryBuffer(geometry, view.origin)
    return buffer, VisibleSurfacePass(buffer).draw(view, with_objects=True, **more)


def test_far_from_the_meshs_own_origin(gpu_context: None) -> None:
    """A mesh modelled 20 km from where its space begins, looked at from a metre: its corners
    are multiples of 2 mm, and from there on nothing is lost."""
    mesh = copied_meshes.tree()
    away = np.array([2e4, -1e4, 3e4])
    mesh = replace(mesh, vertices=(mesh.vertices + away).astype(np.float32).astype(np.float64))
    back = np.eye(4)
    back[:3, 3] = -away
    places = [place @ back for place in copied_meshes.places(12, 1.4)]
    geometry = copied_meshes.with_copies(mesh, places, synthetic.room_with_box())
    seen = check(geometry, view_of(), CLIPS)
    assert (seen >= 24).mean() > 0.1


def test_by_rays(gpu_context: None) -> None:
    """What is traced is told apart as what is rasterized."""
    seen = check(forest(), view_of(), CLIPS, traced=True)
    assert (seen >= 24).mean() > 0.1


def test_pictures_are_those_of_the_flattened_scene(gpu_context: None) -> None:
    """Normals for shading, and how they turn: codes of normals are rounded in mesh space in one and
    in world space in the other, each to 2^-15."""
    from addon.corrmap.normal_bend import NormalBendPass
    from addon.corrmap.shading_normals import ShadingNormalPass
    from addon.corrmap.shading_samples import objects_of
    from addon.glsl.shader import read_texture

    geometry, view = forest(), view_of()
    found = []
    for scene in (geometry, flattened(geometry)):
        buffer, visible = drawn(scene, view)
        assert (buffer.copies is None) == (not scene.copies)
        objects = objects_of(buffer, visible.triangles)
        assert np.array_equal(read_texture(objects), read_texture(visible.objects))
        bend = NormalBendPass(buffer).of(visible).texture(4)
        textures = (ShadingNormalPass(buffer).draw(visible), bend, visible.normal)
        found.append((visible.scene_triangles(), *(read_texture(each) for each in textures)))
    (triangle, normal, bend, flat), (expected, *others) = found
    sure = away_from_outlines(geometry, view, CLIPS, (0.0, 0.0), 1.0 / 128.0)
    sure = sure.reshape(triangle.shape)
    assert sure.mean() > 0.9
    assert np.array_equal(triangle[sure], expected[sure])
    copied = sure & (triangle >= 24)
    assert copied.mean() > 0.1
    assert np.abs(normal - others[0])[copied][:, :3].max() < 4.0 * 2.0**-15
    assert np.abs(flat - others[2])[copied][:, :3].max() < 16.0 * SPACING
    size = np.linalg.norm(others[1][copied], axis=1)
    # The direction of greatest turn has no sign, and hardly any length that would be lost.
    assert np.abs(np.linalg.norm(bend[copied], axis=1) - size).max() < 1e-3 * size.max()


def test_what_is_there_once_keeps_its_bits(gpu_context: None) -> None:
    """Pixels that see the room are the same whether or not trees stand in it as copies."""
    from addon.glsl.shader import read_texture

    places = copied_meshes.places(2, 1.0)
    geometry = copied_meshes.with_copies(copied_meshes.tree(), places, synthetic.room_with_box())
    view = view_of()
    _, one = drawn(geometry, view)
    _, other = drawn(flattened(geometry), view)
    of_room = (one.scene_triangles() < 24) & (other.scene_triangles() < 24)
    assert 0.2 < of_room.mean() < 0.95
    for name in ("position", "normal", "objects"):
        a, b = (read_texture(getattr(each, name)) for each in (one, other))
        assert np.array_equal(a[of_room], b[of_room])


def test_cutouts(gpu_context: None) -> None:
    mesh = copied_meshes.tree()
    uv = np.random.default_rng(2).uniform(-1.0, 2.0, (len(mesh), 3, 2)).astype(np.float32)
    alpha = np.random.default_rng(4).uniform(size=(8, 8)).astype(np.float32)
    mesh = replace(mesh, uv=uv, cutouts=(Cutout(1, alpha, "REPEAT"),))
    places = copied_meshes.places(12, 1.4)
    geometry = copied_meshes.with_copies(mesh, places, synthetic.room_with_box())
    assert geometry.uv is not None
    view = view_of()
    (_, one), (_, other) = drawn(geometry, view), drawn(flattened(geometry), view)
    (_, solid) = drawn(replace(geometry, cutouts=()), view)
    a, b, c = (each.scene_triangles() for each in (one, other, solid))
    assert (b != c).mean() > 0.02, "nothing is cut away"
    # Texture coordinates are interpolated from corners that differ by rounding.
    assert (a != b).mean() < 2e-3


def test_moving_objects(gpu_context: None) -> None:
    """Poses are in world space, whoever is moved."""
    from addon.glsl.shader import read_texture

    geometry, view = forest(), view_of()
    moved = np.stack(copied_meshes.places(len(geometry.object_names), 0.2, 9))
    moved[0] = np.eye(4)
    _, one = drawn(geometry, view, moved=moved)
    _, other = drawn(flattened(geometry), view, moved=moved)
    a, b = one.scene_triangles(), other.scene_triangles()
    assert ((a >= 24) & (a == b)).mean() > 0.1
    assert (a != b).mean() < 5e-3
    place, there = (read_texture(each.position) for each in (one, other))
    facing = np.abs(np.sum(read_texture(other.normal)[..., :3], axis=-1))
    same = (a == b) & (facing > 0.1)
    error = np.abs(place - there)[same].max(axis=1)
    # Two transforms more, and grazing planes: what is left is rounding, and no wrong matrix.
    assert np.median(error) < 1e-6
    assert np.quantile(error, 0.99) < 1e-4


def test_instances_beside_the_picture_are_left_out(
    gpu_context: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.corrmap.copies_buffer import CopiesBuffer
    from addon.corrmap.visible_surface import clip_from_local
    from addon.glsl.shader import read_texture

    places = copied_meshes.places(300, 20.0)
    geometry = copied_meshes.with_copies(copied_meshes.tree(), places)
    view = view_of()
    buffer, one = drawn(geometry, view)
    matrix = clip_from_local(view, view.origin)
    calls, numbers = buffer.copies.calls(matrix, "camera", None)
    assert [call.count for call in calls] == [len(numbers)]
    assert 5 < len(numbers) < 150
    some = np.zeros(len(geometry.object_names), dtype=bool)
    some[numbers[3]] = True
    assert list(buffer.copies.calls(matrix, "camera", some)[1]) == [numbers[3]]
    monkeypatch.setattr(
        CopiesBuffer, "_seen", lambda self, mesh, _: np.ones((len(mesh.copies), 1), dtype=bool)
    )
    _, whole = drawn(geometry, view)
    assert np.array_equal(read_texture(one.position), read_texture(whole.position))
    assert read_texture(one.position).any()


def test_meshes_stay_when_the_view_goes_far(gpu_context: None) -> None:
    """The tables of meshes and their vertices are taken over; what comes out is as if made anew."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    geometry, view = forest(), view_of()
    first = GeometryBuffer(geometry, view.origin + np.array([3e4, 1e4, 0.0]))
    assert first.copies is not None
    second = GeometryBuffer(geometry, view.origin, first.copies.meshes)
    assert second.copies is not None
    assert second.copies.meshes is first.copies.meshes
    _, fresh = drawn(geometry, view)
    kept = VisibleSurfacePass(second).draw(view)
    assert np.array_equal(read_texture(kept.position), read_texture(fresh.position))


@pytest.mark.parametrize("mirrored", [False, True])
def test_shadow_maps(gpu_context: None, mirrored: bool) -> None:
    """Distances of the flattened scene's, to rounding, but for outlines."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.glsl.shader import read_texture
    from addon.relight.shadows.shadow_frustum import ShadowSettings
    from addon.relight.shadows.shadow_pass import ShadowPass

    rest = synthetic.geometry_of([synthetic.box((0.0, 0.0, -2.0), 1.0)])
    places = copied_meshes.places(12, 1.4, uneven=not mirrored)
    geometry = copied_meshes.with_copies(copied_meshes.tree(), places, rest)
    found = []
    toward = np.array([[0.3, 0.2, 1.0]]) / np.linalg.norm([0.3, 0.2, 1.0])
    for scene in (geometry, flattened(geometry)):
        shadow = ShadowPass(GeometryBuffer(scene, np.zeros(3)), ShadowSettings())
        corners = scene.bounds
        seen = shadow.draw_parallel(toward, scene.bounds, corners, 64)
        found.append(read_texture(seen.distance)[..., 0])
    near = np.abs(found[0] - found[1]) < 1e-5
    assert near.mean() > 0.998
    assert ((found[0] < 1e30).mean()) > 0.1


def test_codes_come_back() -> None:
    """Every triangle's code is its own, and leads back to it."""
    rng = np.random.default_rng(1)
    scene = rng.permutation(20_000)
    # Two meshes of 300 and 5000 triangles, at 7 and 2 places in the scene.
    first = np.array([50, 900, 1300, 12000, 12300, 15000, 19000, 2000, 7000])
    taken = np.zeros(20_000, dtype=bool)
    for place, size in zip(first, [300] * 7 + [5000] * 2, strict=True):
        taken[place : place + size] = True
    mesh_triangle = np.concatenate([rng.permutation(300), rng.permutation(5000)])
    codes = TriangleCodes(
        scene[~taken[scene]], first, mesh_triangle, ((0, 7, 0, 300), (7, 2, 300, 5000))
    )
    every = np.append(np.arange(20_000), -1)
    encoded = codes.encode(every)
    assert encoded.dtype == np.float32
    assert len(np.unique(encoded, axis=0)) == len(every)
    assert np.array_equal(codes.decode(encoded), every)
    assert not encoded[-1].any()


def test_what_cannot_be_numbered_is_flattened(
    gpu_context: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More instances, or triangles of meshes, than there are numbers: the picture stays."""
    from addon.corrmap import mesh_store
    from addon.glsl.shader import read_texture

    geometry, view = forest(), view_of()
    _, expected = drawn(flattened(geometry), view)
    for name, most in (("_MOST_INSTANCES", 7), ("_MOST_TRIANGLES", 40)):
        with monkeypatch.context() as patch:
            patch.setattr(mesh_store, name, most)
            assert drawn(geometry, view)[0].copies is not None
            patch.setattr(mesh_store, name, most - 1)
            buffer, found = drawn(geometry, view)
        assert buffer.copies is None
        for each in ("position", "normal", "triangles", "objects"):
            one, other = (read_texture(getattr(some, each)) for some in (found, expected))
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_large_triangles(gpu_context: None, scale: float) -> None:
    """A ground of triangles two hundred times as large as what is seen of them: the bound is of the
    corner that tells where their plane is."""
    from addon.glsl.shader import read_texture

    corners = np.array([[-200.0, -150, 0], [210, -160, 0], [190, 180, 0], [-205, 170, 0]])
    corners = corners.astype(np.float32).astype(np.float64)
    ground = synthetic.geometry_of([(corners, np.array([[0, 1, 2], [0, 2, 3]]))])
    places = [np.diag([scale, scale, scale, 1.0]) @ p for p in copied_meshes.places(1, 1.0, 2)]
    geometry = copied_meshes.with_copies(ground, places)
    middle = places[0][:3, 3]
    eye = middle + 0.5 * scale * geometry.normal[0] + 0.1 * scale
    view = synthetic.perspective_view(
        synthetic.looking_at(eye, middle), WIDTH, HEIGHT, 1.0, near=1e-3 * scale, far=1e3 * scale
    )
    _, visible = drawn(geometry, view)
    seen = cast_rays(geometry, view, (1e-3 * scale, 1e3 * scale))
    hit = (visible.scene_triangles().ravel() >= 0) & (seen.triangle >= 0)
    assert hit.mean() > 0.9
    found = read_texture(visible.position).reshape(-1, 4)[hit, :3].astype(np.float64)
    error = np.abs(found - seen.point[hit]).max(axis=1)
    away = np.linalg.norm(geometry.vertices - eye, axis=1).max()
    assert (error <= BOUND * SPACING * away / seen.facing[hit]).all()
    # Otherwise this would test nothing more than the others.
    assert np.linalg.norm(seen.point[hit], axis=1).max() < 0.02 * away
