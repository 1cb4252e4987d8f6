# SPDX-License-Identifier: GPL-3.0-or-later
"""The local frame in which cameras are placed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from ..scene.view import View
from .camera import CachingCamera


@dataclass(frozen=True)
class LocalFrame:
    """local = (world - origin) / unit: near zero and about one in size.

    Embree's float32 then has its full precision where the views look, wherever the scene is
    and in whatever units it was modelled, and no later step knows the scene's size.

    Attributes:
        origin: (3,) float64, world space, metres.
        unit: metres in one local unit; a power of two, so that scaling keeps every bit.
    """

    origin: NDArray[np.float64]
    unit: float

    @classmethod
    def of(
        cls,
        geometry: SceneGeometry,
        views: tuple[View, ...],
        bounds: NDArray[np.float64] | None,
    ) -> LocalFrame:
        """At the box of interest if there is one, else at the views, else at the scene."""
        used = geometry.bounds if bounds is None else np.asarray(bounds, dtype=np.float64)
        origin = used.mean(axis=0)
        if bounds is None and views:
            origin = np.mean([view.origin for view in views], axis=0)
        size = float(np.max(used[1] - used[0]))
        return cls(origin, 2.0 ** float(np.ceil(np.log2(size))))

    def from_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (..., 3) in metres to local ones."""
        return (points - self.origin) / self.unit

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Local points (..., 3) to metres."""
        return points * self.unit + self.origin

    def geometry_from_world(self, geometry: SceneGeometry) -> SceneGeometry:
        return replace(geometry, vertices=self.from_world(geometry.vertices), copies=())

    def view_from_world(self, view: View) -> View:
        """The same picture of the local scene."""
        world_from_camera = view.world_from_camera.astype(np.float64)
        world_from_camera[:3, 3] = self.from_world(view.origin)
        camera_scale = np.diag([self.unit, self.unit, self.unit, 1.0])
        return replace(
            view,
            world_from_camera=world_from_camera,
            clip_from_camera=view.clip_from_camera @ camera_scale,
        )

    def camera_from_world(self, camera: CachingCamera) -> CachingCamera:
        """The same picture of the local scene."""
        return _moved(camera, self.from_world(camera.origin), 1.0 / self.unit)

    def camera_to_world(self, camera: CachingCamera) -> CachingCamera:
        """The inverse of `camera_from_world`."""
        return _moved(camera, self.to_world(camera.origin), self.unit)


def _moved(camera: CachingCamera, origin: NDArray[np.float64], scale: float) -> CachingCamera:
    """The camera at another place (3,), in a world that is larger by a power of two."""
    world_from_camera = camera.world_from_camera.copy()
    world_from_camera[:3, 3] = origin
    return replace(
        camera,
        world_from_camera=world_from_camera,
        near=camera.near * scale,
        far=camera.far * scale,
    )
