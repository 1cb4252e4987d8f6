# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms between steps in time: turned, moved and stretched each for itself, as Cycles does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Of its greatest stretch: what is less along some axis is nothing, but for roundings.
_NO_STRETCH = 2.0**-40

# So much of another transform decides what is free, and changes nothing else.
_TRACE = 2.0**-30


def interpolate_affine(steps: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(M, 4, 4) at a time in [0, 1] from (S, M, 4, 4) at even times.

    A transform is a stretch, then a rotation, then a move (polar decomposition: K. Shoemake and
    T. Duff, "Matrix Animation and Polar Decomposition", 1992). Stretch and move are mixed, the
    rotation goes the short way at an even speed. Where one is nothing along some axis, it is turned
    there as the other is.
    """
    last = len(steps) - 1
    if last == 0:
        return steps[0].copy()
    step = min(int(time * last), last - 1)
    share = time * last - step
    first, second = steps[step], steps[step + 1]
    result = first + share * (second - first)
    changes = (first[:, :3, :3] != second[:, :3, :3]).any(axis=(1, 2))
    if changes.any():
        a, b = first[changes, :3, :3], second[changes, :3, :3]
        (turn_0, stretch_0), (turn_1, stretch_1) = _polar_beside(a, b), _polar_beside(b, a)
        stretch = stretch_0 + share * (stretch_1 - stretch_0)
        part = _part_of_rotation(np.swapaxes(turn_0, 1, 2) @ turn_1, share)
        result[changes, :3, :3] = turn_0 @ part @ stretch
    return result


def _polar_beside(
    matrix: NDArray[np.float64], other: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`_polar` of (N, 3, 3); what is free about rotations of singular ones is as of `other`."""
    turn, stretch = _polar(matrix)
    size = np.linalg.svd(matrix, compute_uv=False)
    flat = size[:, 2] <= _NO_STRETCH * size[:, 0]
    if flat.any():
        turn[flat], _ = _polar(matrix[flat] + _TRACE * other[flat])
        stretch[flat] = np.swapaxes(turn[flat], 1, 2) @ matrix[flat]
    return turn, stretch


def _polar(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotations and symmetric stretches (N, 3, 3); mirrors are in the stretch."""
    left, singular, right = np.linalg.svd(matrix)
    turn = left @ right
    sign = np.sign(np.linalg.det(turn))[:, None, None]
    stretch = np.swapaxes(right, 1, 2) @ (singular[:, :, None] * right)
    return turn * sign, stretch * sign


def _part_of_rotation(rotation: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """(N, 3, 3) a share of rotations' angles about the same axes."""
    skew = 0.5 * (rotation - np.swapaxes(rotation, 1, 2))
    axis = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    sine = np.linalg.norm(axis, axis=1)
    cosine = 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0)
    angle = np.arctan2(sine, cosine)
    # Half turns have no skew part: there R + I is twice the axis's outer product.
    outer = rotation + np.eye(3)
    column = np.argmax(np.einsum("nii->ni", outer), axis=1)
    half_turn = outer[np.arange(len(rotation)), :, column]
    half_turn *= np.where((half_turn * axis).sum(1) < 0.0, -1.0, 1.0)[:, None]
    axis = np.where((cosine < -0.99)[:, None], half_turn, axis)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    x, y, z = (axis / np.where(length > 0.0, length, 1.0)).T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    turned = (angle * share)[:, None, None]
    return np.asarray(np.eye(3) + np.sin(turned) * cross + (1.0 - np.cos(turned)) * (cross @ cross))
