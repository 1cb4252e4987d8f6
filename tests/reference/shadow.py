# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/shadow.glsl: a stored atlas of distances, read in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.relight.shadows.shadow_frustum import ShadowFrustum

from .bsdf import dot

Array = NDArray[np.float64]

# As in the shader: a few float32 spacings.
_ROUNDING = 4e-6


def visibility(frustum: ShadowFrustum, atlas: Array, points: Array, Ng: Array) -> Array:
    """(...) share of the four texels around each world point (..., 3) that see its plane."""
    faces = range(len(frustum.face_from_world))
    if frustum.turned:
        weights = np.stack([_weight(frustum, face, points) for face in faces])
        shares = np.stack([_look(frustum, face, atlas, points, Ng) for face in faces])
        return np.asarray((weights * shares).sum(axis=0) / weights.sum(axis=0))
    if frustum.parallel:
        return _in_cascades(frustum, atlas, points, Ng)
    axes = -frustum.face_from_world[:, 2]
    own = np.argmax((points - frustum.centre) @ axes.T, axis=-1)
    result = np.ones(points.shape[:-1])
    for face in faces:
        mine = own == face
        result[mine] = _look(frustum, face, atlas, points[mine], Ng[mine])
    return result


def _in_cascades(frustum: ShadowFrustum, atlas: Array, points: Array, Ng: Array) -> Array:
    """(...) what the smallest cascade that holds a point says of it."""
    result, found = np.ones(points.shape[:-1]), np.zeros(points.shape[:-1], dtype=bool)
    for face, (half, origin) in enumerate(
        zip(frustum.half_extents, frustum.origins, strict=True)
    ):  # fmt: skip
        in_face = (points - origin) @ frustum.face_from_world[face].T
        inside = (np.abs(in_face[..., :2]) <= half * frustum.inner_share).all(axis=-1)
        inside = ~found & (inside | (face == len(frustum.origins) - 1))
        result[inside] = _look(frustum, face, atlas, points[inside], Ng[inside])
        found |= inside
    return result


def _weight(frustum: ShadowFrustum, face: int, points: Array) -> Array:
    """(...) what a touching lamp's face has to say about points."""
    in_face = (points - frustum.centre) @ frustum.face_from_world[face].T
    depth = -in_face[..., 2]
    with np.errstate(divide="ignore"):
        x = np.abs(in_face[..., :2]).max(axis=-1) / (
            depth * frustum.half_extents[face] * frustum.inner_share
        )
    return np.asarray(np.where(depth > 0.0, np.maximum(1.0 - x, 0.0), 0.0) ** 8)


def _look(frustum: ShadowFrustum, face: int, atlas: Array, points: Array, Ng: Array) -> Array:
    """(...) what one face's map says of points."""
    size, share, half = frustum.resolution, frustum.inner_share, frustum.half_extents[face]
    result = np.ones(points.shape[:-1])
    receiver = points - frustum.origins[face]
    in_face = receiver @ frustum.face_from_world[face].T
    depth = np.ones_like(in_face[..., 2]) if frustum.parallel else -in_face[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        ndc = in_face[..., :2] / (depth * half)[..., None]
    inside = depth > 0.0
    at = (np.clip(ndc[inside], -share, share) * 0.5 + 0.5) * size - 0.5
    low = np.floor(at).astype(np.int64)
    t = at - low
    slack = half / size * depth[inside]
    total = np.zeros(len(at))
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.where(dx, t[:, 0], 1.0 - t[:, 0]) * np.where(dy, t[:, 1], 1.0 - t[:, 1])
            texel = np.clip(low + np.array([dx, dy]), 0, size - 1)
            ray = _Ray(frustum, face, texel)
            stored = atlas[ray.row, ray.column]
            total += weight * ray.reaches(stored, receiver[inside], Ng[inside], slack)
    result[inside] = total
    return result


class _Ray:
    """The rays through texels' (N, 2) centres."""

    def __init__(self, frustum: ShadowFrustum, face: int, texel: NDArray[np.int64]) -> None:
        x, y = frustum.cell(face)
        self.column, self.row = x + texel[:, 0], y + texel[:, 1]
        right, up, back = frustum.face_from_world[face]
        across = ((texel + 0.5) / frustum.resolution * 2.0 - 1.0) * frustum.half_extents[face]
        place = across[:, :1] * right + across[:, 1:] * up
        self.parallel = frustum.parallel
        if frustum.parallel:
            self.direction, self.start = np.broadcast_to(-back, place.shape), place
        else:
            length = np.linalg.norm(place - back, axis=1, keepdims=True)
            self.direction, self.start = (place - back) / length, np.zeros_like(place)

    def reaches(self, stored: Array, receiver: Array, Ng: Array, slack: Array) -> Array:
        """1 where nothing is stored before the receiver's plane, or before the receiver if that is
        nearer, else 0."""
        facing = dot(Ng, self.direction)
        reach = dot(Ng, receiver - self.start)
        faces_light = facing < 0.0 if self.parallel else reach < 0.0
        size = np.linalg.norm(receiver, axis=1)
        along = dot(receiver, self.direction) if self.parallel else size
        with np.errstate(divide="ignore", invalid="ignore"):
            plane = reach / facing
            plane = plane - _ROUNDING * (plane + size / -facing)
        limit = np.where(facing < 0.0, np.fmin(plane, along), along)
        return (faces_light & (stored >= limit - slack)).astype(np.float64)
