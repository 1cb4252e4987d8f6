# SPDX-License-Identifier: GPL-3.0-or-later
"""What the bounds of `addon/glsl/lib/tile_bounds.glsl` bound, in plain numpy, float64."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from addon.camplace.camera import CachingCamera


def best_scores(
    cameras: Sequence[CachingCamera],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    seen: NDArray[np.bool_],
    side: int,
) -> NDArray[np.float64]:
    """(rows, columns, cameras) the highest score (equation 5 with the density of texels) that any
    pixel of a tile has with a camera whose whole footprint sees it; 0 for none.

    Args:
        cameras: N of them.
        points, normals: (H, W, 3) world space.
        seen: (H, W) which pixels there are.
        side: pixels along a tile's side.
    """
    scores = np.zeros((*seen.shape, len(cameras)))
    for number, camera in enumerate(cameras):
        u, v, depth = np.moveaxis(camera.project(points), -1, 0)
        inside = seen & (depth > 0.0) & (np.abs(u - 0.5) <= 0.5) & (np.abs(v - 0.5) <= 0.5)
        toward = camera.origin - points
        distance = np.linalg.norm(toward, axis=-1)
        density = (camera.resolution / (2.0 * camera.half_extent)) ** 2
        score = (toward * normals).sum(axis=-1) / distance * density / distance**2
        scores[..., number] = np.where(inside, np.maximum(score, 0.0), 0.0)
    height, width = seen.shape
    rows, columns = -(-height // side), -(-width // side)
    whole = np.zeros((rows * side, columns * side, len(cameras)))
    whole[:height, :width] = scores
    return whole.reshape(rows, side, columns, side, -1).max(axis=(1, 3))
