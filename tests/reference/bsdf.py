# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/{albedo_table,bsdf,diffuse,view_weight}.glsl: a lobe, in float64.

Written from the sources that the shader names: Walter et al. 2007 for GGX, Beckmann and the
dielectric, Schlick 1994, Heitz 2014 for masking, Kulla and Conty 2017 for light between facets,
Kutz et al. 2021 for the edge tint, Ashikhmin and Shirley 2000, Fujii's Oren-Nayar.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from addon.relight.shading.directional_albedo import (
    DIELECTRIC_NODES,
    NODES,
    albedo_tables,
    dielectric_weight,
)
from addon.relight.shading.sheen_table import sheen_table

from .surfaces import Surfaces

Array = NDArray[np.float64]


def dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1))


class Lobe:
    """One lobe of all pixels, seen from the view."""

    def __init__(self, surface: Surfaces, number: int = 1) -> None:
        def get(field: str) -> Array:
            return surface.channel(field, number)

        self.Ng = surface.geometric_normal[..., :3]
        self.N = get("normal")
        self.V = surface.toward_viewer
        self.roughness = get("roughness")
        self.distribution = get("distribution")
        self.diffuse_color, self.diffuse_roughness = get("diffuse_color"), get("diffuse_roughness")
        self.diffuse_share = np.maximum(get("diffuse_share"), 1e-6)[..., None]
        self.specular_share = np.maximum(get("specular_share"), 1e-6)[..., None]
        self.aspect, self.tangent = get("aspect"), get("tangent")
        self.diffuse_model = get("diffuse_model")
        self.sheen_color, self.sheen_roughness = get("sheen_color"), get("sheen_roughness")
        self.translucent_color = get("translucent_color")
        self.f0, self.f90, self.dip = get("specular_f0"), get("specular_f90"), get("specular_dip")
        self.layer_f0, self.layer_f90 = get("layer_f0"), get("layer_f90")
        self.dielectric = get("dielectric")[..., None]
        self.span = (get("dielectric") * (self.layer_f90 - self.layer_f0))[..., None]
        covered = np.where(self.layer_f90 > 0.0, self.layer_f90, 1.0)
        self.ratio = np.clip(self.layer_f0 / covered, 0.0, 1.0)
        flat = np.zeros((*surface.hit.shape, 4))
        self.bend = flat if surface.bend is None else surface.bend
        self.N_specular = specular_normal(self.N, self.Ng, self.V)
        self.NoV = dot(self.N_specular, self.V)
        self.view_weight = self._view_weight(surface, number)

        mu = np.clip(self.NoV, 0.0, 1.0)
        tables = albedo_tables()
        axis = np.linspace(0.0, 1.0, NODES)
        at = np.stack([self.roughness, mu], axis=-1)
        table = RegularGridInterpolator((axis, axis), tables.microfacet.astype(np.float64))(at)
        self.E, self.B, self.E_avg = table[..., 0], table[..., 1], table[..., 3]
        share = dielectric_share(self.ratio, self.roughness, mu)
        self.B_dielectric = np.where(self.layer_f90 > 0.0, share * self.E, self.B)

    def _view_weight(self, surface: Surfaces, number: int) -> Array:
        """(H, W, 1)."""
        base, slope, curve, parameter, roughness = (
            surface.channel(f"view_{name}", number)
            for name in ("base", "slope", "curve", "parameter", "roughness")
        )
        NoV = np.clip(np.abs(dot(self.N, self.V)), 0.0, 1.0)
        f0 = np.clip(parameter, 0.0, 1.0)
        values = [
            np.zeros_like(NoV),
            f0 + (1.0 - f0) * np.vectorize(dielectric_weight)(NoV, f0),
            1.0 - np.maximum(NoV, 1e-20) ** parameter,
            f0 + (1.0 - f0) * dielectric_share(f0, roughness, NoV),
            sheen_shape(NoV, roughness)[..., 0],
        ]
        return np.asarray(base + slope * np.choose(curve.astype(np.int64), values))[..., None]

    def bounces(self, f0: Array, f90: Array, dip: Array | float = 0.0) -> Array:
        """The factor for light that bounces between facets; (H, W, 1 or 3)."""
        return self.bounces_of(mean_reflectance(f0, f90, dip))

    def bounces_of(self, Fss: Array) -> Array:
        """The same by the mean of Fresnel's term."""
        E, E_avg = self.E[..., None], self.E_avg[..., None]
        Fms = Fss * E_avg / (1.0 - Fss * (1.0 - E_avg))
        return np.asarray(1.0 + Fms * (1.0 - E) / E)

    @property
    def own_bounces(self) -> Array:
        """Of the lobe itself: only multiscatter GGX has them."""
        has = (self.distribution == 0.0)[..., None]
        Fss = mean_reflectance(*(x / self.specular_share for x in (self.f0, self.f90, self.dip)))
        # A layer, and a metal, each by itself.
        layer = self.dielectric / self.specular_share
        layer_Fss = mean_reflectance(self.layer_f0, self.layer_f90)[..., None]
        of_layer = np.minimum(layer * layer_Fss, Fss)
        rest = np.minimum((Fss - of_layer) / np.where(layer < 0.999, 1.0 - layer, 1.0), 1.0)
        both = of_layer * self.bounces_of(layer_Fss) + (Fss - of_layer) * self.bounces_of(rest)
        is_both = (layer > 0.0) & (layer < 0.999)
        bounces = np.where(is_both, both / np.maximum(Fss, 1e-20), self.bounces_of(Fss))
        return np.where(has, bounces, 1.0)

    @property
    def albedo(self) -> Array:
        """(H, W, 3) the specular lobe's directional albedo."""
        mu = np.clip(self.NoV, 0.0, 1.0)[..., None]
        lost = self.dip * mu * (1.0 - mu) ** 6 * self.E[..., None]
        return np.maximum(self._single(self.f0, self.f90, self.span) - lost, 0.0) * self.own_bounces

    def _single(self, f0: Array, f90: Array, span: Array) -> Array:
        E, B = self.E[..., None], self.B[..., None]
        return np.asarray(f0 * (E - B) + f90 * B + span * (self.B_dielectric[..., None] - B))

    @property
    def transmission(self) -> Array:
        """(H, W, 1) what the layer lets through to the diffuse lobe."""
        f0, f90 = self.layer_f0[..., None], self.layer_f90[..., None]
        return np.clip(1.0 - self._single(f0, f90, f90 - f0) * self.bounces(f0, f90), 0.0, 1.0)

    def diffuse(self, L: Array) -> Array:
        """(H, W, 3) the diffuse base times NoL, without its layer."""
        NoL = np.maximum(dot(self.N, L), 0.0)
        lambert = (NoL / np.pi)[..., None] * np.ones(3)
        is_rough = (self.diffuse_roughness > 1e-5)[..., None]
        base = np.where(is_rough, self._oren_nayar(L, NoL), lambert)
        k, NoV = self.diffuse_roughness, np.maximum(dot(self.N, self.V), 0.01)
        both = np.where(NoL > 0.0, NoL * NoV, 1.0)
        minnaert = (k + 1.0) / (2.0 * np.pi) * both ** (k - 1.0) * NoL
        is_minnaert = (self.diffuse_model == 1.0)[..., None]
        return self.diffuse_color * np.where(is_minnaert, minnaert[..., None], base)

    @property
    def is_lambert(self) -> NDArray[np.bool_]:
        """(H, W) whether the diffuse base sends light evenly."""
        return np.asarray((self.diffuse_roughness <= 1e-5) & (self.diffuse_model == 0.0))

    @property
    def sheen_albedo(self) -> Array:
        """(H, W, 3)."""
        shape = sheen_shape(dot(self.N, self.V), self.sheen_roughness)
        return self.sheen_color * shape[..., :1]

    def sheen(self, L: Array) -> Array:
        """(H, W, 3) times NoL, in a frame with the view in the plane of x and z."""
        NoV = dot(self.N, self.V)
        x_axis = self.V - NoV[..., None] * self.N
        across = np.linalg.norm(x_axis, axis=-1, keepdims=True)
        x_axis = x_axis / np.where(across > 0.0, across, 1.0)
        x, y, z = (dot(axis, L) for axis in (x_axis, np.cross(self.N, x_axis), self.N))
        R, a, b = np.moveaxis(sheen_shape(NoV, self.sheen_roughness), -1, 0)
        size_sq = (a * x + b * z) ** 2 + (a * y) ** 2 + z**2
        value = R * np.maximum(z, 0.0) / np.pi * (a / size_sq) ** 2
        return self.sheen_color * value[..., None]

    def _oren_nayar(self, L: Array, NoL: Array) -> Array:
        sigma = np.clip(self.diffuse_roughness, 0.0, 1.0)
        a = 1.0 / (np.pi + sigma * (np.pi / 2.0 - 2.0 / 3.0))
        b = sigma * a
        NoV = np.maximum(dot(self.N, self.V), 0.0)
        s = dot(L, self.V) - NoL * NoV
        t = np.where(s > 0.0, s / np.maximum(np.maximum(NoL, NoV), 1e-37), s)
        rho = np.clip(self.diffuse_color / self.diffuse_share, 0.0, 1.0)
        mean = (a * np.pi + (2.0 * np.pi - 5.6) / 3.0 * b)[..., None]
        lost_mean = np.where(mean < 1.0, 1.0 - mean, 1.0)  # Lambert's has no bounces
        bounced = rho**2 * mean / lost_mean / (1.0 - rho * lost_mean) / np.pi
        lost = [1.0 - (a * np.pi + b * _oren_nayar_integral(mu)) for mu in (NoV, NoL)]
        both = (lost[0] * lost[1])[..., None]
        return np.asarray(NoL[..., None] * ((a + b * t)[..., None] + bounced * both))

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
        disk_sq = cell_sq / (4.0 * LoH)
        Y = np.cross(N, self.tangent)
        Y = Y / np.linalg.norm(Y, axis=-1, keepdims=True)
        X = np.cross(Y, N)
        ax, ay = self.roughness**2 / self.aspect, self.roughness**2 * self.aspect

        def masked(along: Array) -> Array:
            """Heitz 2014, eq. 80: alpha projected on the direction's azimuth, squared."""
            x, y = dot(along, X) ** 2, dot(along, Y) ** 2
            return np.asarray((x * ax**2 + y * ay**2) / np.maximum(x + y, 1e-300))

        # The slopes' plane, stretched so that the lobe is round.
        hx, hy = dot(H, X) ** 2, dot(H, Y) ** 2
        stretch = (hx + hy) / np.maximum(hx * self.aspect**2 + hy / self.aspect**2, 1e-300)
        round_sq = stretch * alpha_sq
        pairs = ((NoV, masked(V)), (NoL, masked(L)))
        D = stretch * ggx_mean(slope, np.sqrt(round_sq), np.sqrt(disk_sq)) / NoH**4
        lambdas = sum(0.5 * (np.sqrt(1.0 + a * (1.0 / c**2 - 1.0)) - 1.0) for c, a in pairs)
        shape = D / (4.0 * NoV * (1.0 + lambdas))
        wide = round_sq + 0.5 * disk_sq
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            D = stretch * np.exp(-(slope**2) / wide) / (np.pi * wide * NoH**4)
            beckmann = D / (4.0 * NoV * (1.0 + sum(_beckmann(c, a) for c, a in pairs)))
            n = 2.0 / wide - 2.0
            norms = [np.maximum(2.0 / (a**2 + 0.5 * disk_sq) - 1.0, 0.0) for a in (ax, ay)]
            log_cos = -0.5 * np.log1p(slope**2)
            pump = 1.0 / np.maximum(1e-6, np.maximum(LoH, 1e-6) * np.maximum(NoV, NoL))
            norm = np.sqrt(norms[0] * norms[1])
            ashikhmin = NoL * norm / (8.0 * np.pi) * np.exp(n * log_cos) * pump
            RoL = np.maximum(2.0 * NoV * NoL - dot(V, L), 1e-20)
            n = np.maximum(2.0 / (alpha_sq + 0.5 * cell_sq) - 2.0, 0.0)
            phong = NoL * (n + 2.0) / (2.0 * np.pi) * RoL**n
            n = np.maximum(2.0 / (alpha_sq + 0.125 * cell_sq) - 2.0, 0.0)
            blinn = NoL * (n + 8.0) / (8.0 * np.pi) * NoH**n
            wide = alpha_sq + 0.5 * disk_sq
            D = np.exp(-(slope**2) / wide) / (np.pi * wide * NoH**4)
            G = np.minimum(1.0, 2.0 * NoH / LoH * np.minimum(NoV, NoL))
            cook_torrance = D * G / (4.0 * NoV)
        models = [shape, shape, beckmann, ashikhmin, phong, blinn, cook_torrance]
        shape = np.choose(self.distribution.astype(np.int64), models)
        value = self.fresnel(LoH) * self.own_bounces * shape[..., None]
        return np.where(lit[..., None], value, 0.0)

    def fresnel(self, LoH: Array) -> Array:
        """(H, W, 3)."""
        schlick = ((1.0 - LoH) ** 5)[..., None]
        dielectric = np.vectorize(dielectric_weight)(LoH, self.ratio)[..., None]
        F = self.f0 + (self.f90 - self.f0) * schlick + self.span * (dielectric - schlick)
        return np.maximum(F - self.dip * (LoH * (1.0 - LoH) ** 6)[..., None], 0.0)

    def alphas_sq(self, along: Array, normal: Array | None = None) -> Array:
        """(H, W) Heitz 2014, eq. 80: alpha projected on a direction's azimuth, squared."""
        N = self.N_specular if normal is None else normal
        Y = np.cross(N, self.tangent)
        Y = Y / np.linalg.norm(Y, axis=-1, keepdims=True)
        x, y = dot(along, np.cross(Y, N)) ** 2, dot(along, Y) ** 2
        ax, ay = self.roughness**2 / self.aspect, self.roughness**2 * self.aspect
        return np.asarray((x * ax**2 + y * ay**2) / np.maximum(x + y, 1e-300))

    def smooth_terms(
        self, N: Array, L: Array, *, LoH: Array, NoH: Array, NoL: Array, mass: Array
    ) -> Array:
        """(H, W, 3) the specular lobe of a mass (H, W) of its facets' slopes: at most all light.
        N (H, W, 3) is the normal that masks and foreshortens."""
        NoV = np.where(dot(N, self.V) > 0.0, dot(N, self.V), 1.0)
        pairs = ((NoV, self.alphas_sq(self.V, N)), (NoL, self.alphas_sq(L, N)))
        lambdas = sum(0.5 * (np.sqrt(1.0 + a * (1.0 / c**2 - 1.0)) - 1.0) for c, a in pairs)
        ggx = LoH / (NoH * NoV * (1.0 + lambdas))
        beckmann = LoH / (NoH * NoV * (1.0 + sum(_beckmann(c, a) for c, a in pairs)))
        ashikhmin = NoL / np.maximum(NoV, NoL)
        n = np.maximum(2.0 / np.maximum(self.roughness**4, 2e-10) - 2.0, 0.0)
        blinn = NoL * LoH * (n + 8.0) / (n + 1.0)
        grooves = np.minimum(1.0, 2.0 * NoH / LoH * np.minimum(NoV, NoL)) * LoH / (NoH * NoV)
        models = [ggx, ggx, beckmann, ashikhmin, np.zeros_like(ggx), blinn, grooves]
        shape = np.choose(self.distribution.astype(np.int64), models)
        return self.fresnel(LoH) * self.own_bounces * np.minimum(mass * shape, 1.0)[..., None]


