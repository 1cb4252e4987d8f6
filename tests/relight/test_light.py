# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights whose answer is known on paper, and the points that stand for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from tests.reference.surfaces import surfaces
from tests.synthetic import looking_at

from .drawing import drawn_light

WHITE = np.ones(3)
ALBEDO = 0.6


def radiance(light: Light, point: tuple[float, float, float], count: int = 1) -> float:
    """Of a Lambert surface at a point that faces up, drawn by the pass."""
    normal = np.array([0.0, 0.0, 1.0])
    surface = surfaces(np.array([[point]]), normal, albedo=ALBEDO)
    samples = [light_sample(light, k, count) for k in range(count)]
    return float(drawn_light(surface, light, samples)[0, 0, 0])


def down(height: float) -> NDArray[np.float64]:
    return looking_at((0.0, 0.0, height), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("radius", [0.0, 0.5])
def test_point_light_on_a_plane(radius: float) -> None:
    """L = rho Phi cos / (4 pi^2 d^2), whatever the radius of a sphere."""
    light = Light(
        "p", "POINT", down(2.0), 80.0, WHITE, shadow_soft_size=radius, use_soft_falloff=False
    )
    for x in (0.0, 1.0, 3.0):
        d_sq = 4.0 + x * x
        want = ALBEDO * 80.0 * (2.0 / np.sqrt(d_sq)) / (4.0 * np.pi**2 * d_sq)
        # 64 points of the ball leave 0.4 % at most; the shader itself is good to float32.
        count, tolerance = (1, 1e-6) if radius == 0.0 else (64, 0.005)
        assert radiance(light, (x, 0.0, 0.0), count) == pytest.approx(want, rel=tolerance)


@pytest.mark.usefixtures("gpu_context")
def test_soft_falloff_below_a_disk() -> None:
    """A disk of radius r that faces the receiver: E = Phi / (4 pi (d^2 + r^2))."""
    light = Light("p", "POINT", down(2.0), 80.0, WHITE, shadow_soft_size=0.8)
    want = ALBEDO / np.pi * 80.0 / (4.0 * np.pi * (4.0 + 0.64))
    assert radiance(light, (0.0, 0.0, 0.0), 256) == pytest.approx(want, rel=0.005)


@pytest.mark.usefixtures("gpu_context")
def test_spot_axis_and_cone() -> None:
    light = Light("s", "SPOT", down(2.0), 80.0, WHITE, spot_size=np.pi / 2, spot_blend=0.0)
    assert radiance(light, (0.0, 0.0, 0.0)) == pytest.approx(
        ALBEDO * 80.0 / (4.0 * np.pi**2 * 4.0), rel=1e-6
    )
    assert radiance(light, (1.99, 0.0, 0.0)) > 0.0
    assert radiance(light, (2.01, 0.0, 0.0)) == 0.0


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("angle", [0.0, 0.2])
def test_sun(angle: float) -> None:
    """E cos / pi; over the sun's disk the cosine's mean is exact for a normalized sun."""
    light = Light("s", "SUN", looking_at((1.0, 0.0, 2.0), (0, 0, 0)), 3.0, WHITE, angle=angle)
    want = ALBEDO * 3.0 / np.pi * 2.0 / np.sqrt(5.0)
    assert radiance(light, (0.0, 0.0, 0.0), 32) == pytest.approx(want, rel=1e-3)


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_small_area_light(shape: str) -> None:
    """L = rho Phi / (pi^2 d^2) facing it, for a light that is small from there."""
    light = Light("a", "AREA", down(2.0), 80.0, WHITE, shape=shape, size=0.01, size_y=0.02)  # type: ignore[arg-type]
    want = ALBEDO * 80.0 / (np.pi**2 * 4.0)
    assert radiance(light, (0.0, 0.0, 0.0), 4) == pytest.approx(want, rel=5e-5)
    behind = replace(light, world_from_light=looking_at((0, 0, 2.0), (0, 0, 4.0), (0, 1, 0)))
    assert radiance(behind, (0.0, 0.0, 0.0)) == 0.0


@pytest.mark.usefixtures("gpu_context")
def test_large_disk_from_below() -> None:
    """A disk of radius r, its axis through the receiver: E = Phi / pi / (pi r^2) pi sin^2 and
    sin^2 = r^2 / (r^2 + d^2)."""
    light = Light("a", "AREA", down(1.0), 80.0, WHITE, shape="DISK", size=2.0)
    want = ALBEDO / np.pi * 80.0 / np.pi / 2.0
    # 256 points of a light as wide as its distance.
    assert radiance(light, (0.0, 0.0, 0.0), 256) == pytest.approx(want, rel=0.01)


@pytest.mark.usefixtures("gpu_context")
def test_spread_keeps_the_power() -> None:
    """The spread's attenuation, over the hemisphere with the cosine, integrates to pi."""
    light = Light("a", "AREA", down(1.0), 1.0, WHITE, size=1e-3, spread=1.2)
    angle = (np.arange(400) + 0.5) / 400 * np.pi / 2.0
    # E on the floor at angle t: I0 a(t) cos^4 / h^2 with I0 = Phi / pi.
    values = np.array([radiance(light, (np.tan(t), 0.0, 0.0)) for t in angle[angle < 0.65]])
    cosine = np.cos(angle[: len(values)])
    attenuation = values / (ALBEDO / np.pi * cosine**4 / np.pi)
    flux = np.sum(attenuation * cosine * np.sin(angle[: len(values)])) * 2.0 * np.pi
    flux *= angle[1] - angle[0]
    assert flux == pytest.approx(np.pi, rel=2e-3)  # the midpoint rule over a kink at 0.6


def test_exposure_and_units() -> None:
    light = Light("p", "POINT", down(1.0), 10.0, WHITE, exposure=2.0)
    np.testing.assert_allclose(light.intensity, 40.0 / (4.0 * np.pi))
    bare = replace(light, normalize=False, shadow_soft_size=0.5)
    np.testing.assert_allclose(bare.intensity, 40.0 * 0.25)
    sun = Light("s", "SUN", down(1.0), 2.0, WHITE, angle=0.0, normalize=False)
    np.testing.assert_allclose(sun.intensity, 2.0)
    area = Light("a", "AREA", down(1.0), 2.0, WHITE, shape="RECTANGLE", size=2.0, size_y=3.0)
    np.testing.assert_allclose(replace(area, normalize=False).intensity, 12.0 / np.pi)
    assert not replace(area, size=0.0).is_lit
    assert not replace(area, energy=0.0).is_lit


def test_points_of_a_ball_are_a_disk_from_any_side() -> None:
    light = Light("p", "POINT", np.eye(4), 1.0, WHITE, shadow_soft_size=2.0)
    points = np.array([light_sample(light, k, 4000).position for k in range(4000)])
    for axis in (np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.48, 0.64])):
        across = points - (points @ axis)[:, None] * axis
        share = np.sum(across**2, axis=1) / 4.0  # even over a disk: r^2 is even in [0, 1]
        counts = np.histogram(share, bins=10, range=(0.0, 1.0))[0]
        # 400 a bin; independent points would leave a standard deviation of 20.
        assert np.abs(counts - 400).max() < 60
        assert share.max() <= 1.0


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_points_of_an_area_light(shape: str) -> None:
    place = down(3.0) @ np.diag([1.0, -2.0, 1.0, 1.0])
    light = Light("a", "AREA", place, 1.0, WHITE, shape=shape, size=1.0, size_y=0.5)  # type: ignore[arg-type]
    points = np.array([light_sample(light, k, 500).position for k in range(500)])
    local = np.linalg.solve(place, np.column_stack([points, np.ones(500)]).T).T
    np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-12)
    inside = np.abs(local[:, :2]) / [0.5, 0.25]
    limit = np.hypot(*inside.T) if shape == "ELLIPSE" else inside.max(axis=1)
    assert limit.max() <= 1.0
    assert limit.max() > 0.95
    np.testing.assert_allclose(points.mean(axis=0), light.position, atol=1e-12)


def test_points_of_a_sun_lie_in_its_cone() -> None:
    light = Light("s", "SUN", looking_at((1, 2, 3), (0, 0, 0)), 1.0, WHITE, angle=0.5)
    points = np.array([light_sample(light, k, 500).position for k in range(500)])
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-12)
    angle = np.arccos(np.clip(points @ -light.direction, -1.0, 1.0))
    assert angle.max() <= 0.25
    assert np.median(angle) == pytest.approx(0.25 / np.sqrt(2.0), rel=0.02)


def test_one_sample_is_the_centre_and_seeds_repeat() -> None:
    light = Light("p", "POINT", down(3.0), 1.0, WHITE, shadow_soft_size=0.5)
    np.testing.assert_array_equal(light_sample(light, 0, 1).position, light.position)
    again = [light_sample(light, 3, 8, seed).position for seed in (4, 4, 5)]
    np.testing.assert_array_equal(again[0], again[1])
    assert (again[0] != again[2]).any()
