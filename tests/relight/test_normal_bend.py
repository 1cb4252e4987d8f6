# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights of surfaces whose normals turn within what a sample stands for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from tests.reference import light_pass as twin
from tests.reference.normal_bend import beyond, middle
from tests.reference.surfaces import Surfaces, random_surfaces, surfaces
from tests.synthetic import looking_at

from .drawing import drawn_light
from .test_passes import LIGHTS, OF_CELLS, assert_close


def bent(surface: Surfaces) -> Surfaces:
    """By up to half a radian, some by much less than their lobes are wide, some along one
    direction only."""
    rng = np.random.default_rng(6)
    shape = surface.hit.shape
    way = np.cross(surface.channel("normal"), rng.normal(size=(*shape, 3)))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    size = 10.0 ** rng.uniform(-5.0, -0.3, (*shape, 1))
    across = size * rng.random((*shape, 1)) * (rng.random((*shape, 1)) < 0.5)
    bend = np.concatenate([size * way, across], axis=-1)
    return replace(surface, bend=bend.astype(np.float32).astype(np.float64))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("name", ["spot, soft", "sun, wide", "area, spread"])
def test_light_pass(name: str, lobes: int) -> None:
    surface = bent(random_surfaces(9, lobes=lobes))
    sample = light_sample(LIGHTS[name], 2, 7)
    got = drawn_light(surface, LIGHTS[name], [sample])[..., :3]
    assert_close(got, twin.light_layer(surface, LIGHTS[name], sample), *OF_CELLS)
    flat = twin.light_layer(replace(surface, bend=None), LIGHTS[name], sample)
    # Most of what is seen is diffuse, and most bends are small: but not for nothing.
    assert (np.abs(got - flat) > 0.1 * flat.max(axis=-1, keepdims=True)).any(axis=-1).mean() > 0.01


# Seen by an eye half a metre above the place x = 0: where that which comes from (1, 0, 1) has its
# mirror image, and up to 5 alpha beside it; and, ever flatter, from 45 degrees to 5.
MIDDLE, FLAT = np.linspace(0.5, 0.6, 24), np.linspace(0.5, 6.0, 48)

SUN = Light("Sun", "SUN", looking_at((1.0, 0.0, 1.0), (0, 0, 0)), 3.0, np.ones(3))
FROM_AFAR = looking_at((10.5, 0.0, 10.0), (0.5, 0.0, 0.0))
WIDE = {
    "sun": replace(SUN, angle=0.02),
    "long, along": replace(
        Light("l", "AREA", FROM_AFAR, 100.0, np.ones(3)), shape="RECTANGLE", size=4.0, size_y=0.2
    ),
    "long, across": replace(
        Light("l", "AREA", FROM_AFAR, 100.0, np.ones(3)), shape="RECTANGLE", size=0.2, size_y=4.0
    ),
    "lamp": replace(Light("l", "POINT", FROM_AFAR, 100.0, np.ones(3)), shadow_soft_size=0.3),
    "wide lamp": replace(Light("l", "POINT", FROM_AFAR, 100.0, np.ones(3)), shadow_soft_size=1.5),
}


def row_of_metal(x: NDArray[np.float64], roughness: float) -> Surfaces:
    places = np.stack([x, 0.0 * x, 0.0 * x], axis=-1)[None]
    flat = surfaces(places, np.array([0.0, 0.0, 1.0]), eye=(0.0, 0.0, 0.5), albedo=0.0)
    one = np.ones((1, len(x), 1))
    metal = {"specular_f0": one * np.ones(3), "specular_f90": one * np.ones(3)}
    return replace(flat, channels={**flat.channels, **metal, "roughness": one * roughness})


