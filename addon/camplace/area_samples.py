# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface points by importance and area (paper equation 2), inside the box of interest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from .mask import Mask

# A triangle that sticks out of the box is cut in four until its pieces are this share of the
# box's diagonal: most of a piece that touches the box then lies inside it.
PIECE = 0.125
# Halving sixty times takes any float64 triangle that is not astronomically larger than the box
# below PIECE; what is left over is dropped by the test of the points themselves.
MAX_HALVINGS = 60
# Points drawn for each one wanted, so that enough are left inside the box.
SPARE = 3


def sample_area(
    geometry: SceneGeometry,
    importance: NDArray[np.float64],
    box: NDArray[np.float64],
    count: int,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Draw up to `count` points with density f(i) = w_i A_i / sum of w_k A_k (equation 2).

    The draw is systematic: a polygon gets f(i) times the number of points, rounded up or down
    at random, as the paper asks. The paper clips nothing; here a ground plane that is far
    larger than the box does not use up the points.

    Args:
        geometry: the surfaces.
        importance: (T,) w_i; triangles of 0 get no points.
        box: (2, 3) lowest and highest corner; only points inside count.
        count: how many points are wanted. What is cut away from a surface gets none.
        rng: where the random numbers come from.

    Returns:
        Points (N, 3) and their triangles (N,), N <= count; none if the box holds no surface.
    """
    whole, sticking_out = _about_box(geometry, importance > 0.0, box)
    pieces, piece_of = _pieces_inside(geometry, sticking_out, box)
    triangle = np.concatenate([whole, piece_of])
    if not len(triangle):
        return np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
    edges = pieces[:, 1:] - pieces[:, :1]
    piece_area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
    area = np.concatenate([geometry.area[whole], piece_area])
    cumulative = np.cumsum(importance[triangle] * area)
    draws = count * SPARE
    steps = (np.arange(draws) + rng.random()) / draws * cumulative[-1]
    piece = np.minimum(np.searchsorted(cumulative, steps, side="right"), len(triangle) - 1)
    corners = geometry.vertices[geometry.triangles[triangle[piece]]]
    cut = piece >= len(whole)
    corners[cut] = pieces[piece[cut] - len(whole)]
    # Folding the unit square over its diagonal is uniform on the triangle.
    place = rng.random((draws, 2))
    place = np.where(place.sum(axis=-1, keepdims=True) > 1.0, 1.0 - place, place)
    points = corners[:, 0] + np.einsum("se,sex->sx", place, corners[:, 1:] - corners[:, :1])
    inside = np.flatnonzero(((points >= box[0]) & (points <= box[1])).all(axis=-1))
    inside = inside[Mask(geometry).there(points[inside], triangle[piece[inside]])]
    if len(inside) > count:
        inside = inside[(np.arange(count) * len(inside)) // count]
    return points[inside], triangle[piece[inside]]


def _about_box(
    geometry: SceneGeometry, chosen: NDArray[np.bool_], box: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The `chosen` triangles (T,) that lie in the box, and those that may reach into it.

    By outcodes (Cohen and Sutherland): for each vertex a bit for each wall that it is beyond.
    """
    code = np.zeros(len(geometry.vertices), dtype=np.uint8)
    for axis in range(3):
        place = geometry.vertices[:, axis]
        code |= (place < box[0, axis]).astype(np.uint8) << np.uint8(2 * axis)
        code |= (place > box[1, axis]).astype(np.uint8) << np.uint8(2 * axis + 1)
    a, b, c = (code[geometry.triangles[:, corner]] for corner in range(3))
    outside = a | b | c
    return (
        np.flatnonzero(chosen & (outside == 0)),
        np.flatnonzero(chosen & (outside != 0) & ((a & b & c) == 0)),
    )


def _pieces_inside(
    geometry: SceneGeometry, triangle: NDArray[np.int64], box: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Triangles, cut small where they leave the box: corners (N, 3, 3) and triangle (N,)."""
    longest = PIECE * float(np.linalg.norm(box[1] - box[0]))
    corners = geometry.vertices[geometry.triangles[triangle]]
    done: list[tuple[NDArray[np.float64], NDArray[np.int64]]] = []
    for _ in range(MAX_HALVINGS):
        low, high = corners.min(axis=1), corners.max(axis=1)
        touches = ((high >= box[0]) & (low <= box[1])).all(axis=-1)
        whole = ((low >= box[0]) & (high <= box[1])).all(axis=-1)
        small = np.linalg.norm(high - low, axis=-1) <= longest
        ready = touches & (whole | small)
        done.append((corners[ready], triangle[ready]))
        again = touches & ~ready
        if not again.any():
            break
        triangle = np.repeat(triangle[again], 4)
        corners = _quarters(corners[again])
    return np.concatenate([part[0] for part in done]), np.concatenate([part[1] for part in done])


def _quarters(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3, 3) triangles to (4 N, 3, 3), cut through the middles of their edges."""
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3, 3)
