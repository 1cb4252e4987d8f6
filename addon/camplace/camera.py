# SPDX-License-Identifier: GPL-3.0-or-later
"""A caching camera: from where one deep framebuffer is baked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

CameraKind = Literal["CUBE_FACE", "PERSPECTIVE"]

# Wider pictures are under-sampled in the middle (paper: 120 degrees).
WIDEST = np.radians(120.0)

# How far from a rotation a matrix that is read may be: one of few digits is good enough.
_RIGID = 1e-4
# An angle may have gone through degrees and back: a few roundings of float64.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class CachingCamera:
    """One square pinhole picture of the scene (paper III.1.C).

    Attributes:
        id: its number in the cache; unique, and the name of its file.
        world_from_camera: (4, 4) float64, rigid, metres; it looks down its -Z.
        fov: full angle of view in radians, the same along both axes.
        near, far: clip distances along the view axis, metres.
        resolution: texels along each side.
        kind: a face of a primary (cube) camera, or a secondary (perspective) camera.
        source: which maximal sphere or ray vote made it, counted from 0 within its kind.
    """

    id: int
    world_from_camera: NDArray[np.float64]
    fov: float
    near: float
    far: float
    resolution: int
    kind: CameraKind
    source: int

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,) float64, world space, metres."""
        return self.world_from_camera[:3, 3]

    @property
    def half_extent(self) -> float:
        """tan(fov / 2): half the picture's side at distance 1."""
        return float(np.tan(0.5 * self.fov))

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points (..., 3) to (..., 3): u, v in [0, 1] inside the picture, and the
        distance along the view axis in metres (negative behind the camera)."""
        camera = (points - self.origin) @ self.world_from_camera[:3, :3]
        depth = -camera[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            uv = camera[..., :2] / (depth * self.half_extent)[..., None] * 0.5 + 0.5
        return np.concatenate([uv, depth[..., None]], axis=-1)

    def unproject(self, uv_depth: NDArray[np.float64]) -> NDArray[np.float64]:
        """The inverse of `project`: (..., 3) u, v, depth to world points (..., 3)."""
        depth = uv_depth[..., 2:]
        xy = (uv_depth[..., :2] * 2.0 - 1.0) * self.half_extent * depth
        camera = np.concatenate([xy, -depth], axis=-1)
        return camera @ self.world_from_camera[:3, :3].T + self.origin

    def to_json(self) -> dict[str, Any]:
        """Plain values; floats keep every bit (JSON writes the shortest exact decimal)."""
        return {
            "id": self.id,
            "kind": self.kind,
            "source": self.source,
            "world_from_camera": self.world_from_camera.tolist(),
            "fov": self.fov,
            "near": self.near,
            "far": self.far,
            "resolution": self.resolution,
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> CachingCamera:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        if data["kind"] not in ("CUBE_FACE", "PERSPECTIVE"):
            raise ValueError(f"unknown camera kind {data['kind']!r}")
        number = _whole(data, "id", 0)
        near, far, fov = (_finite(data, key) for key in ("near", "far", "fov"))
        if not 0.0 <= near < far:
            raise ValueError(f"camera {number} has the clips {near:g} and {far:g} m")
        if not 0.0 < fov <= WIDEST * (1.0 + _ROUNDING):
            raise ValueError(
                f"camera {number} has a fov of {fov:g} rad, not above 0 and up to {WIDEST:.4f}"
            )
        return cls(
            id=number,
            world_from_camera=_rigid(data["world_from_camera"]),
            fov=fov,
            near=near,
            far=far,
            resolution=_whole(data, "resolution", 1),
            kind=data["kind"],
            source=_whole(data, "source", 0),
        )


def _whole(data: dict[str, Any], key: str, least: int) -> int:
    value = data[key]
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"a camera's {key} is {value!r}, not a whole number of at least {least}")
    return int(value)


def _finite(data: dict[str, Any], key: str) -> float:
    value = data[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"a camera's {key} is {value!r}, not a number")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        number = np.inf
    if not np.isfinite(number):
        raise ValueError(f"a camera's {key} is not finite")
    return number


def _rigid(rows: Any) -> NDArray[np.float64]:
    try:
        matrix = np.array(rows, dtype=np.float64)
    except OverflowError as error:  # a whole number of hundreds of digits
        raise ValueError("world_from_camera is not a finite 4x4 matrix") from error
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise ValueError("world_from_camera is not a finite 4x4 matrix")
    rotation = matrix[:3, :3]
    if (
        np.abs(rotation).max() > 1.0 + _RIGID  # first, since squares of more may overflow
        or np.abs(rotation.T @ rotation - np.eye(3)).max() > _RIGID
        or np.linalg.det(rotation) < 0.0
        or not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0])
    ):
        raise ValueError("world_from_camera is not a rotation and a place")
    return matrix