def bent_and_mean(
    metal: Surfaces, light: Light, size: float, count: int = 1
) -> tuple[NDArray[np.float64], ...]:
    """(W,) each: what is seen of normals that turn by so much about one axis and half as much about
    the other; the mean over such normals, by Gauss and Hermite's points; and what is seen of even
    ones."""
    samples = [light_sample(light, k, count) for k in range(count)]

    def drawn(surface: Surfaces) -> NDArray[np.float64]:
        return drawn_light(surface, light, samples)[0, :, :3].mean(axis=-1)

    shape = metal.channels["normal"].shape
    places, weights = np.polynomial.hermite_e.hermegauss(11)
    weights /= weights.sum()
    mean = np.zeros(shape[1])
    for x, wx in zip(places, weights, strict=True):
        for y, wy in zip(places, weights, strict=True):
            normal = np.array([size * x, 0.5 * size * y, 1.0])
            turned = {"normal": np.broadcast_to(normal / np.linalg.norm(normal), shape)}
            mean += wx * wy * drawn(replace(metal, channels={**metal.channels, **turned}))
    bend = np.broadcast_to([size, 0.0, 0.0, 0.5 * size], (*shape[:2], 4))
    return drawn(replace(metal, bend=bend)), mean, drawn(metal)


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize(("share", "tolerance"), [(0.3, 0.06), (1.0, 0.28)])
@pytest.mark.parametrize("name", WIDE)
def test_as_the_mean_over_normals_about_the_middle(
    name: str, share: float, tolerance: float, count: int
) -> None:
    """Normals that turn by a share of alpha, lights that are small and wide beside the lobe. As
    measured 4.8 % and 24 %, of the long ones; the paper's lobe is off by 17 % and 97 %."""
    metal = row_of_metal(MIDDLE, 0.1)
    got, want, even = bent_and_mean(metal, WIDE[name], share * 0.01, count)
    np.testing.assert_allclose(got, want, rtol=tolerance)
    # All of the light is there, and of what even normals are off a third is left at most.
    assert got.sum() == pytest.approx(want.sum(), rel=0.1 * share + 0.01)
    if name in {"sun", "lamp", "long, along"}:
        assert np.linalg.norm(got - want) < 0.35 * np.linalg.norm(even - want)


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize(
    ("roughness", "share", "tolerance"),
    [(0.1, 0.1, 0.001), (0.1, 0.3, 0.005), (0.1, 1.0, 0.03), (0.4, 0.1, 0.01), (0.4, 0.3, 0.06)],
)
@pytest.mark.parametrize("direction", [(0.0, 0.0), (-0.7, 0.0), (1.0, 0.6)])
def test_as_the_mean_over_normals_far_from_the_middle(
    direction: tuple[float, float], roughness: float, share: float, tolerance: float
) -> None:
    """The highlight's tail is not what a wider lobe's would be, nor do its normals lean: the
    paper's is off by up to 85 %."""
    light = replace(SUN, world_from_light=looking_at((*direction, 1.0), (0, 0, 0)), angle=0.1)
    metal = row_of_metal(FLAT, roughness)
    got, want, _ = bent_and_mean(metal, light, share * roughness**2)
    # What is left is of second order in the turn: masking and foreshortening are taken for the mean
    # of the normals. As measured it is 0.01, 0.1, 1.3, 0.7 and 4.8 %.
    np.testing.assert_allclose(got, want, rtol=tolerance)
    assert want.max() > 1.9 * want.min() > 0.0


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("aspect", [1.0, 0.01])
@pytest.mark.parametrize("size", [1e-3, 1.0, 30.0])
def test_mirrors_that_turn_far(size: float, aspect: float) -> None:
    """Variances 1e17 times alpha's square, which overflow where they are taken to a power."""
    metal = row_of_metal(MIDDLE, 0.0)
    shape = metal.channels["normal"].shape
    values = {
        "aspect": np.full((*shape[:2], 1), aspect),
        "tangent": np.broadcast_to([1.0, 0.0, 0.0], shape),
    }
    bend = np.broadcast_to([size, 0.0, 0.0, 0.5 * size], (*shape[:2], 4))
    surface = replace(metal, channels={**metal.channels, **values}, bend=bend)
    sample = light_sample(WIDE["sun"], 0, 1)
    got = drawn_light(surface, WIDE["sun"], [sample])[0, :, :3]
    assert np.isfinite(got).all()
    assert (got > 0.0).all()


@pytest.mark.parametrize(("size", "tolerance"), [(0.1, 1e-3), (0.3, 4e-3), (0.5, 8e-3)])
def test_share_beyond_a_slope(size: float, tolerance: float) -> None:
    """Beside the sum of GGX and normals of a Gaussian, in closed form but for one integral: GGX as
    Gaussians of all widths."""
    bend = 4.0 * size**2
    for slope in np.geomspace(0.1, 10.0, 20):
        want, _ = quad(lambda t, s=slope: np.exp(-t - t * s**2 / (1.0 + 0.5 * bend * t)), 0, 60)
        u = beyond(np.array([slope, 0.0]), np.full(2, bend), middle(bend))
        assert 1.0 / (1.0 + u) == pytest.approx(want, abs=tolerance)
