# SPDX-License-Identifier: GPL-3.0-or-later
"""The twins of addon/glsl/passes/{ambient,background,emission}.glsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from addon.relight.world.world_light import LEVELS, LOBE_ROUGHNESS, WorldLight
from addon.scene.view import View
from addon.scene.world import World

from .bsdf import Lobe, dot
from .surfaces import Surfaces

Array = NDArray[np.float64]


def ambient(
    surface: Surfaces, world: World, light: WorldLight | None, *, only_lambert: bool = False
) -> Array:
    """(H, W, 3) radiance that the world causes; `light` is its prepared picture, if it has one."""
    result = np.zeros((*surface.hit.shape, 3))
    for number in range(1, surface.lobes + 1):
        lobe = Lobe(surface, number)
        N, V = lobe.N_specular, lobe.V
        if light is None:
            assert world.radiance is not None
            diffuse = behind = specular = np.broadcast_to(world.radiance, N.shape)
        else:
            assert world.equirect is not None
            first = np.split(light.levels, LEVELS)[0].astype(np.float64)
            diffuse, behind = nodes(first, lobe.N), nodes(first, -lobe.N)
            R = 2.0 * dot(N, V)[..., None] * N - V
            specular = _reflected(world.equirect, light, R, lobe.roughness)
        # A normal that faces away from the viewer reads the tables at their first node.
        seen = lobe.diffuse_color * lobe.transmission * diffuse
        if only_lambert:
            seen = np.where(lobe.is_lambert[..., None], seen, 0.0)
        else:
            seen = seen + lobe.translucent_color * behind + lobe.albedo * specular
            seen = seen + lobe.sheen_albedo * diffuse
        result = result + lobe.view_weight * seen
    open_share = surface.channel("ambient_occlusion")[..., None]
    return np.where(surface.hit[..., None], result * open_share, 0.0)


def _reflected(
    picture: NDArray[np.float32], light: WorldLight, R: Array, roughness: Array
) -> Array:
    lobes = [nodes(level.astype(np.float64), R) for level in np.split(light.levels, LEVELS)[1:]]
    seen = np.stack([equirect(picture.astype(np.float64), R), *lobes])
    steps = np.array([0.0, *LOBE_ROUGHNESS])
    at = np.clip(np.interp(roughness, steps, np.arange(len(steps))), 0.0, len(steps) - 1.0)
    low = np.minimum(at.astype(np.int64), len(steps) - 2)
    t = (at - low)[..., None]
    pick = np.take_along_axis
    lower = pick(seen, low[None, ..., None], axis=0)[0]
    upper = pick(seen, low[None, ..., None] + 1, axis=0)[0]
    return np.asarray(lower * (1.0 - t) + upper * t)


def equirect(picture: Array, direction: Array) -> Array:
    """Bilinear look-up; longitude goes round, latitude ends."""
    height, width, _ = picture.shape
    u = 0.5 - np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi)
    v = 0.5 + np.arcsin(np.clip(direction[..., 2], -1.0, 1.0)) / np.pi
    # One column more on either side, and the first and last row again.
    padded = np.pad(
        np.pad(picture, ((0, 0), (1, 1), (0, 0)), "wrap"), ((1, 1), (0, 0), (0, 0)), "edge"
    )
    at = np.stack([v * height + 0.5, u * width + 0.5])
    return np.stack([map_coordinates(padded[..., c], at, order=1) for c in range(3)], axis=-1)


def nodes(level: Array, direction: Array) -> Array:
    """Bilinear look-up where the first and last row look straight down and up."""
    rows, width, _ = level.shape
    u = 0.5 - np.arctan2(direction[..., 1], direction[..., 0]) / (2.0 * np.pi)
    v = 0.5 + np.arcsin(np.clip(direction[..., 2], -1.0, 1.0)) / np.pi
    padded = np.pad(level, ((0, 0), (1, 1), (0, 0)), "wrap")
    at = np.stack([v * (rows - 1), u * width + 0.5])
    return np.stack([map_coordinates(padded[..., c], at, order=1) for c in range(3)], axis=-1)


def background(
    surface: Surfaces, world: World | None, view: View, offset: tuple[float, float]
) -> Array:
    """(H, W, 4): the world behind the surfaces, and alpha 1 (the film is not transparent)."""
    height, width = surface.hit.shape
    x, y = np.meshgrid(np.arange(width) + 0.5 + offset[0], np.arange(height) + 0.5 + offset[1])
    result = np.zeros((height, width, 4))
    if world is not None and world.equirect is not None:
        _, rays = view.rays(np.stack([x, y], axis=-1))
        result[..., :3] = equirect(world.equirect.astype(np.float64), rays)
    elif world is not None:
        result[..., :3] = world.radiance
    result[surface.hit] = 0.0
    result[..., 3] = 1.0
    return result
