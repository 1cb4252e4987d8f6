# SPDX-License-Identifier: GPL-3.0-or-later
"""The visible surface on the GPU beside rays cast in float64, at the ends of every scale.

Positions are local, with the origin at the camera. There float32 is off by its spacing, 2^-24
relative, in each of a few steps: the ray's direction (its corner and two products: 3), the
plane's normal and offset (2), their products with the ray (4 each), the quotient and the place
(3). Each error of a direction or normal becomes one of depth divided by the ray's cosine with the
plane; `BOUND` times the spacing is their sum.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from tests import synthetic
from tests.reference.visible_surface import away_from_outlines, cast_rays

SPACING = 2.0**-24
BOUND = 16.0
WIDTH, HEIGHT = 48, 32


def check(
    geometry: SceneGeometry,
    view: View,
    clips: tuple[float, float],
    *,
    origin: NDArray[np.float64] | None = None,
    offset: tuple[float, float] = (0.0, 0.0),
    pixels: float = 1.0 / 128.0,
    traced: bool = False,
) -> NDArray[np.int64]:
    """Compare the view's pixels farther than `pixels` from outlines; gives the triangles seen."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.local_scene import LocalScene
    from addon.corrmap.traced_triangles import TrianglesByRay
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    origin = view.origin if origin is None else origin
    buffer = GeometryBuffer(geometry, origin)
    surfaces = VisibleSurfacePass(buffer)
    if traced:
        scene = LocalScene(geometry, origin)
        by_ray = TrianglesByRay(buffer, scene, 0, software=True)
        assert surfaces.draw_traced(view, offset, by_ray) is None, "nobody asked for a tree"
        scene.mesh(geometry.camera_visible)
        found_by_ray = surfaces.draw_traced(view, offset, by_ray, with_objects=True)
        assert found_by_ray is not None
        drawn = found_by_ray
    else:
        drawn = surfaces.draw(view, offset, with_objects=True)
    triangle = drawn.scene_triangles().ravel()
    found = read_texture(drawn.position).reshape(-1, 4).astype(np.float64)
    normal = read_texture(drawn.normal).reshape(-1, 4).astype(np.float64)
    assert drawn.objects is not None
    objects = read_texture(drawn.objects).ravel()
    seen = cast_rays(geometry, view, clips, offset)

    sure = away_from_outlines(geometry, view, clips, offset, pixels)
    assert sure.mean() > 0.95
    assert np.array_equal(triangle[sure], seen.triangle[sure])
    hit = sure & (triangle >= 0)
    one = triangle[hit]
    assert np.array_equal(objects[hit], geometry.object_id[one] + 1.0)
    assert np.array_equal(found[hit, 3], geometry.material_id[one] + 1.0)
    assert not found[sure & (triangle < 0)].any()
    exact = geometry.normal[one]
    cosine = np.abs(np.sum(normal[hit, :3] * exact, axis=1))
    # A unit vector of float32 has three roundings, and turns to the viewer.
    assert np.abs(cosine - 1.0).max() < 4.0 * SPACING
    toward = seen.point[hit] if view.perspective else view.rays(np.zeros((1, 2)))[1]
    assert (np.sum(normal[hit, :3] * toward, axis=1) < 0.0).all()
    error = np.abs(found[hit, :3] - (seen.point[hit] + (view.origin - origin))).max(axis=1)
    away = np.linalg.norm(view.origin - origin)
    size = np.linalg.norm(seen.point[hit], axis=1) + away
    assert (error <= BOUND * SPACING * size / seen.facing[hit]).all()
    return triangle


def room_view(scale: float, offset: NDArray[np.float64], near: float, far: float) -> View:
    eye = np.array([-1.5, -1.2, 1.1]) * scale + offset
    look = np.array([0.3, 0.2, -0.6]) * scale + offset
    return synthetic.perspective_view(
        synthetic.looking_at(eye, look), WIDTH, HEIGHT, 1.2, near=near, far=far
    )


