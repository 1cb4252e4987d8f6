# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that each pixel sees, by casting a ray at every triangle in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry
from addon.scene.view import View


@dataclass(frozen=True)
class Seen:
    """What the rays of a view meet; P = width x height, row by row from the bottom.

    Attributes:
        triangle: (P,) its number, -1 for nothing.
        point: (P, 3) relative to the camera's place, metres.
        depth: (P,) along the camera's axis, metres; infinity for nothing.
        facing: (P,) |cosine| between ray and normal.
    """

    triangle: NDArray[np.int64]
    point: NDArray[np.float64]
    depth: NDArray[np.float64]
    facing: NDArray[np.float64]


def cast_rays(
    geometry: SceneGeometry,
    view: View,
    clips: tuple[float, float],
    offset: tuple[float, float] = (0.0, 0.0),
) -> Seen:
    """The nearest surface between the clip distances at each pixel's centre, moved by `offset`."""
    columns, rows = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    xy = np.stack([columns, rows], axis=-1).reshape(-1, 2) + offset
    origin, direction = view.rays(xy)
    axis = -view.world_from_camera[:3, 2]
    cosine = direction @ axis
    if not view.perspective:
        # Clip distances count from the camera, rays begin on its near plane.
        origin = origin + (((view.origin - origin) @ axis) / cosine)[:, None] * direction
    corners = geometry.vertices[geometry.triangles]
    count = len(xy)
    triangle, depth = np.full(count, -1), np.full(count, np.inf)
    along, facing = np.zeros(count), np.ones(count)
    for number, (a, b, c) in enumerate(corners):
        cross = np.cross(b - a, c - a)
        squared = cross @ cross
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((a - origin) @ cross) / (direction @ cross)
            p = (origin - a) + t[:, None] * direction
            v = np.cross(p, c - a) @ cross / squared
            w = np.cross(b - a, p) @ cross / squared
        inside = np.fmin(np.fmin(v, w), 1.0 - v - w)
        z = t * cosine
        closer = (inside >= 0.0) & (z >= clips[0]) & (z <= clips[1]) & (z < depth)
        triangle, depth = np.where(closer, number, triangle), np.where(closer, z, depth)
        along = np.where(closer, t, along)
        facing = np.where(closer, np.abs(direction @ cross) / np.sqrt(squared), facing)
    point = (origin - view.origin) + along[:, None] * direction
    return Seen(triangle, point, depth, facing)


def away_from_outlines(
    geometry: SceneGeometry,
    view: View,
    clips: tuple[float, float],
    offset: tuple[float, float] = (0.0, 0.0),
    pixels: float = 1.0 / 128.0,
) -> NDArray[np.bool_]:
    """(P,) whether all within `pixels` of a sample sees one triangle.

    A rasterizer has corners at multiples of 1/256 of a pixel, and so moves outlines by half of
    that each way; nearer than that a pixel may go either way.
    """
    around = [
        cast_rays(geometry, view, clips, (offset[0] + x * pixels, offset[1] + y * pixels)).triangle
        for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1), (0, 0))
    ]
    return np.asarray((np.stack(around) == around[-1]).all(axis=0))
