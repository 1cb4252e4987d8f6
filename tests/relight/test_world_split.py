# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's picture in parts, and the directions that are drawn from it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.world.equirect import bilinear, directions, place_of, solid_angles
from addon.relight.world.world_directions import DirectionSource, SunSource, sobol_points
from addon.relight.world.world_light import LEVELS, node_directions, prepare_world
from addon.relight.world.world_split import MOST_SUNS, split_world

Array = NDArray[np.float64]
RNG = np.random.default_rng(0)


def sky(height: int = 128) -> Array:
    """A smooth sky over dark ground."""
    x, y, z = np.moveaxis(directions(height, 2 * height), -1, 0)
    return np.where(z > 0.0, 0.5 + 0.4 * z, 0.1)[..., None] * np.array([0.4, 0.7, 1.0]) + 0.05 * (
        1.0 + x * y
    )[..., None] * np.ones(3)


def with_sun(picture: Array, toward: Array, radius: float, radiance: float) -> Array:
    toward = toward / np.linalg.norm(toward)
    inside = directions(*picture.shape[:2]) @ toward > np.cos(np.radians(radius))
    return picture + inside[..., None] * radiance


SUN = np.array([0.5, -0.6, 0.7])


@pytest.mark.parametrize("peak", [1e2, 1e5, 1e9])
def test_parts_add_up(peak: float) -> None:
    picture = with_sun(sky(), SUN, 1.5, peak).astype(np.float32)
    parts = split_world(picture)
    assert len(parts.suns) == 1
    total = parts.residual + np.sum(parts.suns, axis=0)
    # A difference and a sum of float64 numbers as large as the peak.
    np.testing.assert_allclose(total, picture, atol=4e-16 * peak, rtol=0.0)
    assert (parts.suns[0] >= 0.0).all()
    assert parts.residual.max() < 2.0
    energy = (parts.suns[0][..., 1:2] * solid_angles(128, 256)[..., None]).sum()
    expected = peak * 2.0 * np.pi * (1.0 - np.cos(np.radians(1.5)))
    # A disk of some fourteen texels, each in it or not.
    assert energy == pytest.approx(expected, rel=0.25)


def test_a_sun_across_the_seam_is_one() -> None:
    # Longitude pi is where the picture's left and right edges meet.
    picture = with_sun(sky(), np.array([-1.0, 0.0, 0.3]), 2.0, 1e4)
    assert len(split_world(picture.astype(np.float32)).suns) == 1


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_a_night_is_parted_as_a_day(scale: float) -> None:
    """Nothing in it has a brightness of its own."""
    picture = with_sun(sky(), SUN, 1.5, 1e2).astype(np.float32)
    day, night = split_world(picture), split_world(picture * np.float32(scale))
    assert len(night.suns) == len(day.suns) == 1
    np.testing.assert_allclose(night.suns[0], day.suns[0] * scale, rtol=1e-12)


def test_what_is_no_sun() -> None:
    window = with_sun(sky(), SUN, 15.0, 50.0)
    assert not split_world(window.astype(np.float32)).suns
    star = with_sun(sky(), SUN, 0.8, 1.0)
    assert not split_world(star.astype(np.float32)).suns
    for shape in ((1, 1, 3), (1, 2, 3), (2, 4, 3)):
        assert not split_world(RNG.random(shape).astype(np.float32)).suns
    assert not split_world(np.zeros((16, 32, 3), np.float32)).suns


def test_at_most_so_many_suns() -> None:
    picture = sky()
    for i in range(MOST_SUNS + 2):
        angle = 1.2 * i
        toward = np.array([np.cos(angle), np.sin(angle), 0.5])
        picture = with_sun(picture, toward, 1.5, 1e4 * (1.0 + i))
    parts = split_world(picture.astype(np.float32))
    assert len(parts.suns) == MOST_SUNS


def test_points_are_spread() -> None:
    """Of the first 2^n every box of area 2^-n has one (a (0, 2)-sequence in base 2)."""
    points = sobol_points(0, 256, seed=5)
    for k in range(9):
        boxes = np.floor(points * [2**k, 2 ** (8 - k)]).astype(np.int64)
        counts = np.bincount(boxes[:, 0] * 2 ** (8 - k) + boxes[:, 1], minlength=256)
        assert (counts == 1).all()
    np.testing.assert_array_equal(sobol_points(100, 3), sobol_points(0, 103)[100:])


