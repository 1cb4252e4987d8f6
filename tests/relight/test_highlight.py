# SPDX-License-Identifier: GPL-3.0-or-later
"""A lobe's light from the cells of a light, against the same summed over very many points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.light_points.light_cells import concentric, disk_cells, square_cells
from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from tests.reference import light_pass as twin
from tests.reference.bsdf import Lobe
from tests.reference.surfaces import Surfaces, surfaces
from tests.synthetic import looking_at

WHITE = np.ones(3)
SIDE = 50  # points along a side of the light
LIGHTS = {
    "area": Light("a", "AREA", looking_at((0.5, 2.0, 2.0), (0, 0, 0)), 10.0, WHITE, size=1.2),
    "area, disk": Light(
        "a", "AREA", looking_at((0.5, 2.0, 2.0), (0, 0, 0)), 10.0, WHITE, shape="DISK",
        size=1.2, spread=2.0),
    "sun": Light("s", "SUN", looking_at((0.5, 2.0, 2.0), (0, 0, 0)), 3.0, WHITE, angle=0.4),
}  # fmt: skip


def shiny(roughness: float, distribution: float, copies: int = 1) -> Surfaces:
    """Floor tiles, of which some mirror the light to the viewer, some its edge and some nothing;
    (tiles, copies)."""
    x, y = (a.reshape(-1, 1) for a in np.meshgrid(np.linspace(-1, 1, 4), np.linspace(-2.2, 0, 6)))
    place = np.repeat(np.stack([x, y, np.zeros_like(x)], axis=-1), copies, axis=1)
    shape = place.shape[:2]
    floor = surfaces(place, np.array([0.0, 0.0, 1.0]), eye=(0.0, -4.0, 2.0), albedo=0.0)
    one = np.ones((*shape, 1))
    channels = {
        "specular_f0": 0.9 * np.ones((*shape, 3)), "specular_f90": np.ones((*shape, 3)),
        "roughness": roughness * one, "distribution": distribution * one,
        "aspect": 1.3 * one, "tangent": np.broadcast_to([1.0, 0.0, 0.0], (*shape, 3)),
    }  # fmt: skip
    return replace(floor, channels={**floor.channels, **channels})


def summed(light: Light, roughness: float, distribution: float) -> NDArray[np.float64]:
    """(tiles, 3): the mean over very many points of the light, each without an extent."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    square = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    surface = shiny(roughness, distribution, len(square))
    place = surface.position[..., :3]
    disk = concentric(square)
    if light.type == "SUN":
        z = 1.0 - 2.0 * np.sin(0.25 * light.angle) ** 2 * np.sum(disk * disk, axis=1)
        around = disk / np.linalg.norm(disk, axis=1, keepdims=True)
        L = z[:, None] * light.axes[2] + np.sqrt(1.0 - z * z)[:, None] * around @ light.axes[:2]
        L, strength = np.broadcast_to(L, place.shape), np.ones(place.shape[:2])
    else:
        points = light.position + (disk if light.is_round else square) @ light.extents / 2.0
        toward = points - place
        t_sq = np.sum(toward**2, axis=-1)
        L = toward / np.sqrt(t_sq)[..., None]
        cosine = -(L @ light.direction)
        strength = cosine / t_sq
        if light.spread < np.pi:
            half, angle = 0.5 * light.spread, np.arccos(cosine)
            fade = (np.tan(half) - np.tan(angle)) / (np.tan(half) - half)
            strength = strength * np.maximum(fade, 0.0)
    value = Lobe(surface).specular(L, np.zeros(L.shape[:2])) * strength[..., None]
    return np.asarray(value.mean(axis=1))


@pytest.mark.parametrize("distribution", [0.0, 2.0, 3.0], ids=["GGX", "Beckmann", "Ashikhmin"])
@pytest.mark.parametrize("name", LIGHTS)
def test_cells_are_the_whole_light(name: str, distribution: float) -> None:
    light, surface = LIGHTS[name], shiny(0.35, distribution)
    want = summed(light, 0.35, distribution)
    # Fresnel's term and masking at one place of each cell: of the whole light at once a few per
    # cent, of 16 cells some thousandths. A tail is not to be seen beside the highlight's middle.
    for count, tolerance in ((1, 0.06), (5, 0.02), (16, 0.008)):
        got = np.zeros_like(want)
        for k in range(count):
            sample = light_sample(light, k, count)
            lit = twin.incidence(surface, light, sample)
            got += twin.specular(Lobe(surface), surface, light, sample, lit)[:, 0] / count
        assert np.abs(got - want).max() < tolerance * want.max()
        assert abs(got.mean() / want.mean() - 1.0) < tolerance


@pytest.mark.parametrize("count", [1, 2, 5, 12, 16, 64])
def test_cells_part_the_light(count: int) -> None:
    for cells, area in ((square_cells(count, 0.7), 4.0), (disk_cells(count), np.pi)):
        x, y = np.moveaxis(np.array([cell.corners for cell in cells]), -1, 0)
        areas = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
        assert areas.sum() == pytest.approx(area)
        # Straight sides take a little of a disk's outer cells.
        assert areas.min() > 0.8 * area / count
        middle = np.mean([cell.point for cell in cells], axis=0)
        # Five cells have two rows that differ.
        np.testing.assert_allclose(middle, 0.0, atol=0.05 if count == 5 else 1e-12)
        for cell in cells:
            edges = np.roll(cell.corners, -1, axis=0) - cell.corners
            inward = cell.point - cell.corners
            turn = edges[:, 0] * inward[:, 1] - edges[:, 1] * inward[:, 0]
            assert (turn > -0.05 * area / count).all()
