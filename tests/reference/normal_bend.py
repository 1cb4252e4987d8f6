# SPDX-License-Identifier: GPL-3.0-or-later
"""The twins of addon/glsl/passes/normal_bend.glsl and addon/glsl/lib/bend.glsl, in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry
from addon.scene.octahedral import from_codes

from .shading_normal import shading_normals

Array = NDArray[np.float64]

LEAST_BEND, LONGEST, FARTHEST = 0.005, 20.0, 30.0
PAPERS_BEND, MIDDLE_BEND = 16.0, 4.0


def bend_covariance(
    geometry: SceneGeometry,
    triangle: NDArray[np.int64],
    point: Array,
    toward: Array,
    deviation: Array,
) -> Array:
    """(N, 3, 3) of the unit normals within what is seen of triangles about a place.

    Args:
        geometry: with corner normals.
        triangle: (N,) which of its triangles.
        point: (N, 3) in the plane of each.
        toward: (N, 3) unit vectors to the viewer.
        deviation: (N,) the standard deviation of what is seen, across the view.
    """
    assert geometry.corner_normals is not None
    a, b, c = np.moveaxis(geometry.vertices[geometry.triangles[triangle]], 1, 0)
    n = geometry.normal[triangle]
    side = np.cross(n, toward)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    facing = np.maximum(np.abs((n * toward).sum(axis=1)), 1.0 / LONGEST)
    along = np.cross(side, n) / facing[:, None]
    ways = deviation[:, None, None] * np.stack([side, along], axis=1)  # (N, 2, 3)
    # Shares of the second and third corner, per metre.
    edges = np.stack([b - a, c - a, n], axis=1)
    per_metre = np.linalg.inv(edges)[:, :, :2]
    shares = ways @ per_metre  # (N, 2, 2)
    root = np.linalg.cholesky(np.array([[2.0, -1.0], [-1.0, 2.0]]) / 36.0)
    scaled = shares @ np.linalg.inv(root).T
    scaled *= np.minimum(FARTHEST / np.abs(scaled).max(axis=2, keepdims=True), 1.0)
    part = np.einsum("nwi,nwj->nij", scaled, scaled)
    # Both Gaussians' product, where the triangle's variance is one.
    seen = np.linalg.inv(np.linalg.inv(part) + np.eye(2))
    A, B, C = np.moveaxis(from_codes(geometry.corner_normals[triangle]).astype(np.float64), 1, 0)
    N = shading_normals(geometry, triangle, point)
    beyond = np.linalg.inv(edges)
    share = np.einsum("ni,nij->nj", point - a, beyond)[:, :2]
    size = np.linalg.norm(A + share[:, :1] * (B - A) + share[:, 1:] * (C - A), axis=1)
    turn = np.stack([B - A, C - A], axis=2) / size[:, None, None]
    turn -= N[:, :, None] * np.einsum("ni,nij->nj", N, turn)[:, None]
    turn = turn @ root
    return np.asarray(turn @ seen @ np.swapaxes(turn, 1, 2))


def bend_of_lobe(
    X: Array, Y: Array, ax: Array, ay: Array, bend: Array
) -> tuple[Array, Array, Array, Array]:
    """A lobe's frame and alphas along the axes of how normals turn (H, W, 4), as `surface_bend` has
    it: X and Y (H, W, 3), alphas (H, W, 2), and 4 variances of normals over their squares."""
    frame = np.stack([X, Y], axis=-1)
    d = np.einsum("...i,...ij->...j", bend[..., :3], frame)
    size = np.linalg.norm(d, axis=-1, keepdims=True)
    e = bend[..., 3:] * np.stack([-d[..., 1], d[..., 0]], axis=-1) / np.maximum(size, 1e-15)
    own = np.zeros((*ax.shape, 2, 2))
    own[..., 0, 0], own[..., 1, 1] = ax**2, ay**2
    cov = own + 2.0 * sum(v[..., :, None] * v[..., None, :] for v in (d, e))
    variance, axes = np.linalg.eigh(cov)
    variance, axes = variance[..., ::-1], axes[..., ::-1]
    # Right-handed as X and Y are.
    axes[..., 1] *= np.sign(np.linalg.det(axes))[..., None]
    before = np.einsum("...ji,...jk,...ki->...i", axes, own, axes)
    bent = np.sum(bend[..., :3] ** 2, axis=-1) > LEAST_BEND * np.minimum(ax, ay) ** 2
    turned = frame @ axes
    return (
        np.where(bent[..., None], turned[..., 0], X),
        np.where(bent[..., None], turned[..., 1], Y),
        np.where(bent[..., None], np.sqrt(before), np.stack([ax, ay], axis=-1)),
        np.where(bent[..., None], 2.0 * np.maximum(variance / before - 1.0, 0.0), 0.0),
    )


def beyond(slope: Array, bend: Array, k: Array | float) -> Array:
    """(...,) u for slopes (..., 2) over alpha, by bisection: GGX's share beyond a slope with these
    bends (..., 2) is 1 / (1 + u)."""
    low, high = np.zeros(slope.shape[:-1]), np.sum(slope**2, axis=-1)
    for _ in range(200):
        u = 0.5 * (low + high)
        grown = bend / (k + u)[..., None]
        found = np.sum(slope**2 / (1.0 + grown), axis=-1)
        low, high = np.where(found > u, u, low), np.where(found > u, high, u)
    return np.asarray(0.5 * (low + high))


def middle(bend: Array | float) -> Array:
    """`beyond`'s k, of the greater bend of two."""
    return np.asarray((MIDDLE_BEND + 2.0 * bend) / (MIDDLE_BEND + bend))


def growth(nearest: Array, spread: Array, bend: Array) -> tuple[Array, Array, Array]:
    """For a cell's slope over alpha nearest to the middle (..., 2), and its corners' variance
    (...,): by which share of themselves the squares of alpha grow (..., 2), what a lobe that is so
    wide is to be multiplied with (...,), and the normals' part of a slope (..., 2)."""
    most = bend.max(axis=-1)
    is_wide = spread / (spread + 1.0 + 0.5 * most)
    k = middle(most) + (2.0 - middle(most)) * is_wide
    u = beyond(nearest, bend, k)
    grown = bend / (k + u)[..., None]
    leaning = grown / (1.0 + grown)
    # By the determinant of how q changes with the slope.
    q = nearest / np.sqrt(1.0 + grown)
    change = np.eye(2) - (q * leaning / (k + u)[..., None])[..., None] * q[..., None, :]
    paper = most**4 / (PAPERS_BEND**4 + most**4)
    plain = np.maximum(is_wide, paper)
    denser = plain + (1.0 - plain) / np.linalg.det(change)
    return grown + paper[..., None] * (0.5 * bend - grown), denser, leaning