def parallel_view(scale: float, near: float, reach: float) -> View:
    width = 6.0 * scale
    clip_from_camera = np.diag([2.0 / width, 3.0 / width, 0.0, 1.0])
    far = reach * scale
    clip_from_camera[2, 2:] = np.array([-2.0, -(far + near * scale)]) / (far - near * scale)
    return View(
        synthetic.looking_at(np.array([-1.5, -1.2, 1.1]) * scale, (0, 0, -0.6 * scale)),
        clip_from_camera, WIDTH, HEIGHT, perspective=False,
    )  # fmt: skip


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("clips", [(1e-2, 1e2), (1e-4, 1e7)])
def test_sizes_places_and_clips(
    gpu_context: None, scale: float, offset: float, clips: tuple[float, float]
) -> None:
    place = np.array([offset, -offset, offset])
    geometry = synthetic.room_with_box(scale, place)
    near, far = clips[0] * scale, clips[1] * scale
    triangles = check(geometry, room_view(scale, place, near, far), (near, far))
    assert len(np.unique(triangles)) > 5


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_by_rays(gpu_context: None, scale: float, offset: float) -> None:
    """What is traced in the place of being rasterized: the same places, shifted pictures and
    samples beside the pixels' centres too, clips that cut the room, and from where local space does
    not have its origin."""
    place = np.array([offset, -offset, offset])
    geometry = synthetic.room_with_box(scale, place)
    near, far = 0.5 * scale, 3.4 * scale
    view = room_view(scale, place, near, far)
    picture = np.eye(4)
    picture[1, 1] = 1.7
    picture[:2, 3] = 0.6, -0.3
    view = replace(view, clip_from_camera=picture @ view.clip_from_camera)
    triangles = check(geometry, view, (near, far), offset=(0.37, -0.21), traced=True)
    assert (triangles < 0).any()
    assert len(np.unique(triangles)) > 4
    origin = view.origin + scale * np.array([3.0, 2.0, -1.0])
    check(geometry, view, (near, far), origin=origin, traced=True)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("near", [0.01, -1e2])
def test_parallel_by_rays(gpu_context: None, scale: float, near: float) -> None:
    check(
        synthetic.room_with_box(scale),
        parallel_view(scale, near, 1e2),
        (near * scale, 1e2 * scale),
        traced=True,
    )


@pytest.mark.parametrize("degrees", [1.0, 170.0])
def test_fields_of_view_by_rays(gpu_context: None, degrees: float) -> None:
    view = synthetic.perspective_view(
        synthetic.looking_at((-1.5, -1.2, 1.1), (0.3, 0.2, -0.6)),
        WIDTH, HEIGHT, float(np.radians(degrees)), near=1e-3, far=1e2,
    )  # fmt: skip
    check(synthetic.room_with_box(), view, (1e-3, 1e2), traced=True)


def test_what_rays_are_left_out_for(gpu_context: None) -> None:
    """A GPU, few triangles, and a far end that float32 would not resolve."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.local_scene import LocalScene
    from addon.corrmap.traced_triangles import TrianglesByRay
    from addon.corrmap.visible_surface import VisibleSurfacePass

    geometry = synthetic.room_with_box()
    buffer, scene = GeometryBuffer(geometry, np.zeros(3)), LocalScene(geometry, np.zeros(3))
    scene.mesh(geometry.camera_visible)
    assert not TrianglesByRay(buffer, scene, 0, software=False).pays
    assert not TrianglesByRay(buffer, scene, len(geometry) + 1, software=True).pays
    serves = TrianglesByRay(buffer, scene, len(geometry), software=True)
    assert serves.pays
    close = room_view(1.0, np.zeros(3), 1e-4, 1e2)
    assert VisibleSurfacePass(buffer).draw_traced(close, (0.0, 0.0), serves) is None


@pytest.mark.parametrize("degrees", [1.0, 20.0, 120.0, 170.0])
def test_fields_of_view(gpu_context: None, degrees: float) -> None:
    view = synthetic.perspective_view(
        synthetic.looking_at((-1.5, -1.2, 1.1), (0.3, 0.2, -0.6)),
        WIDTH, HEIGHT, float(np.radians(degrees)), near=1e-4, far=1e7,
    )  # fmt: skip
    check(synthetic.room_with_box(), view, (1e-4, 1e7))


def test_shift_and_pixels_that_are_not_square(gpu_context: None) -> None:
    view = room_view(1.0, np.zeros(3), 0.01, 100.0)
    picture = np.eye(4)
    picture[1, 1] = 1.7
    picture[:2, 3] = 0.6, -0.3
    check(
        synthetic.room_with_box(),
        replace(view, clip_from_camera=picture @ view.clip_from_camera),
        (0.01, 100.0),
        offset=(0.37, -0.21),
    )


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("reach", [1e2, 1e7])
def test_parallel_projections(gpu_context: None, scale: float, reach: float) -> None:
    """Also with the near plane behind the camera, as viewports have it."""
    for near in (0.01, -reach):
        view = parallel_view(scale, near, reach)
        check(synthetic.room_with_box(scale), view, (near * scale, reach * scale))


@pytest.mark.parametrize("distance", [1e-2, 1.0, 1e2, 1e4, 1e6])
@pytest.mark.parametrize("near", [1e-4, 1e-3])
def test_sheets_behind_one_another(gpu_context: None, distance: float, near: float) -> None:
    """Two sheets a millionth of their distance apart, drawn in either order."""
    sheet = np.array([[-1.0, 0, -1], [1.0, 0, -1], [1.0, 0, 1], [-1.0, 0, 1]]) * distance
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    front, behind = (sheet + np.array([0.0, distance * k, 0.0]) for k in (1.0, 1.0 + 1e-6))
    view = synthetic.perspective_view(
        synthetic.looking_at((0, 0, 0), (0, 1, 0)), WIDTH, HEIGHT, 1.0, near=near, far=1e7
    )
    for first in (True, False):
        parts = [front, behind] if first else [behind, front]
        geometry = synthetic.geometry_of([(part, faces) for part in parts])
        seen = check(geometry, view, (near, 1e7))
        assert set(seen // 2) == {0 if first else 1}


@pytest.mark.parametrize(("tilt", "near"), list(product([0.0, 0.3], [1e-4, 0.1])))
def test_a_ground_of_two_hundred_kilometres(gpu_context: None, tilt: float, near: float) -> None:
    """It reaches far behind the viewer, who stands on it; a box stands before them."""
    turn = np.eye(3)
    turn[1:, 1:] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    ground = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 1e5 @ turn.T
    stand = np.array([0.3, -4e4, 0.0]) @ turn.T
    boxes = [synthetic.box(stand + turn[:, 1] * away, away / 4.0) for away in (5.0, 5e3)]
    geometry = synthetic.geometry_of([(ground, np.array([[0, 1, 2], [0, 2, 3]])), *boxes])
    eye = stand + 1.6 * turn[:, 2]
    view = synthetic.perspective_view(
        synthetic.looking_at(eye, eye + turn[:, 1] * 5.0 - turn[:, 2] * 0.5),
        WIDTH, HEIGHT, 1.0, near=near, far=1e7,
    )  # fmt: skip
    objects = geometry.object_id[check(geometry, view, (near, 1e7))]
    assert {0, 1, 2} <= set(objects)


@pytest.mark.parametrize("far", [3.0, 1e9])
@pytest.mark.parametrize("perspective", [True, False])
def test_nothing_beyond_the_clips(gpu_context: None, far: float, perspective: bool) -> None:
    view = room_view(1.0, np.zeros(3), 1.4, far)
    if not perspective:
        matrix = np.diag([0.4, 0.6, -2.0 / (far - 1.4), 1.0])
        matrix[2, 3] = -(far + 1.4) / (far - 1.4)
        view = replace(view, clip_from_camera=matrix, perspective=False)
    seen = check(synthetic.room_with_box(), view, (1.4, far))
    if far < 10.0:
        assert (seen < 0).mean() > 0.1


def test_away_from_the_local_origin(gpu_context: None) -> None:
    """Ten kilometres from where local space begins, to float32's spacing there."""
    place = np.array([1e4, 0.0, 0.0])
    check(
        synthetic.room_with_box(1.0, place),
        room_view(1.0, place, 0.01, 100.0),
        (0.01, 100.0),
        origin=np.zeros(3),
        # Corners are known to 2^-24 x 10 km, which a metre away is so many pixels.
        pixels=0.05,
    )


