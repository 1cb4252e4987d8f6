# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves while the shutter is open."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .affine_motion import interpolate_affine
from .view import View


@dataclass(frozen=True)
class Exposure:
    """The camera and the objects at steps of the time that the shutter is open.

    Steps lie evenly from the time that it opens to the time that it closes. Shapes are those of
    the frame: only whole objects move.

    Attributes:
        views: the view at each of S steps; one, if the camera stands still.
        objects: (M,) indices into `SceneGeometry.object_names` of what moves.
        world_from_object: (S, M, 4, 4) float64, world space, metres.
        reference: (M, 4, 4) the same where the geometry has them.
        open_share: (T,) float64, from 0 to 1: how much of the light has come in at even times.
        warnings: one sentence for each thing that moves otherwise.
    """

    views: tuple[View, ...]
    objects: NDArray[np.int64]
    world_from_object: NDArray[np.float64]
    reference: NDArray[np.float64]
    open_share: NDArray[np.float64]
    warnings: tuple[str, ...] = ()

    def time(self, uniform: float) -> float:
        """A time in [0, 1], as often as the shutter is open then, from a number in [0, 1)."""
        times = np.linspace(0.0, 1.0, len(self.open_share))
        return float(np.interp(uniform, self.open_share, times))

    def view(self, time: float) -> View:
        """The camera at a time in [0, 1]."""
        return interpolate_view(self.views, time)

    def moved_from_reference(self, time: float, object_count: int) -> NDArray[np.float64] | None:
        """(object_count, 4, 4) float64: where the geometry's points are at a time, world space;
        None if nothing moves."""
        if not len(self.objects):
            return None
        moved = np.broadcast_to(np.eye(4), (object_count, 4, 4)).copy()
        now = interpolate_affine(self.world_from_object, time)
        moved[self.objects] = now @ np.linalg.inv(self.reference)
        return moved


def interpolate_view(views: tuple[View, ...], time: float) -> View:
    """Between views of the same picture at even times; as Cycles, rays and not angles are mixed."""
    if len(views) == 1:
        return views[0]
    poses = np.stack([view.world_from_camera for view in views])
    world_from_camera = interpolate_affine(poses[:, None], time)[0]
    step = min(int(time * (len(views) - 1)), len(views) - 2)
    share = time * (len(views) - 1) - step
    first, second = views[step].clip_from_camera, views[step + 1].clip_from_camera
    matrix = first
    if not np.array_equal(first, second):
        # Rows x and y: ndc = a s + b, s the ray's slope; s = (ndc - b) / a is what is mixed.
        matrix = first.copy()
        for row in (0, 1):
            a = np.array([first[row, row], second[row, row]])
            b = np.stack([first[row, 2:], second[row, 2:]]) / a[:, None]
            mixed = 1.0 / a[0] * (1.0 - share) + 1.0 / a[1] * share
            matrix[row, row] = 1.0 / mixed
            matrix[row, 2:] = (b[0] * (1.0 - share) + b[1] * share) / mixed
    return replace(views[0], world_from_camera=world_from_camera, clip_from_camera=matrix)
