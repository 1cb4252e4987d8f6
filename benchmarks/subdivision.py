# SPDX-License-Identifier: GPL-3.0-or-later
"""The same surface in more triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry

# Of the three edges (0-1, 1-2, 2-0), where each ends.
AFTER = np.array([1, 2, 0])


def subdivided(geometry: SceneGeometry, count: int) -> SceneGeometry:
    """`geometry` with at least as many triangles as it has, and exactly `count` if that is more.

    All triangles are split in four while that gives no more than `count`; then those with the
    longest edges are halved. Points of the surface, its uv and its cut-outs stay where they are.
    """
    while 4 * len(geometry) <= count:
        geometry = _quartered(geometry)
    while len(geometry) < count:
        geometry = _halved(geometry, min(count - len(geometry), len(geometry)))
    return geometry


def _quartered(geometry: SceneGeometry) -> SceneGeometry:
    """Every triangle cut through the middles of its edges."""
    a, b, c = geometry.triangles.T
    vertices, middle = _with_middles(geometry.vertices, geometry.triangles)
    ab, bc, ca = middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    triangles = np.stack([np.stack(part, axis=-1) for part in parts], axis=1).reshape(-1, 3)
    uv = None
    if geometry.uv is not None:
        u, v, w = np.moveaxis(geometry.uv, 1, 0)
        uv_middle = (0.5 * (u + v), 0.5 * (v + w), 0.5 * (w + u))
        pieces = [
            (u, uv_middle[0], uv_middle[2]),
            (uv_middle[0], v, uv_middle[1]),
            (uv_middle[2], uv_middle[1], w),
            uv_middle,
        ]
        uv = np.stack([np.stack(piece, axis=1) for piece in pieces], axis=1).reshape(-1, 3, 2)
    origin = np.repeat(np.arange(len(geometry)), 4)
    return _rebuilt(geometry, origin, vertices, triangles.astype(np.int32), uv)


def _halved(geometry: SceneGeometry, count: int) -> SceneGeometry:
    """The `count` triangles with the longest edges cut through the middle of that edge."""
    squared = np.empty((len(geometry), 3))
    for number in range(3):
        start, end = geometry.triangles[:, [number, AFTER[number]]].T
        way = geometry.vertices[end] - geometry.vertices[start]
        squared[:, number] = np.einsum("tx,tx->t", way, way)
    edge: NDArray[np.int64] = np.argmax(squared, axis=-1)
    cut = np.argpartition(-squared[np.arange(len(edge)), edge], count - 1)[:count]
    edge = edge[cut]
    row = np.arange(count)
    old = geometry.triangles[cut]
    ends = np.stack([old[row, edge], old[row, AFTER[edge]]], axis=-1)
    vertices, middle = _with_middles(geometry.vertices, ends, closed=False)
    triangles = np.concatenate([geometry.triangles, old])
    triangles[cut, AFTER[edge]] = middle[:, 0]
    triangles[len(geometry) + row, edge] = middle[:, 0]
    uv = None
    if geometry.uv is not None:
        uv = np.concatenate([geometry.uv, geometry.uv[cut]])
        half = 0.5 * (geometry.uv[cut, edge] + geometry.uv[cut, AFTER[edge]])
        uv[cut, AFTER[edge]] = half
        uv[len(geometry) + row, edge] = half
    origin = np.concatenate([np.arange(len(geometry)), cut])
    return _rebuilt(geometry, origin, vertices, triangles, uv)


def _with_middles(
    vertices: NDArray[np.float64], corners: NDArray[np.int32], *, closed: bool = True
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices with the middles of the edges between corners (T, C) added, and which they are.

    Triangles that share an edge share its middle. The result is (T, C) if the way around
    the corners is `closed`, else (T, C - 1).
    """
    start, end = corners.astype(np.int64), np.roll(corners, -1, axis=1).astype(np.int64)
    if not closed:
        start, end = start[:, :-1], end[:, :-1]
    key = np.minimum(start, end) * len(vertices) + np.maximum(start, end)
    edges, place = np.unique(key, return_inverse=True)
    first, second = np.divmod(edges, len(vertices))
    middles = 0.5 * (vertices[first] + vertices[second])
    number = (len(vertices) + place.reshape(start.shape)).astype(np.int32)
    return np.concatenate([vertices, middles]), number


def _rebuilt(
    geometry: SceneGeometry,
    origin: NDArray[np.int64],
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    uv: NDArray[np.float32] | None,
) -> SceneGeometry:
    """The geometry of new triangles, each with what its `origin` (T,) among the old ones had."""
    return replace(
        geometry,
        vertices=vertices,
        triangles=triangles,
        object_id=geometry.object_id[origin],
        material_id=geometry.material_id[origin],
        weight=geometry.weight[origin],
        camera_visible=geometry.camera_visible[origin],
        shadow_visible=geometry.shadow_visible[origin],
        uv=uv,
        copies=(),
    )
