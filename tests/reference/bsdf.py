# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/{albedo_table,bsdf}.glsl: the lobes, in float64.

Written from the sources that the shader names: Walter et al. 2007 for GGX and the dielectric,
Schlick 1994, Heitz 2014 for masking, Kulla and Conty 2017 for light between facets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from addon.relight.directional_albedo import (
    DIELECTRIC_NODES,
    NODES,
    albedo_tables,
    dielectric_weight,
)

from .surfaces import Surfaces

Array = NDArray[np.float64]


def dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1))


class Lobes:
    """The lobes of all pixels, seen from the view."""

    def __init__(self, surface: Surfaces) -> None:
        self.Ng = surface.geometric_normal[..., :3]
        self.N = surface.shading[..., :3]
        self.V = surface.toward_viewer
        self.roughness = surface.shading[..., 3]
        self.diffuse_color = surface.diffuse[..., :3]
        self.f0, self.f90 = surface.specular_f0[..., :3], surface.specular_f90[..., :3]
        self.layer_f0, self.layer_f90 = surface.diffuse[..., 3], surface.specular_f0[..., 3]
        covered = np.where(self.layer_f90 > 0.0, self.layer_f90, 1.0)
        self.ratio = np.clip(self.layer_f0 / covered, 0.0, 1.0)
        self.N_specular = specular_normal(self.N, self.Ng, self.V)
        self.NoV = dot(self.N_specular, self.V)

        mu = np.clip(self.NoV, 0.0, 1.0)
        tables = albedo_tables()
        axis = np.linspace(0.0, 1.0, NODES)
        at = np.stack([self.roughness, mu], axis=-1)
        table = RegularGridInterpolator((axis, axis), tables.microfacet.astype(np.float64))(at)
        self.E, self.B, self.E_avg = table[..., 0], table[..., 1], table[..., 3]
        axis = np.linspace(0.0, 1.0, DIELECTRIC_NODES)
        cube = tables.dielectric.astype(np.float64).reshape((DIELECTRIC_NODES,) * 3)
        at = np.stack([self.ratio**0.25, self.roughness, mu], axis=-1)
        share = RegularGridInterpolator((axis,) * 3, cube)(at)
        self.B_dielectric = np.where(self.layer_f90 > 0.0, share * self.E, self.B)

    def bounces(self, f0: Array, f90: Array) -> Array:
        """The factor for light that bounces between facets; (H, W, 1 or 3)."""
        Fss = np.clip(f0 + (f90 - f0) / 21.0, 0.0, 1.0)
        E, E_avg = self.E[..., None], self.E_avg[..., None]
        Fms = Fss * E_avg / (1.0 - Fss * (1.0 - E_avg))
        return np.asarray(1.0 + Fms * (1.0 - E) / E)

    def albedo(self, f0: Array, f90: Array) -> Array:
        """The specular lobe's directional albedo; (H, W, 1 or 3)."""
        E, B = self.E[..., None], self.B[..., None]
        span = (self.layer_f90 - self.layer_f0)[..., None]
        single = f0 * (E - B) + f90 * B + span * (self.B_dielectric[..., None] - B)
        return np.asarray(single * self.bounces(f0, f90))

    @property
    def transmission(self) -> Array:
        """(H, W, 1) what the layer lets through to the diffuse lobe."""
        kept = self.albedo(self.layer_f0[..., None], self.layer_f90[..., None])
        return np.clip(1.0 - kept, 0.0, 1.0)

    def specular(self, L: Array, cell_sq: Array) -> Array:
        """(H, W, 3) the specular lobe times NoL, for a light of that squared angular radius."""
        N, V = self.N_specular, self.V
        NoL, NoV = dot(N, L), self.NoV
        alpha_sq = self.roughness**4
        lit = (NoL > 0.0) & (NoV > 0.0) & ((alpha_sq > 2e-10) | (cell_sq > 0.0))
        NoL, NoV = np.where(lit, NoL, 1.0), np.where(lit, NoV, 1.0)
        H = L + V
        H = H / np.linalg.norm(H, axis=-1, keepdims=True)
        NoH, LoH = np.where(lit, dot(N, H), 1.0), np.clip(dot(L, H), 1e-12, 1.0)
        slope = np.linalg.norm(np.cross(N, H), axis=-1) / NoH
        D = ggx_mean(slope, self.roughness**2, np.sqrt(cell_sq / (4.0 * LoH))) / NoH**4
        lambdas = sum(
            0.5 * (np.sqrt(1.0 + alpha_sq * (1.0 / c**2 - 1.0)) - 1.0) for c in (NoV, NoL)
        )
        schlick = ((1.0 - LoH) ** 5)[..., None]
        dielectric = np.vectorize(dielectric_weight)(LoH, self.ratio)[..., None]
        span = (self.layer_f90 - self.layer_f0)[..., None]
        F = self.f0 + (self.f90 - self.f0) * schlick + span * (dielectric - schlick)
        value = F * self.bounces(self.f0, self.f90) * (D / (4.0 * NoV * (1.0 + lambdas)))[..., None]
        return np.where(lit[..., None], value, 0.0)


def ggx_mean(slope: Array, alpha: Array, radius: Array) -> Array:
    """The mean of GGX's density of slopes over a disk at distance `slope` from its centre: the
    disk is the image of a spherical cap, whose angle is the difference of two arctangents."""
    small = radius < 1e-6 * (alpha + slope)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.arctan2(slope + radius, alpha) - np.arctan2(slope - radius, alpha)
        mean = np.sin(0.5 * half) ** 2 / (np.pi * radius**2)
        point = alpha**2 / (np.pi * (alpha**2 + slope**2) ** 2)
    return np.nan_to_num(np.where(small, point, mean), nan=0.0, posinf=0.0)


def specular_normal(N: Array, Ng: Array, V: Array) -> Array:
    """N, turned to Ng until the mirrored view direction is at least the threshold above the
    surface; found by bisection, where the shader solves for the angle."""
    NgoV = dot(Ng, V)
    threshold = np.minimum(0.9 * NgoV, 0.01)

    def height(normal: Array) -> Array:
        return np.asarray(2.0 * dot(normal, V) * dot(normal, Ng) - NgoV)

    side = N - dot(N, Ng)[..., None] * Ng
    length = np.linalg.norm(side, axis=-1, keepdims=True)
    X = side / np.where(length > 0.0, length, 1.0)
    # Between the normal that mirrors V in its highest direction and N itself, height falls.
    phi = np.arctan2(dot(V, X), NgoV)
    low = 0.5 * phi
    high = np.arctan2(length[..., 0], dot(N, Ng))
    high = np.maximum(high, low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        normal = np.sin(middle)[..., None] * X + np.cos(middle)[..., None] * Ng
        valid = height(normal) >= threshold
        low, high = np.where(valid, middle, low), np.where(valid, high, middle)
    turned = np.sin(low)[..., None] * X + np.cos(low)[..., None] * Ng
    keep = (height(N) >= threshold) | (NgoV <= 0.0) | (length[..., 0] <= 0.0)
    return np.where(keep[..., None], N, turned)