@pytest.mark.parametrize("height", [1, 3, 16])
def test_directions_are_unbiased(height: int) -> None:
    """Means over directions are integrals over the sphere, of the picture times anything."""
    picture = RNG.random((height, 2 * height, 3)) ** 4
    drawn = DirectionSource(picture).draw(sobol_points(0, 1 << 14), 1 << 14)
    fine = directions(512, 1024)
    weight = solid_angles(512, 1024)[..., None]
    x, y = place_of(fine, 2 * height, height)
    seen = bilinear(picture, x, y)
    for normal in (np.array([0.0, 0.0, 1.0]), np.array([0.6, -0.8, 0.0])):
        want = (seen * np.maximum(fine @ normal, 0.0)[..., None] * weight).sum(axis=(0, 1))
        cosine = np.maximum(drawn.toward @ normal, 0.0)
        got = (drawn.radiance / drawn.density[:, None] * cosine[:, None]).sum(axis=0)
        # 16,384 points; the finer picture's own quadrature is a few times better.
        np.testing.assert_allclose(got, want, rtol=5e-3)
    np.testing.assert_allclose(np.linalg.norm(drawn.toward, axis=1), 1.0, atol=1e-12)


def test_density_is_that_of_the_texel() -> None:
    picture = RNG.random((16, 32, 3))
    source = DirectionSource(picture)
    drawn = source.draw(sobol_points(0, 512), 3.0)
    x, y = place_of(drawn.toward, 32, 16)
    np.testing.assert_allclose(drawn.density, 3.0 * source.density[y.astype(int), x.astype(int)])
    total = (source.density * solid_angles(16, 32)).sum()
    assert total == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("count", [1, 7, 64])
def test_suns_have_all_their_light(count: int) -> None:
    picture = with_sun(with_sun(sky(), SUN, 1.5, 1e5), np.array([-1.0, 0.2, 0.4]), 1.0, 3e5)
    parts = split_world(picture.astype(np.float32))
    assert len(parts.suns) == 2
    source = SunSource(parts.suns)
    each = [source.draw(k, count) for k in range(count)]
    light = np.mean([(d.radiance / d.density[:, None]).sum(axis=0) for d in each], axis=0)
    want = sum((s * solid_angles(128, 256)[..., None]).sum(axis=(0, 1)) for s in parts.suns)
    np.testing.assert_allclose(light, want, rtol=1e-9)
    np.testing.assert_allclose(source.middles.radiance.sum(axis=0), want, rtol=1e-9)
    # The brighter one comes first.
    assert (each[0].toward[1] @ SUN) / np.linalg.norm(SUN) > np.cos(np.radians(3.0))


@pytest.mark.parametrize("picture", [
    np.zeros((8, 16, 3)), np.full((1, 1, 3), 1e9), np.full((4, 8, 3), 1e-30),
    with_sun(np.zeros((64, 128, 3)), SUN, 2.0, 1e9),
], ids=["black", "one texel", "faint", "only a sun"])  # fmt: skip
def test_extremes(picture: Array) -> None:
    parts = split_world(picture.astype(np.float32))
    source = DirectionSource(parts.residual)
    drawn = source.draw(sobol_points(0, 64), 4.0)
    for values in (drawn.toward, drawn.radiance, drawn.density):
        assert np.isfinite(values).all()
    assert (drawn.density > 0.0).all()
    levels = prepare_world(parts.residual).levels
    assert np.isfinite(levels).all()
    assert (levels >= 0.0).all()


def test_diffuse_level_is_the_irradiance() -> None:
    picture = sky(96)
    levels = prepare_world(picture).levels
    first = np.split(levels, LEVELS)[0]
    toward, weight = directions(96, 192).reshape(-1, 3), solid_angles(96, 192)
    light = (picture * weight[..., None]).reshape(-1, 3)
    rows = node_directions(48, 96)[::8, ::16]
    cosine = np.maximum(rows.reshape(-1, 3) @ toward.T, 0.0)
    want = (cosine @ light / np.pi).reshape(*rows.shape[:2], 3)
    # Convolved at half the resolution.
    np.testing.assert_allclose(first[::8, ::16], want, rtol=2e-3)
    # Straight up and down every longitude says the same.
    np.testing.assert_allclose(first[-1], first[-1, :1] * np.ones((96, 1)), rtol=1e-5)
