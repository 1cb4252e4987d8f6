# SPDX-License-Identifier: GPL-3.0-or-later
"""Views through points of a lens and at times of an exposure, beside rays cast in float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.corrmap.visibility_samples import through_lens, visibility_sample
from addon.scene.affine_motion import interpolate_affine
from addon.scene.exposure import Exposure
from addon.scene.lens import Lens
from addon.scene.view import View
from tests import synthetic
from tests.reference.visible_surface import away_from_outlines, cast_rays

WIDTH, HEIGHT = 48, 32
LENS = Lens(radius=0.2, focus_distance=2.0, blades=5, rotation=0.4, ratio=1.5)
RNG = np.random.default_rng(8)


def room_view(*, perspective: bool = True) -> View:
    pose = synthetic.looking_at((-1.5, -1.2, 1.1), (0.3, 0.2, -0.6))
    view = synthetic.perspective_view(pose, WIDTH, HEIGHT, 1.2)
    if not perspective:
        matrix = np.diag([0.4, 0.6, -0.02, 1.0])
        matrix[2, 3] = -1.0
        view = replace(view, clip_from_camera=matrix, perspective=False)
    return replace(view, lens=LENS)


def rotation(angle: float) -> np.ndarray:
    """(4, 4) about z."""
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return matrix


@pytest.mark.parametrize("perspective", [True, False])
def test_what_is_in_focus_stays(perspective: bool) -> None:
    """To float64's rounding; twice as far it moves by as much as the lens's point, the other way
    round (a parallel projection: as a pinhole's picture of the plane in focus says)."""
    view = room_view(perspective=perspective)
    xy = RNG.uniform(0.0, [WIDTH, HEIGHT], size=(50, 2))
    origin, direction = view.rays(xy)
    axis = -view.world_from_camera[:3, 2]
    start = (origin - view.origin) @ axis

    def at(depth: float) -> np.ndarray:
        return origin + ((depth - start) / (direction @ axis))[:, None] * direction

    moved = through_lens(view, 0.13, -0.07)
    np.testing.assert_allclose(moved.project(at(2.0))[:, :2], xy, atol=1e-9)
    pixels = np.array([WIDTH, HEIGHT]) * np.diag(view.clip_from_camera)[:2] / 2.0
    shift = np.array([0.13, -0.07]) * pixels * (1.0 / 2.0 - 1.0 / 4.0 if perspective else 1.0)
    np.testing.assert_allclose(moved.project(at(4.0))[:, :2], xy + shift, atol=1e-9)


def test_points_of_lenses() -> None:
    """Even over a pentagon's and a disk's area: its mean distance squared in closed form."""
    uniform = RNG.random((200_000, 2))
    disk = Lens(0.5, 1.0).points(uniform)
    # Uniform over a disk: r^2 is even in [0, R^2].
    assert abs((disk**2).sum(axis=1).mean() - 0.125) < 4 * 0.125 / np.sqrt(3 * 200_000)
    assert np.linalg.norm(disk, axis=1).max() <= 0.5
    pentagon = replace(LENS, ratio=1.0, rotation=0.0).points(uniform) / 0.2
    # The second moment of a regular polygon of circumradius 1: (2 + cos(2 pi / n)) / 6.
    expected = (2.0 + np.cos(2.0 * np.pi / 5.0)) / 6.0
    assert abs((pentagon**2).sum(axis=1).mean() - expected) < 4 * 0.3 / np.sqrt(200_000)
    assert np.abs(pentagon.mean(axis=0)).max() < 0.005
    # An edge's middle, and so the nearest border, at the angle 0.
    apothem = np.cos(np.pi / 5.0)
    assert apothem - 0.01 < pentagon[:, 0].max() <= apothem + 1e-12
    wide = LENS.points(uniform)
    np.testing.assert_allclose(wide * [1.5, 1.0], replace(LENS, ratio=1.0).points(uniform))


def test_between_steps() -> None:
    """Turns go evenly the short way, stretches and moves evenly, mirrors stay."""
    stretch = np.diag([1.0, 2.0, -0.5, 1.0])
    first, last = rotation(0.2) @ stretch, rotation(0.2 + 3.0) @ (2.0 * stretch)
    last[3, 3] = 1.0
    last[:3, 3] = 4.0, 5.0, 6.0
    half = interpolate_affine(np.stack([first, last])[:, None], 0.5)[0]
    expected = rotation(1.7) @ (1.5 * stretch)
    expected[3, 3] = 1.0
    expected[:3, 3] = 2.0, 2.5, 3.0
    np.testing.assert_allclose(half, expected, atol=1e-12)
    turn = interpolate_affine(np.stack([np.eye(4), rotation(np.pi)])[:, None], 0.5)[0]
    np.testing.assert_allclose(np.abs(turn), np.abs(rotation(np.pi / 2)), atol=1e-7)
    ends = np.stack([first, last])[:, None]
    for time, end in ((0.0, first), (1.0, last)):
        np.testing.assert_allclose(interpolate_affine(ends, time)[0], end, atol=1e-12)


def test_between_a_step_and_one_without_a_size() -> None:
    """What shrinks to nothing, along all axes or some, keeps its turn, mirrored or not, and its
    other sizes."""
    for seed, gone in enumerate([(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (0.0, 2.0, 0.0)] * 8):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        whole, less = np.eye(4), np.eye(4)
        whole[:3, :3], less[:3, :3] = turn @ np.diag([1.0, 2.0, 3.0]), turn @ np.diag(gone)
        for steps, share in (((whole, less), 0.25), ((less, whole), 0.75)):
            found = interpolate_affine(np.stack(steps)[:, None], share)[0]
            np.testing.assert_allclose(found, 0.75 * whole + 0.25 * less, atol=1e-7)
        ends = np.stack([whole, less])[:, None]
        np.testing.assert_allclose(interpolate_affine(ends, 1.0)[0], less, atol=1e-12)


def test_times_follow_the_shutters_curve() -> None:
    view = room_view()
    none = (np.zeros(0, dtype=np.int64), np.zeros((1, 0, 4, 4)), np.zeros((0, 4, 4)))
    opening = np.linspace(0.0, 1.0, 257) ** 2
    exposure = Exposure((view,), *none, opening)
    assert abs(exposure.time(0.25) - 0.5) < 1e-3
    assert exposure.view(0.3) is view
    assert exposure.moved_from_reference(0.5, 3) is None


def exposure_of(view: View, offset: np.ndarray) -> Exposure:
    """The camera goes aside and zooms, the box turns, moves and grows."""
    views = []
    for share in (-1.0, 0.0, 1.0):
        pose, matrix = view.world_from_camera.copy(), view.clip_from_camera.copy()
        pose[:3, 3] += [0.1 * share, 0.2 * share, 0.0]
        matrix[0, 0], matrix[1, 1] = np.diag(matrix)[:2] * (1.0 + 0.1 * share)
        views.append(replace(view, world_from_camera=pose, clip_from_camera=matrix))
    steps = np.stack([rotation(angle) * [1.0 + angle, 1, 1, 1] for angle in (-0.3, 0.0, 0.4)])
    steps[:, :3, 3] = np.array([[-0.4, 0, 0.1], [0, 0, 0], [0.5, 0.2, 0]]) + offset
    return Exposure(
        tuple(views), np.array([1]), steps[:, None], steps[1][None], np.linspace(0.0, 1.0, 33)
    )


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("perspective", [True, False])
@pytest.mark.parametrize("near", [1e-5, 0.01])
def test_samples_see_what_rays_meet(
    gpu_context: None, offset: float, perspective: bool, near: float
) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visibility_samples import draw_visibility_sample
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    place = np.array([offset, -offset, 0.0])
    geometry = synthetic.room_with_box(1.0, place)
    view = room_view(perspective=perspective)
    pose = view.world_from_camera.copy()
    pose[:3, 3] += place
    matrix = view.clip_from_camera.copy()
    if perspective:
        matrix[2, 2:] = -(100.0 + near) / (100.0 - near), -200.0 * near / (100.0 - near)
    view = replace(view, world_from_camera=pose, clip_from_camera=matrix)
    exposure = exposure_of(view, place)
    surfaces = VisibleSurfacePass(GeometryBuffer(geometry, view.origin))
    clips = (near if perspective else 0.0, 100.0)
    first = visibility_sample(view, 0, exposure, 2)
    assert first.view is view
    assert first.offset == (0.0, 0.0)
    assert first.moved is None
    for k in (1, 2, 5):
        sample = visibility_sample(view, k, exposure, 2)
        assert sample.moved is not None
        drawn = draw_visibility_sample(surfaces, view, sample, with_objects=True)
        moved = (
            np.einsum(
                "vij,vj->vi",
                sample.moved[np.repeat([0, 1], 8)][:, :3, :3],
                geometry.vertices,
            )
            + sample.moved[np.repeat([0, 1], 8), :3, 3]
        )
        there = replace(geometry, vertices=moved)
        seen = cast_rays(there, sample.view, clips, sample.offset)
        # A million metres away the matrices' own rounding moves outlines a little more.
        sure = away_from_outlines(there, sample.view, clips, sample.offset, 0.02)
        assert sure.mean() > 0.9
        number = drawn.scene_triangles().ravel()
        assert np.array_equal(number[sure], seen.triangle[sure])
        assert len(np.unique(number)) > 4
        sure &= number >= 0
        # The points that the rays meet, back where the geometry has them.
        back = np.linalg.inv(sample.moved)[geometry.object_id[number[sure]]]
        world = seen.point[sure] + sample.view.origin
        expected = np.einsum("vij,vj->vi", back[:, :3, :3], world) + back[:, :3, 3] - view.origin
        found = read_texture(drawn.position).reshape(-1, 4)[sure, :3]
        # As in the extremes, and one more transform; the world's coordinates in the expected
        # points have float64's spacing at their distance.
        bound = 40.0 * 2.0**-24 * 6.0 / seen.facing[sure] + 16.0 * np.spacing(offset + 1.0)
        assert (np.abs(found - expected).max(axis=1) < bound).all()
        normal = read_texture(drawn.normal).reshape(-1, 4)[sure, :3]
        cosine = np.abs(np.sum(normal * geometry.normal[number[sure]], axis=1))
        assert np.abs(cosine - 1.0).max() < 1e-6
        assert np.allclose(drawn.eye, first_eye(view))


def first_eye(view: View) -> np.ndarray:
    """The reference camera's place in local space, or the direction toward it."""
    if view.perspective:
        return np.array([0.0, 0.0, 0.0, 1.0])
    return np.append(view.world_from_camera[:3, 2], 0.0)


# From large to none within an eighth of the time that the shutter is open, at its middle.
VANISHING_STEPS = 9


def vanishing(view: View, gone: tuple[float, float, float], middle: np.ndarray) -> Exposure:
    """The box has no size, or none along some axis, from the middle of the exposure on."""
    there, turned = np.eye(4), rotation(0.3)
    there[:3, 3] = middle
    whole, none = there @ turned, there @ turned @ np.diag([*gone, 1.0])
    half = VANISHING_STEPS // 2
    steps = np.stack([whole] * half + [none] * (VANISHING_STEPS - half))
    return Exposure((view,), np.array([1]), steps[:, None], whole[None], np.linspace(0.0, 1.0, 33))


@pytest.mark.parametrize("gone", [(0, 0, 0), (1, 1, 0), (0, 1, 1), (1, 0, 0), (1e-30, 1, 1)])
@pytest.mark.parametrize("near", [1e-5, 0.01])
def test_what_has_no_size_is_not_seen(
    gpu_context: None, gone: tuple[float, float, float], near: float
) -> None:
    """Pixels see the box for the share of the exposure during which it has a size."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visibility_samples import draw_visibility_sample
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    geometry = synthetic.room_with_box()
    view = replace(room_view(), lens=None)
    matrix = view.clip_from_camera.copy()
    matrix[2, 2:] = -(100.0 + near) / (100.0 - near), -200.0 * near / (100.0 - near)
    view = replace(view, clip_from_camera=matrix)
    middle = geometry.vertices[8:].mean(axis=0)
    surfaces = VisibleSurfacePass(GeometryBuffer(geometry, view.origin))
    exposure = vanishing(view, gone, middle)
    count, seen, sizes = 96, np.zeros(WIDTH * HEIGHT), 0
    for k in range(1, count + 1):
        sample = visibility_sample(view, k, exposure, 2)
        drawn = draw_visibility_sample(surfaces, view, sample, with_objects=True)
        for texture in (drawn.position, drawn.normal):
            assert np.isfinite(read_texture(texture)).all()
        is_box = read_texture(drawn.objects).ravel() == 2.0
        assert sample.moved is not None
        has_size = np.linalg.svd(sample.moved[1, :3, :3], compute_uv=False).min() > 1e-6
        assert has_size or not is_box.any()
        # Behind it is the room.
        assert (drawn.scene_triangles() >= 0).all()
        seen += is_box
        sizes += int(has_size)
    assert abs(sizes / count - 0.5) < 0.02
    x, y = view.project(middle[None])[0, :2]
    assert abs(seen.reshape(HEIGHT, WIDTH)[int(y), int(x)] - sizes) <= 0.03 * count
