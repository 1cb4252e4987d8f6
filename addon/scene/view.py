# SPDX-License-Identifier: GPL-3.0-or-later
"""The view that is being lit: a camera, its picture size and its pixel filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .lens import Lens
from .same import is_same

FilterKind = Literal["BOX", "GAUSSIAN", "BLACKMAN_HARRIS"]


@dataclass(frozen=True)
class PixelFilter:
    """Cycles' pixel filter: its kind, and its width in pixels as Blender's settings give it."""

    kind: FilterKind = "BLACKMAN_HARRIS"
    width: float = 1.5


@dataclass(frozen=True)
class View:
    """A camera with a picture size.

    Attributes:
        world_from_camera: (4, 4) float64, rigid; the camera looks down its -Z.
        clip_from_camera: (4, 4) float64, OpenGL clip space (z from -w to w); lens shift,
            sensor fit and pixel aspect are in it.
        width, height: pixels; pixel (0, 0) is bottom left.
        perspective: False for an orthographic camera.
        pixel_filter: how samples make a pixel.
        name: the camera object's name, or "" for a viewport.
        lens: the opening that blurs what is out of focus; None for a pinhole.
    """

    world_from_camera: NDArray[np.float64]
    clip_from_camera: NDArray[np.float64]
    width: int
    height: int
    perspective: bool = True
    pixel_filter: PixelFilter = PixelFilter()
    name: str = ""
    lens: Lens | None = None

    @cached_property
    def origin(self) -> NDArray[np.float64]:
        """(3,) float64, the camera's place in world space, metres."""
        return self.world_from_camera[:3, 3]

    @cached_property
    def camera_from_world(self) -> NDArray[np.float64]:
        """(4, 4) float64; the inverse of a rigid transform, taken without a solve."""
        rotation = self.world_from_camera[:3, :3].T
        inverse = np.eye(4)
        inverse[:3, :3] = rotation
        inverse[:3, 3] = -rotation @ self.origin
        return inverse

    def region(self, left: int, bottom: int, right: int, top: int) -> View:
        """The same camera with only some of its pixels: columns from `left` to before `right`,
        rows from `bottom` to before `top`."""
        width, height = right - left, top - bottom
        picture = np.eye(4)
        picture[0, 0], picture[1, 1] = self.width / width, self.height / height
        picture[0, 3] = (self.width - left - right) / width
        picture[1, 3] = (self.height - bottom - top) / height
        matrix = picture @ self.clip_from_camera
        return replace(self, clip_from_camera=matrix, width=width, height=height)

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points (..., 3) to (..., 4): x and y in pixels, clip z / w, clip w.

        Positions are made relative to the camera before the rotation, so that a scene far
        from the world's origin keeps its precision.
        """
        camera = (points - self.origin) @ self.world_from_camera[:3, :3]
        clip = camera @ self.clip_from_camera[:, :3].T + self.clip_from_camera[:, 3]
        w = clip[..., 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            ndc = clip[..., :3] / w[..., None]
        x = (ndc[..., 0] * 0.5 + 0.5) * self.width
        y = (ndc[..., 1] * 0.5 + 0.5) * self.height
        return np.stack([x, y, ndc[..., 2], w], axis=-1)

    def rays(self, xy: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixel positions (..., 2) to world-space rays: origins and unit directions (..., 3).

        Perspective rays begin at the camera, orthographic ones on the near plane.
        """
        ndc = xy / np.array([self.width, self.height]) * 2.0 - 1.0
        x, y, z, w = self.clip_from_camera
        # A column and a row of the picture are planes in camera space, and a ray is where they
        # meet. The clip distances are not needed: in float32 a far plane 1e8 times as far as the
        # near one is at infinity.
        column = ndc[..., :1] * w[:3] - x[:3]
        row = ndc[..., 1:] * w[:3] - y[:3]
        direction = np.cross(row, column)
        direction *= -np.sign(direction[..., 2:])  # a camera looks down its -Z
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        direction = direction @ self.world_from_camera[:3, :3].T
        if self.perspective:
            return np.broadcast_to(self.origin, direction.shape).copy(), direction
        near = np.concatenate([ndc, np.full((*ndc.shape[:-1], 1), -1.0)], axis=-1)
        camera_from_clip = np.linalg.inv(np.stack([x, y, z])[:, :3])
        camera = (near - np.array([x[3], y[3], z[3]])) @ camera_from_clip.T
        return camera @ self.world_from_camera[:3, :3].T + self.origin, direction


def same_view(a: View, b: View) -> bool:
    """Whether two views show the same, whatever their cameras are called."""
    return is_same(replace(a, name=b.name), b)
