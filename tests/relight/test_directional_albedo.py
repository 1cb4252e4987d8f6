# SPDX-License-Identifier: GPL-3.0-or-later
"""The specular tables: the white furnace, limits, and another quadrature."""

from __future__ import annotations

import numpy as np
import pytest

from addon.relight.shading.directional_albedo import (
    DIELECTRIC_NODES,
    NODES,
    albedo_tables,
    dielectric_weight,
)

AXIS = np.linspace(0.0, 1.0, NODES)


def over_light_directions(mu: float, roughness: float, schlick: bool) -> float:
    """The lobe's albedo by brute force over light directions, from D and G themselves."""
    steps = 1200
    z = (np.arange(steps) + 0.5) / steps
    phi = (np.arange(steps) + 0.5) / steps * np.pi
    NoL, around = np.meshgrid(z, phi, indexing="ij")
    V = np.array([np.sqrt(1.0 - mu * mu), 0.0, mu])
    sine = np.sqrt(1.0 - NoL**2)
    L = np.stack([sine * np.cos(around), sine * np.sin(around), NoL], axis=-1)
    H = L + V
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    a2 = roughness**4
    D = a2 / (np.pi * (1.0 + (a2 - 1.0) * H[..., 2] ** 2) ** 2)
    lambdas = sum(0.5 * (np.sqrt(1.0 + a2 * (1.0 / c**2 - 1.0)) - 1.0) for c in (NoL, mu))
    value = D / (4.0 * mu * (1.0 + lambdas))
    if schlick:
        value = value * (1.0 - H @ V) ** 5
    return float(value.mean() * 2.0 * np.pi)


@pytest.mark.parametrize("roughness", [12, 20, 31])
@pytest.mark.parametrize("mu", [3, 10, 30])
def test_against_another_quadrature(mu: int, roughness: int) -> None:
    table = albedo_tables().microfacet[roughness, mu]
    # 672 visible normals for a quadrature whose integrand has a kink at the horizon;
    # Cycles' own table is as far from it.
    for column, schlick in ((0, False), (1, True)):
        want = over_light_directions(AXIS[mu], AXIS[roughness], schlick)
        assert table[column] == pytest.approx(want, abs=2e-3)


def test_smooth_mirror() -> None:
    """At roughness 0 everything is reflected, by Fresnel's weight at the view's own angle."""
    tables = albedo_tables()
    np.testing.assert_allclose(tables.microfacet[0, :, 0], 1.0, atol=1e-6)
    np.testing.assert_allclose(tables.microfacet[0, 1:, 1], (1.0 - AXIS[1:]) ** 5, atol=1e-6)
    np.testing.assert_allclose(tables.microfacet[0, :, 3], 1.0, atol=1e-6)


def test_bounds_and_mean() -> None:
    table = albedo_tables().microfacet.astype(np.float64)
    E, B, E_avg = table[..., 0], table[..., 1], table[:, 0, 3]
    assert (E > 0.0).all()
    assert (E <= 1.0 + 1e-6).all()
    assert (B >= 0.0).all()
    assert (E >= B).all()
    fine = np.linspace(0.0, 1.0, 2001)
    for row in range(NODES):
        value = np.trapezoid(2.0 * fine * np.interp(fine, AXIS, E[row]), fine)
        assert E_avg[row] == pytest.approx(value, abs=1e-3)


def test_white_furnace() -> None:
    """With bounces between facets a white lobe (f0 = f90 = 1) reflects everything."""
    table = albedo_tables().microfacet.astype(np.float64)
    E, E_avg = table[..., 0], table[..., 3]
    Fms = E_avg / (1.0 - (1.0 - E_avg))
    np.testing.assert_allclose(E * (1.0 + Fms * (1.0 - E) / E), 1.0, atol=1e-12)


def test_dielectric_curve() -> None:
    """Ends, and Brewster's angle of glass: half the s-polarized reflectance there."""
    f0 = 0.04
    ends = dielectric_weight(np.array([1.0, 0.0]), f0)
    np.testing.assert_allclose(ends, [0.0, 1.0], atol=1e-12)
    brewster = np.arctan(1.5)
    s = ((np.cos(brewster) - 1.5 * np.cos(np.pi / 2 - brewster))
         / (np.cos(brewster) + 1.5 * np.cos(np.pi / 2 - brewster))) ** 2  # fmt: skip
    want = (0.5 * s - f0) / (1.0 - f0)
    assert dielectric_weight(np.array([np.cos(brewster)]), f0)[0] == pytest.approx(want, rel=1e-9)


def test_dielectric_slices() -> None:
    """A smooth surface's share is the curve itself; every share is between 0 and 1."""
    slices = albedo_tables().dielectric.reshape((DIELECTRIC_NODES,) * 3)
    mu = np.linspace(0.0, 1.0, DIELECTRIC_NODES)
    f0 = np.linspace(0.0, 1.0, DIELECTRIC_NODES) ** 4
    for number in (3, 7, 11):
        np.testing.assert_allclose(
            slices[number, 0, 1:], dielectric_weight(mu[1:], f0[number]), atol=1e-6
        )
    assert slices.min() >= 0.0
    assert slices.max() <= 1.0
