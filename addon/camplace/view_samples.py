# SPDX-License-Identifier: GPL-3.0-or-later
"""What the shot's views see: surface points dense where their pixels are dense."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from ..scene.view import View
from .rays import RayCaster
from .samples import Samples

# Cells of the pixel raster are jittered by up to half their side about the centre, so that
# regular patterns in the scene do not fall between the samples.
JITTER = 1.0


def sample_view(
    view: View,
    geometry: SceneGeometry,
    rays: RayCaster,
    count: int,
    rng: np.random.Generator,
) -> Samples:
    """Shoot about `count` rays through a jittered raster of pixels; keep what they hit.

    Each hit is oriented to the view and weighs what the artist gave its triangle. Rays that
    meet nothing give no sample.
    """
    xy = _raster(view, count, rng)
    origins, directions = view.rays(xy)
    origins = origins + directions * _near_distance(view, directions)[:, None]
    hits = rays.first_hit(origins, directions)
    met = hits.triangle >= 0
    triangle = hits.triangle[met]
    point = origins[met] + hits.distance[met, None] * directions[met]
    inside = view.project(point)[:, 2] <= 1.0  # beyond the far clip nothing is seen
    triangle, point = triangle[inside], point[inside]
    normal = geometry.normal_of(triangle)
    towards = np.einsum("sx,sx->s", normal, directions[met][inside])
    return Samples(
        point=point,
        normal=np.where(towards[:, None] > 0.0, -normal, normal),
        weight=geometry.weight[triangle].astype(np.float64),
        pixels=pixel_gradient(view, point),
        triangle=triangle,
        from_view=np.ones(len(point), dtype=np.bool_),
    )


def pixel_gradient(view: View, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(S, 2, 3): how many pixels a step in space moves a point (S, 3) in the picture.

    The derivative of x = (clip_x / clip_w + 1) width / 2, and of y likewise.
    """
    clip_from_space = view.clip_from_camera[:, :3] @ view.world_from_camera[:3, :3].T
    projected = view.project(points)
    size = np.array([view.width, view.height], dtype=np.float64)
    ndc = projected[:, :2] / size * 2.0 - 1.0
    rows = clip_from_space[None, :2] - ndc[:, :, None] * clip_from_space[None, 3:]
    return np.asarray(rows * (0.5 * size)[None, :, None] / projected[:, 3, None, None])


def side_seen(
    view: View, samples: Samples, rays: RayCaster, lift: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(S,) +1 where the view sees a sample's own side, -1 the other side, 0 neither."""
    x, y, z, w = view.project(samples.point).T
    inside = (x >= 0.0) & (x <= view.width) & (y >= 0.0) & (y <= view.height)
    inside &= (w > 0.0) & (np.abs(z) <= 1.0)
    axis = view.world_from_camera[:3, 2]
    if view.perspective:
        eye = np.broadcast_to(view.origin, samples.point.shape)
    else:
        eye = samples.point - ((samples.point - view.origin) @ axis)[:, None] * axis
    towards = eye - samples.point
    side = np.sign(np.einsum("sx,sx->s", towards, samples.normal)).astype(np.int64)
    ask = np.flatnonzero(inside & (side != 0))
    start = samples.point[ask] + (side[ask] * lift[ask])[:, None] * samples.normal[ask]
    direction = towards[ask] / np.linalg.norm(towards[ask], axis=-1, keepdims=True)
    end = eye[ask] - direction * _near_distance(view, -direction)[:, None]
    seen = np.zeros(len(samples), dtype=np.int64)
    seen[ask] = np.where(rays.occluded(start, end), 0, side[ask])
    return seen


def _raster(view: View, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """About `count` pixel positions (N, 2), one in each cell of an even raster."""
    side = np.sqrt(view.width * view.height / count)
    columns = max(1, round(view.width / side))
    rows = max(1, round(view.height / side))
    cell = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    place = cell + 0.5 + JITTER * (rng.random(cell.shape) - 0.5)
    return np.asarray(place / [columns, rows] * [view.width, view.height])


def _near_distance(view: View, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(R,) how far along each ray the picture begins: at the near clip for a perspective view.

    Orthographic rays already start there.
    """
    if not view.perspective:
        return np.zeros(len(directions))
    # Clip z = -w, with z = P22 depth + P23 and w = P32 depth along the camera's own z axis.
    near = view.clip_from_camera[2, 3] / view.clip_from_camera[2:, 2].sum()
    along = directions @ -view.world_from_camera[:3, 2]
    return np.asarray(near / along)