def mean_reflectance(f0: Array, f90: Array, dip: Array | float = 0.0) -> Array:
    """Fresnel's term over all directions."""
    return np.asarray(np.clip(f0 + (f90 - f0) / 21.0 - dip / 126.0, 0.0, 1.0))


def dielectric_share(f0: Array, roughness: Array, mu: Array) -> Array:
    """The table of a dielectric's curve, between its nodes."""
    axis = np.linspace(0.0, 1.0, DIELECTRIC_NODES)
    cube = albedo_tables().dielectric.astype(np.float64).reshape((DIELECTRIC_NODES,) * 3)
    at = np.stack([f0**0.25, roughness, mu], axis=-1)
    return np.asarray(RegularGridInterpolator((axis,) * 3, cube)(at))


def sheen_shape(mu: Array, roughness: Array) -> Array:
    """(..., 3) R, a, b between the table's nodes."""
    axis = np.linspace(0.0, 1.0, len(sheen_table()))
    at = np.stack([np.clip(roughness, 1e-3, 1.0), np.clip(mu, 0.0, 1.0)], axis=-1)
    table = sheen_table()[..., :3].astype(np.float64)
    shape = RegularGridInterpolator((axis, axis), table)(at)
    is_out = (shape[..., 0] < 1e-5) | (np.abs(shape[..., 1]) < 1e-5)
    return np.where(is_out[..., None], np.array([0.0, 1.0, 0.0]), shape)


def _oren_nayar_integral(mu: Array) -> Array:
    sine, theta = np.sqrt(1.0 - mu**2), np.arccos(np.clip(mu, 0.0, 1.0))
    safe = np.maximum(mu, 1e-6)
    value = sine * (theta - 2.0 / 3.0 - sine * mu) + 2.0 / 3.0 * sine / safe * (1.0 - sine**3)
    return np.where(mu < 1e-6, np.pi / 2.0 - 2.0 / 3.0 - mu, value)


def _beckmann(cosine: Array, alpha_sq: Array) -> Array:
    a = 1.0 / np.sqrt(np.maximum(alpha_sq * (1.0 / cosine**2 - 1.0), 1e-20))
    value = (1.0 - 1.259 * a + 0.396 * a**2) / (3.535 * a + 2.181 * a**2)
    return np.where(a < 1.6, value, 0.0)


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
