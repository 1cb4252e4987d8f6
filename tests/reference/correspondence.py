# SPDX-License-Identifier: GPL-3.0-or-later
"""The correspondence and gather passes in plain numpy, float64.

Written from the paper's equation 5 and the docstrings of `addon/corrmap/correspondence.py`,
in world space and with each camera's own `project`, not by following the shader line by line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer

SAME_SURFACE_TEXELS = 0.5
VISIBLE_SHARE = 0.2
SAME_FACING = 0.2
_FLOAT_SPACING = 2.0**-23


@dataclass(frozen=True)
class Footprints:
    """Four texels for each of N points: x, y, bilinear weights, and how surely each shows the
    point's own surface; all (N, 4)."""

    x: NDArray[np.int64]
    y: NDArray[np.int64]
    weight: NDArray[np.float64]
    same: NDArray[np.float64]


def footprints(
    framebuffer: DeepFramebuffer,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    local_size: NDArray[np.float64],
) -> Footprints:
    """The texels round the projection of (N, 3) world points, and which show their surface."""
    camera = framebuffer.camera
    u, v, depth = camera.project(points).T
    size = camera.resolution
    x0, y0 = u * size - 0.5, v * size - 0.5
    fx, fy = x0 - np.floor(x0), y0 - np.floor(y0)
    columns = np.floor(x0)[:, None] + np.array([0, 1, 0, 1])
    rows = np.floor(y0)[:, None] + np.array([0, 0, 1, 1])
    x = np.clip(np.nan_to_num(columns), 0, size - 1).astype(np.int64)
    y = np.clip(np.nan_to_num(rows), 0, size - 1).astype(np.int64)
    weight = np.stack([(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy], axis=1)
    stored = framebuffer.channels["depth"][y, x, 0].astype(np.float64)
    uv = np.stack([(x + 0.5) / size, (y + 0.5) / size], axis=-1)
    seen = camera.unproject(np.concatenate([uv, stored[..., None]], axis=-1))
    off_plane = np.abs(((seen - points[:, None]) * normals[:, None]).sum(-1))
    width = 2.0 * camera.half_extent * depth / size
    distance = np.linalg.norm(points - camera.origin, axis=1)
    bound = SAME_SURFACE_TEXELS * width + 8.0 * _FLOAT_SPACING * (local_size + distance)
    same = np.maximum(0.0, 1.0 - off_plane / bound[:, None])
    return Footprints(x, y, weight, np.where(stored > 0.0, same, 0.0))


def correspondence(
    framebuffers: Sequence[DeepFramebuffer],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    origin: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, 4): camera number or -1, u, v, score, for (N, 3) world points and facing normals."""
    result = np.zeros((len(points), 4))
    result[:, 0] = -1.0
    best = np.zeros(len(points))
    local_size = np.linalg.norm(points - origin, axis=1)
    for number, framebuffer in enumerate(framebuffers):
        camera = framebuffer.camera
        u, v, depth = camera.project(points).T
        inside = (depth > 0.0) & (np.abs(u - 0.5) <= 0.5) & (np.abs(v - 0.5) <= 0.5)
        toward = camera.origin - points
        distance = np.linalg.norm(toward, axis=1)
        density = (camera.resolution / (2.0 * camera.half_extent)) ** 2
        score = (toward * normals).sum(1) / distance * density / distance**2
        found = footprints(framebuffer, points, normals, local_size)
        share = (found.weight * found.same).sum(1)
        score = score * share
        better = inside & (share >= VISIBLE_SHARE) & (score > best)
        best = np.where(better, score, best)
        result[better] = np.stack([np.full_like(u, number), u, v, score], axis=1)[better]
    return result


def own_weights(
    framebuffer: DeepFramebuffer,
    taps: Footprints,
    normals: NDArray[np.float64],
    material: NDArray[np.int64],
) -> NDArray[np.float64]:
    """(N, 4) of the texels for N points: of those of their material that face as they do, if there
    are any."""
    weight = taps.weight * taps.same
    ids = framebuffer.channels["material_id"][taps.y, taps.x, 0]
    shading = framebuffer.channels["normal"][taps.y, taps.x].astype(np.float64)
    facing = (shading * normals[:, None]).sum(-1) > SAME_FACING
    own = weight * (ids == material[:, None]) * facing
    return np.where(own.sum(1, keepdims=True) > 0.0, own, weight)


def gather(
    framebuffers: Sequence[DeepFramebuffer],
    found: NDArray[np.float64],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    *,
    material: NDArray[np.int64],
    origin: NDArray[np.float64],
    channel: str,
    surest: bool = False,
) -> NDArray[np.float64]:
    """(N, components) of a channel through the map (N, 4), or of the texel alone that shows each
    point the most surely; NaN where the map has a hole."""
    components = framebuffers[0].channels[channel].shape[-1]
    result = np.full((len(points), components), np.nan)
    local_size = np.linalg.norm(points - origin, axis=1)
    for number, framebuffer in enumerate(framebuffers):
        mine = found[:, 0] == number
        if not mine.any():
            continue
        taps = footprints(framebuffer, points[mine], normals[mine], local_size[mine])
        weight = own_weights(framebuffer, taps, normals[mine], material[mine])
        if surest:
            weight = (np.arange(4) == weight.argmax(1)[:, None]) & (weight > 0.0)
        values = framebuffer.channels[channel][taps.y, taps.x].astype(np.float64)
        total = weight.sum(1, keepdims=True)
        with np.errstate(invalid="ignore"):
            result[mine] = (values * weight[..., None]).sum(1) / total
    return result


def fill(
    framebuffers: Sequence[DeepFramebuffer],
    found: NDArray[np.float64],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    *,
    material: NDArray[np.int64],
    origin: NDArray[np.float64],
    channel: str,
    cells: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(H, W, components) of a channel from neighbours, of all as if they were holes, and (H, W)
    whether these were on the same surface (-1), beside it (-2) or none (0).

    Args:
        framebuffers: of the caching cameras.
        found: (H, W, 4) the map.
        points: (H, W, 3) world space.
        normals: (H, W, 3) facing the viewer.
        material: (H, W).
        origin: of local space.
        channel: which.
        cells: (E, 2) of the rows at the end, where in the others their samples lie: x, y.
    """
    height, width, _ = found.shape
    picture = height - -(-len(cells) // width)
    value = gather(
        framebuffers, found.reshape(-1, 4), points.reshape(-1, 3), normals.reshape(-1, 3),
        material=material.ravel(), origin=origin, channel=channel, surest=True,
    ).reshape(height, width, -1)  # fmt: skip
    is_sure = np.isfinite(value[..., 0])
    value[~is_sure] = 0.0
    rows, columns = np.mgrid[:height, :width]
    place = np.stack([columns, rows], axis=-1)
    place.reshape(-1, 2)[picture * width :][: len(cells)] = cells
    result = np.zeros((height, width, value.shape[-1]))
    kind = np.zeros((height, width), dtype=np.int64)
    for way in (-1, -2):
        total, weights = np.zeros_like(result), np.zeros((height, width))
        for down in range(-2, 3):
            for across in range(-2, 3):
                x, y = place[..., 0] + across, place[..., 1] + down
                inside = (x >= 0) & (x < width) & (y >= 0) & (y < picture)
                x, y = np.clip(x, 0, width - 1), np.clip(y, 0, picture - 1)
                apart = points[y, x] - points
                bend = np.abs((apart * normals).sum(-1))
                fits = inside & is_sure[y, x] & (material[y, x] == material)
                if way == -1:
                    fits &= bend <= 0.5 * np.linalg.norm(apart, axis=-1)
                weight = fits / max(down**2 + across**2, 1)
                total += weight[..., None] * value[y, x]
                weights += weight
        new = (kind == 0) & (weights > 0.0)
        result[new], kind[new] = (total[new] / weights[new, None]), way
    return result, kind
