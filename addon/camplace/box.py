# SPDX-License-Identifier: GPL-3.0-or-later
"""The box of interest: where cameras may stand and where surface is sampled by area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.view import View

# What a view sees farther off than this many times the median distance is background. A camera
# near the view sees a background as the view does, whatever lies between them, so the box need
# not reach it; a room is never that deep.
BACKGROUND = 4.0
# Share of the box's diagonal by which it is enlarged: surfaces then lie inside, not on it.
ENLARGED = 0.02
# Without a view that sees anything, the box's sides are at least this share of the longest one.
LEAST_SIDE = 0.5


def box_about(
    views: tuple[View, ...], seen: tuple[NDArray[np.float64], ...], bounds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(2, 3) lowest and highest corner.

    The paper has the user give the box. By default it holds the views' places and what they
    see, without the background, or all of `bounds` (2, 3) when they see nothing.

    Args:
        views: the shot's views.
        seen: for each view the points (N, 3) that it sees.
        bounds: of the whole scene.
    """
    inside = [bounds]
    if any(len(points) for points in seen):
        inside = []
        for view, points in zip(views, seen, strict=True):
            distance = np.linalg.norm(points - view.origin, axis=-1)
            if len(points):
                inside.append(points[distance <= BACKGROUND * np.median(distance)])
            inside.append(_places(view, points))
    points = np.concatenate(inside)
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    if not any(len(points) for points in seen):
        # Cameras stand in the box, and must see a single plane from somewhere.
        lacking = np.maximum(0.0, LEAST_SIDE * (box[1] - box[0]).max() - (box[1] - box[0]))
        box = box + 0.5 * np.array([[-1.0], [1.0]]) * lacking
    margin = ENLARGED * np.linalg.norm(box[1] - box[0])
    return np.asarray(box + np.array([[-margin], [margin]]))


def _places(view: View, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) the place of a perspective view; for an orthographic one, which could be moved
    along its axis without a change, as far before what it sees as its picture is large."""
    if view.perspective:
        return view.origin[None]
    axis = view.world_from_camera[:3, 2]
    # The picture's half height is one unit of clip space.
    height = 2.0 / float(np.linalg.norm(view.clip_from_camera[1, :3]))
    depth = (view.origin - points) @ axis
    return np.asarray(points + np.minimum(depth, height)[:, None] * axis)


def inside_box(points: NDArray[np.float64], box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie in the box (2, 3)."""
    return np.asarray(((points >= box[0]) & (points <= box[1])).all(axis=-1))