def test_a_region_is_a_part_of_the_picture(gpu_context: None) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass

    view = room_view(1.0, np.zeros(3), 0.01, 100.0)
    surfaces = VisibleSurfacePass(GeometryBuffer(synthetic.room_with_box(), view.origin))
    region = view.region(7, 5, 30, 29)
    whole = surfaces.draw(view).scene_triangles()[5:29, 7:30]
    part = surfaces.draw(region).scene_triangles()
    sure = away_from_outlines(synthetic.room_with_box(), region, (0.01, 100.0)).reshape(part.shape)
    assert np.array_equal(part[sure], whole[sure])
    points = np.random.default_rng(1).normal(size=(20, 3))
    # Both matrices are float64's, and a pixel has 1e-13 of the picture for its rounding.
    moved = region.project(points) + np.array([7.0, 5.0, 0.0, 0.0])
    np.testing.assert_allclose(moved, view.project(points), rtol=1e-11, atol=1e-10)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("degrees", [1.0, 60.0, 170.0])
def test_rays_and_projection_invert_each_other(scale: float, offset: float, degrees: float) -> None:
    """To the spacing of the world's coordinates in float64, seen through the lens."""
    eye = np.array([offset, -offset, 0.5 * offset])
    pose = synthetic.looking_at(eye, eye + np.array([1.0, 2.0, -0.5]))
    fov = float(np.radians(degrees))
    view = synthetic.perspective_view(pose, 640, 480, fov, near=1e-4, far=1e7)
    rng = np.random.default_rng(4)
    xy = rng.uniform(0.0, [640.0, 480.0], size=(200, 2))
    origin, direction = view.rays(xy)
    distance = scale * rng.uniform(0.5, 2.0, size=(200, 1))
    back = view.project(origin + distance * direction)[:, :2]
    cosine = direction @ -view.world_from_camera[:3, 2]
    place = np.spacing(np.abs(eye).max() + scale) / distance[:, 0] + 2.0**-52
    pixels = 320.0 / np.tan(np.radians(degrees) / 2.0)
    assert (np.abs(back - xy).max(axis=1) <= 8.0 * place * pixels / cosine**2 + 1e-10).all()
