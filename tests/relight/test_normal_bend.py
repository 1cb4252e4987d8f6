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
from tests.reference.normal_bend import beyond
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


def row_of_metal(roughness: float) -> Surfaces:
    """Seen ever flatter, from 45 degrees to 5."""
    x = np.linspace(0.5, 6.0, 48)
    places = np.stack([x, 0.0 * x, 0.0 * x], axis=-1)[None]
    flat = surfaces(places, np.array([0.0, 0.0, 1.0]), eye=(0.0, 0.0, 0.5), albedo=0.0)
    one = np.ones((1, 48, 1))
    metal = {"specular_f0": one * np.ones(3), "specular_f90": one * np.ones(3)}
    return replace(flat, channels={**flat.channels, **metal, "roughness": one * roughness})


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize(
    ("roughness", "share", "tolerance"),
    [(0.1, 0.1, 0.001), (0.1, 0.3, 0.005), (0.1, 1.0, 0.03), (0.4, 0.1, 0.01), (0.4, 0.3, 0.06)],
)
@pytest.mark.parametrize("direction", [(0.0, 0.0), (-0.7, 0.0), (1.0, 0.6)])
def test_as_the_mean_over_normals(
    direction: tuple[float, float], roughness: float, share: float, tolerance: float
) -> None:
    """Normals that turn by a share of alpha about one axis and half of it about the other. The
    highlight's tail, which is all that is seen of it, is not what a wider lobe's would be."""
    metal = row_of_metal(roughness)
    size = share * roughness**2
    light = replace(
        Light("Sun", "SUN", looking_at((*direction, 1.0), (0, 0, 0)), 3.0, np.ones(3)), angle=0.1
    )
    sample = light_sample(light, 0, 1)

    def drawn(surface: Surfaces) -> NDArray[np.float64]:
        return drawn_light(surface, light, [sample])[0, :, :3].mean(axis=-1)

    places, weights = np.polynomial.hermite_e.hermegauss(7)
    weights /= weights.sum()
    want = np.zeros(48)
    for x, wx in zip(places, weights, strict=True):
        for y, wy in zip(places, weights, strict=True):
            normal = np.array([size * x, 0.5 * size * y, 1.0])
            normal /= np.linalg.norm(normal)
            turned = {"normal": np.broadcast_to(normal, (1, 48, 3))}
            want += wx * wy * drawn(replace(metal, channels={**metal.channels, **turned}))
    bend = np.broadcast_to([size, 0.0, 0.0, 0.5 * size], (1, 48, 4))
    got = drawn(replace(metal, bend=bend))
    # What is left is of second order in the turn: masking and foreshortening are taken for the mean
    # of the normals. As measured it is 0.01, 0.1, 1.2, 0.7 and 4.7 %.
    np.testing.assert_allclose(got, want, rtol=tolerance)
    assert want.max() > 1.9 * want.min() > 0.0


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_share_beyond_a_slope(size: float) -> None:
    """Beside the sum of GGX and normals of a Gaussian, in closed form but for one integral: GGX as
    Gaussians of all widths."""
    for slope in (0.2, 1.0, 3.0, 10.0):
        want, _ = quad(lambda t, s=slope: np.exp(-t - t * s**2 / (1.0 + 2.0 * size**2 * t)), 0, 60)
        u = beyond(np.array([slope, 0.0]), np.full(2, 4.0 * size**2))
        assert 1.0 / (1.0 + u) == pytest.approx(want, abs=2e-3)
