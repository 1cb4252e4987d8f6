# SPDX-License-Identifier: GPL-3.0-or-later
"""The twins of addon/glsl/passes/environment{,_ray}.glsl and addon/glsl/lib/facet_sampling.glsl."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bsdf import Lobe, dot
from .surfaces import Surfaces

Array = NDArray[np.float64]


def ray_chances(surface: Surfaces) -> list[Array]:
    """(H, W) for each lobe: with what chance a pixel's ray is sent for it."""
    lobes = [Lobe(surface, number) for number in range(1, surface.lobes + 1)]
    weights = [
        np.where(lobe.NoV > 0.0, (lobe.albedo.max(axis=-1) * lobe.view_weight[..., 0]), 0.0)
        for lobe in lobes
    ]
    total = np.sum(np.maximum(weights, 0.0), axis=0)
    return [np.maximum(w, 0.0) / np.where(total > 0.0, total, 1.0) for w in weights]


def mirrored_density(lobe: Lobe, L: Array) -> Array:
    """(H, W) directions per steradian of GGX's visible normals, mirrored: D G1 / (4 NoV)."""
    N, V = lobe.N_specular, lobe.V
    H = (L + V) / np.linalg.norm(L + V, axis=-1, keepdims=True)
    Y = np.cross(N, lobe.tangent)
    Y = Y / np.linalg.norm(Y, axis=-1, keepdims=True)
    X = np.cross(Y, N)
    ax, ay = lobe.roughness**2 / lobe.aspect, lobe.roughness**2 * lobe.aspect
    with np.errstate(divide="ignore", invalid="ignore"):
        # The sine from a cross product, as in the shader.
        across = (dot(H, X) / ax) ** 2 + (dot(H, Y) / ay) ** 2
        D = 1.0 / (np.pi * ax * ay * (across + dot(H, N) ** 2) ** 2)
        slope = ((dot(V, X) * ax) ** 2 + (dot(V, Y) * ay) ** 2) / dot(V, N) ** 2
        return np.asarray(D / (4.0 * dot(V, N)) * 2.0 / (1.0 + np.sqrt(1.0 + slope)))


@dataclass(frozen=True)
class Setting:
    """The numbers of the direction pass's block; see `DirectionPass.draw`."""

    rays: int = 0
    control: bool = False
    lambert: bool = True
    diffuse: bool = True
    specular: bool = True


def one_direction(
    surface: Surfaces, L: Array, density: float, is_open: Array, setting: Setting
) -> Array:
    """(H, W, 3): what a direction's radiance, over its density, is multiplied with.

    Args:
        surface: the surfaces.
        L: (3,) unit direction.
        density: such directions per steradian.
        is_open: (H, W) share of it that is seen, from the side that it comes from.
        setting: what else the pass is told.
    """
    L = np.broadcast_to(L, surface.geometric_normal[..., :3].shape)
    NgoL = dot(surface.geometric_normal[..., :3], L)
    front, back = np.where(NgoL > 0.0, is_open, 0.0), np.where(NgoL < 0.0, is_open, 0.0)
    occlusion = surface.channel("ambient_occlusion") * float(setting.control)
    total = np.zeros(L.shape)
    for number, chance in enumerate(ray_chances(surface), start=1):
        lobe = Lobe(surface, number)
        lambert = lobe.is_lambert
        share = np.where(lambert, float(setting.lambert) * (front - occlusion), front)
        seen = share[..., None] * lobe.diffuse(L) * lobe.transmission
        seen = seen + front[..., None] * lobe.sheen(L)
        through = np.maximum(-dot(lobe.N, L), 0.0) / np.pi * back
        seen = (seen + through[..., None] * lobe.translucent_color) * float(setting.diffuse)
        part = np.ones(chance.shape)
        if setting.rays:
            rays = setting.rays * chance * np.nan_to_num(mirrored_density(lobe, L))
            part = density / (density + np.where(chance > 0.0, rays, 0.0))
        glossy = (front * part)[..., None] * lobe.specular(L, np.zeros(part.shape))
        total = total + lobe.view_weight * (seen + glossy * float(setting.specular))
    return np.where(surface.hit[..., None], total, 0.0)
