# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera attributes in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from addon.camplace import aim
from addon.camplace.coverage import Seen
from addon.camplace.samples import Samples


def _disc(centre: tuple[float, float, float], radius: float, count: int) -> Samples:
    """Samples on the rim of a disc that looks down -X, and one in its middle."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    rim = np.stack([np.zeros(count), radius * np.cos(turn), radius * np.sin(turn)], axis=-1)
    point = np.concatenate([rim, np.zeros((1, 3))]) + centre
    total = count + 1
    return Samples(
        point=point,
        normal=np.tile([-1.0, 0.0, 0.0], (total, 1)),
        weight=np.full(total, 1.0 / total),
        pixels=np.tile([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (total, 1, 1)),
        triangle=np.zeros(total, dtype=np.int64),
        from_view=np.ones(total, dtype=np.bool_),
    )


def test_a_disc_is_aimed_at_and_just_held() -> None:
    samples = _disc((4.0, 1.0, 2.0), 1.0, 64)
    place = np.array([0.0, 1.0, 2.0])
    camera, seen, gained = aim.aimed_camera(
        place, samples, np.arange(65), np.zeros(65), resolution=1024
    )
    np.testing.assert_allclose(-camera.world_from_camera[:3, 2], [1.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(camera.world_from_camera[:3, 3], place)
    assert camera.fov == pytest.approx(2.0 * aim.MARGIN * np.arctan(1.0 / 4.0))
    assert len(seen.index) == 65
    # A texel is far smaller than a pixel here (one unit), so everything is gained.
    assert gained == pytest.approx(1.0)


def test_field_of_view_is_twice_the_largest_angle_within_limits() -> None:
    assert aim.field_of_view(np.array([0.1, 0.4, 0.2])) == pytest.approx(0.8 * aim.MARGIN)
    assert aim.field_of_view(np.array([1.5])) == pytest.approx(np.radians(120.0))
    assert aim.field_of_view(np.array([0.0])) == aim.NARROWEST


def test_samples_outside_120_degrees_are_left_uncovered() -> None:
    wide = _disc((1.0, 0.0, 0.0), 5.0, 16)  # the rim is 79 degrees off the axis
    camera, seen, _ = aim.aimed_camera(
        np.zeros(3), wide, np.arange(17), np.zeros(17), resolution=256
    )
    assert camera.fov <= np.radians(120.0) + 1e-12
    assert 0 < len(seen.index) < 17


def test_clips() -> None:
    depth = np.array([2.0, 9.0, 4.0])
    assert aim.clip_distances(depth, 1.0, 100.0) == (aim.NEAR_SHARE, 100.0)
    assert aim.clip_distances(depth, 50.0, 3.0) == (2.0, 9.0)
    assert aim.clip_distances(np.zeros(0), 1.0, 100.0) == (aim.NEAR_SHARE, 100.0)


@pytest.mark.parametrize(
    ("texel", "highest", "expected"),
    [(0.12, 2048, 256), (0.2, 2048, 512), (0.4, 2048, 1024), (0.9, 2048, 2048), (7.0, 2048, 2048),
     (0.4, 512, 512)],
)  # fmt: skip
def test_resolution_makes_texels_no_larger_than_pixels(
    texel: float, highest: int, expected: int
) -> None:
    seen = Seen(np.arange(10), np.array([texel] * 9 + [50.0]), np.ones(10, dtype=np.bool_))
    weight = np.full(10, 0.1)
    # Measured at 2048; one sample in ten that cannot be served does not decide.
    assert aim.needed_resolution(seen, weight, 2048, highest) == expected


def test_nothing_covered_needs_the_lowest_resolution() -> None:
    seen = Seen(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.bool_))
    assert aim.needed_resolution(seen, np.ones(3), 2048, 2048) == 256


def test_cube_faces_hold_every_direction_and_are_rigid() -> None:
    place = np.array([3.0, -1.0, 2.0])
    faces = aim.cube_cameras(place, 256)
    direction = np.random.default_rng(0).normal(size=(500, 3))
    held = np.zeros(500, dtype=int)
    for face in faces:
        rotation = face.world_from_camera[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(rotation) == pytest.approx(1.0)
        u, v, depth = face.project(place + direction).T
        held += (depth > 0) & (np.abs(u - 0.5) <= 0.5) & (np.abs(v - 0.5) <= 0.5)
    # Random directions do not fall on the edges that two faces share.
    assert (held == 1).all()


def test_weighted_quantile() -> None:
    values, weight = np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.0])
    assert aim.weighted_quantile(values, weight, 0.5) == 1.0
    assert aim.weighted_quantile(values, weight, 0.6) == 2.0
    assert aim.weighted_quantile(values, weight, 1.0) == 3.0
