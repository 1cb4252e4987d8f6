# SPDX-License-Identifier: GPL-3.0-or-later
"""A caching camera: from where one deep framebuffer is baked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

CameraKind = Literal["CUBE_FACE", "PERSPECTIVE"]


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
        world_from_camera = np.array(data["world_from_camera"], dtype=np.float64)
        if world_from_camera.shape != (4, 4) or not np.isfinite(world_from_camera).all():
            raise ValueError("world_from_camera is not a finite 4x4 matrix")
        if data["kind"] not in ("CUBE_FACE", "PERSPECTIVE"):
            raise ValueError(f"unknown camera kind {data['kind']!r}")
        return cls(
            id=int(data["id"]),
            world_from_camera=world_from_camera,
            fov=float(data["fov"]),
            near=float(data["near"]),
            far=float(data["far"]),
            resolution=int(data["resolution"]),
            kind=data["kind"],
            source=int(data["source"]),
        )
