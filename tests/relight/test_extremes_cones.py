# SPDX-License-Identifier: GPL-3.0-or-later
"""Cones from a hundredth of a degree to beyond a half turn, and grids of every spread."""

from __future__ import annotations

import numpy as np
import pytest

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import NARROWEST_SPREAD, Light
from tests.reference import light_pass as twin
from tests.reference.surfaces import Surfaces, surfaces
from tests.synthetic import looking_at

from .extremes import INPUT, Array, Held, Lamps, exact, held, unit

pytestmark = pytest.mark.usefixtures("gpu_context")

WHITE = np.ones(3)
PLACE = looking_at((0.0, 0.0, 0.0), (0.2, 0.3, -1.0))
SIDE = 48


def beside_the_axis(angles: Array, light: Light) -> Surfaces:
    """(SIDE, SIDE) white surfaces at angles (SIDE, SIDE) from a light's axis, up to 1e6 m away."""
    rng = np.random.default_rng(4)
    turn = rng.uniform(0.0, 2.0 * np.pi, angles.shape)
    local = np.stack(
        [np.sin(angles) * np.cos(turn), np.sin(angles) * np.sin(turn), -np.cos(angles)], axis=-1
    )
    place = local @ light.axes * 10.0 ** rng.uniform(-6.0, 6.0, (*angles.shape, 1))
    return surfaces(exact(place), unit(-place))


def rule(light: Light, surface: Surfaces) -> Held:
    def white(moved: Surfaces) -> Array:
        # The cone alone is of interest; the normals face the light.
        L, strength, _ = twin.incidence(moved, light, sample)
        NoL = np.sum(moved.channel("normal") * L, axis=-1)
        return np.repeat((strength * np.maximum(NoL, 0.0))[..., None], 3, axis=-1)

    sample = light_sample(light, 0, 1)
    light_power = light.intensity / np.pi
    found = held(white, surface)
    return Held(found.want * light_power, found.bound * light_power)


def check(light: Light, angles: Array, *, edges: float) -> tuple[Array, Held]:
    surface = beside_the_axis(angles, light)
    lamps = Lamps(surface)
    found = rule(light, surface)
    got = lamps.drawn(light, light_sample(light, 0, 1))
    found.assert_holds(got, edges=edges)
    return got, found


@pytest.mark.parametrize("blend", [0.0, 0.15, 1.0])
@pytest.mark.parametrize("degrees", [0.01, 0.1, 1.0, 30.0, 120.0, 179.0, 180.0])
def test_cones(degrees: float, blend: float) -> None:
    """From the axis to beyond the rim. A direction is off by INPUT at most, which a cone of half
    angle a turns into INPUT / (a blend) of its light; one without blend is a step."""
    size = float(np.radians(degrees))
    light = Light("l", "SPOT", PLACE, 1.0, WHITE, spot_size=size, spot_blend=blend)
    angles = np.linspace(0.0, 0.75 * size, SIDE * SIDE).reshape(SIDE, SIDE)
    got, found = check(light, angles, edges=0.0 if blend else 5e-3)
    assert (got[..., 0] > 0.0).mean() == pytest.approx(2.0 / 3.0, abs=0.02)
    if blend:
        # Most are held to what float32 leaves of an angle in the soft part of the cone.
        assert found.share_held_to(max(16.0 * INPUT / (blend * 0.5 * size), 1e-4)) > 0.5


def test_a_cone_all_around() -> None:
    """As shadows have it of a light that they were moved from: every direction, the back too."""
    light = Light("l", "SPOT", PLACE, 1.0, WHITE, spot_size=2.0 * np.pi, spot_blend=0.0)
    angles = np.linspace(0.0, 0.999 * np.pi, SIDE * SIDE).reshape(SIDE, SIDE)
    got, _ = check(light, angles, edges=0.0)
    assert (got > 0.0).all()


@pytest.mark.parametrize("scale", [(1e-2, 1.0, 10.0), (1e6, -1e6, 1e-3), (1e-9, 1e-9, 1e-9)])
def test_stretched_cones(scale: tuple[float, float, float]) -> None:
    """A light object's scale stretches its cone: from a thread of 0.02 degrees to a fan."""
    place = PLACE.copy()
    place[:3, :3] = place[:3, :3] * scale
    light = Light("l", "SPOT", place, 1.0, WHITE, spot_size=0.8, spot_blend=1.0)
    # In the plane of one stretched axis and the light's.
    along = np.geomspace(1e-9, 1e9, SIDE * SIDE).reshape(SIDE, SIDE)
    check(light, np.arctan(along), edges=0.0)


@pytest.mark.parametrize("degrees", [1.0, 5.0, 90.0, 179.0, 179.99])
def test_spreads(degrees: float) -> None:
    """Through a grid the light falls linearly in the angle's tangent, to nothing."""
    spread = max(float(np.radians(degrees)), NARROWEST_SPREAD)
    light = Light("l", "AREA", PLACE, 1.0, WHITE, size=1e-6, spread=spread)
    tangents = np.linspace(0.0, 1.2 * np.tan(0.5 * spread), SIDE * SIDE).reshape(SIDE, SIDE)
    got, found = check(light, np.arctan(tangents), edges=0.0)
    assert (got[..., 0] > 0.0).mean() == pytest.approx(1.0 / 1.2, abs=0.02)
    if degrees <= 90.0:  # wider ones are lit at grazing angles above all
        assert found.share_held_to(1e-3) > 0.8
