# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light the white microfacet lobe reflects: the tables of the specular terms.

Same tables as Cycles' (ggx_E, ggx_Eavg, ggx_gen_schlick_s, ggx_gen_schlick_ior_s), made here by
quadrature over the distribution of visible normals (Heitz, "Sampling the GGX Distribution of
Visible Normals", 2018): for a view direction mu = cos(theta) and roughness r, alpha = r^2,

    E(mu, r) = integral of D G / (4 NoV NoL) NoL dL = mean over visible normals of G2 / G1
    B(mu, r) = the same, weighted by Schlick's (1 - LoH)^5

so that the split sum is f0 (E - B) + f90 B.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

# Nodes on both ends of each axis, as in Cycles.
NODES = 32
DIELECTRIC_NODES = 16

# Points over the disk that visible normals come from: radius, quarter of the circle.
_RADII = 28
_ANGLES = 12

# mu = 0 has no visible normals; the table's first node stands for this cosine.
_GRAZING = 1e-5


@dataclass(frozen=True)
class AlbedoTables:
    """The tables.

    Attributes:
        microfacet: (NODES, NODES, 4) float32, by roughness (rows) and mu (columns):
            E, B, 0, E_avg = 2 * integral of E mu d(mu).
        dielectric: (DIELECTRIC_NODES^2, DIELECTRIC_NODES, 1) float32: slices, by the fourth
            root of f0, of B / E with a dielectric's Fresnel curve, rescaled to go from 0 to 1,
            in the place of Schlick's.
    """

    microfacet: NDArray[np.float32]
    dielectric: NDArray[np.float32]


@cache
def albedo_tables() -> AlbedoTables:
    """Make the tables, once."""
    weight, LoH = _visible_normals(NODES)
    E = weight.sum(axis=-1)
    B = (weight * (1.0 - LoH) ** 5).sum(axis=-1)
    mu = np.linspace(0.0, 1.0, NODES)
    E_avg = np.asarray(np.trapezoid(2.0 * mu * E, mu, axis=1))
    # The trapezoid rule's own error for E = 1, taken out, so that a smooth mirror has 1.
    E_avg /= np.trapezoid(2.0 * mu, mu)
    microfacet = np.stack([E, B, np.zeros_like(E), np.repeat(E_avg[:, None], NODES, 1)], axis=-1)

    weight, LoH = _visible_normals(DIELECTRIC_NODES)
    total = weight.sum(axis=-1)
    f0 = np.linspace(0.0, 1.0, DIELECTRIC_NODES) ** 4
    slices = [(weight * dielectric_weight(LoH, value)).sum(axis=-1) / total for value in f0]
    dielectric = np.concatenate(slices)[..., None]
    return AlbedoTables(microfacet.astype(np.float32), dielectric.astype(np.float32))


def dielectric_weight(LoH: NDArray[np.float64], f0: float) -> NDArray[np.float64]:
    """Fresnel's reflectance (Walter et al. 2007, eq. 22), rescaled to go from 0 to 1."""
    root = np.sqrt(np.clip(f0, 0.0, 0.99))
    ior = (1.0 + root) / (1.0 - root)
    g = np.sqrt(ior**2 - 1.0 + LoH**2)
    with np.errstate(invalid="ignore"):
        reflectance = (
            0.5
            * ((g - LoH) / (g + LoH)) ** 2
            * (1.0 + ((LoH * (g + LoH) - 1.0) / (LoH * (g - LoH) + 1.0)) ** 2)
        )
    start = ((ior - 1.0) / (ior + 1.0)) ** 2
    return np.asarray(np.clip((reflectance - start) / (1.0 - start), 0.0, 1.0))


def _visible_normals(nodes: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """For each roughness and mu and each of the quadrature's normals: G2 / G1 times the
    quadrature's weight, zero where light goes below the surface; and LoH. Both (nodes, nodes,
    points)."""
    roughness = np.linspace(0.0, 1.0, nodes)[:, None, None]
    mu = np.maximum(np.linspace(0.0, 1.0, nodes), _GRAZING)[None, :, None]
    alpha = roughness**2
    # Steep normals, whose light goes below the horizon, come from a thin rim: with the squared
    # radius s = 1 - (1 - w)^3 Gauss's points in w crowd there. Half of the disk mirrors the other.
    node, gauss = np.polynomial.legendre.leggauss(_RADII)
    w = 0.5 * (node + 1.0)
    radius = np.sqrt(1.0 - (1.0 - w) ** 3)
    share = 0.5 * gauss * 3.0 * (1.0 - w) ** 2
    angle = np.pi * ((np.arange(2 * _ANGLES) + 0.5) / (2 * _ANGLES) - 0.5)
    t1 = (radius[:, None] * np.cos(angle)).ravel()[None, None]
    t2 = (radius[:, None] * np.sin(angle)).ravel()[None, None]
    importance = np.repeat(share / (2 * _ANGLES), 2 * _ANGLES)

    sine = np.sqrt(1.0 - mu**2)
    stretch = np.sqrt((alpha * sine) ** 2 + mu**2)
    x, z = alpha * sine / stretch, mu / stretch  # the stretched view direction; y = 0
    tilt = 0.5 * (1.0 + z)
    t2 = (1.0 - tilt) * np.sqrt(1.0 - t1**2) + tilt * t2
    height = np.sqrt(np.maximum(1.0 - t1**2 - t2**2, 0.0))
    # T1 = +Y, T2 = view x T1 = (-z, 0, x) in the plane of incidence.
    normal = np.stack(
        [alpha * (-t2 * z + height * x), alpha * (t1 + 0.0 * x), t2 * x + height * z], axis=-1
    )
    normal[..., 2] = np.maximum(normal[..., 2], 0.0)
    length = np.linalg.norm(normal, axis=-1)
    normal /= np.where(length > 0.0, length, 1.0)[..., None]
    VoH = normal[..., 0] * sine + normal[..., 2] * mu
    NoL = 2.0 * VoH * normal[..., 2] - mu
    lit = (NoL > 0.0) & (length > 0.0)
    lambda_v = _lambda(mu, alpha)
    lambda_l = _lambda(np.where(lit, NoL, 1.0), alpha)
    weight = np.where(lit, (1.0 + lambda_v) / (1.0 + lambda_v + lambda_l), 0.0)
    return np.asarray(weight * importance), np.asarray(np.clip(VoH, 0.0, 1.0))


def _lambda(cosine: NDArray[np.float64], alpha: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smith's Lambda for GGX (Heitz 2014, eq. 72)."""
    tangent_sq = np.maximum(1.0 / cosine**2 - 1.0, 0.0)
    return np.asarray(0.5 * (np.sqrt(1.0 + alpha**2 * tangent_sq) - 1.0))
