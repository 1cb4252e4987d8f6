# SPDX-License-Identifier: GPL-3.0-or-later
"""The rays of a view's pixels as a shader makes them: linear in the pixel's place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.uniforms import Field, UniformBlock
from ..scene.view import View

RAY_BLOCK = UniformBlock(
    "ray",
    tuple(
        Field("vec4", name)
        for name in (
            "origin", "origin_x", "origin_y", "direction", "direction_x", "direction_y",
            "axis", "clip",
        )
    ),
)  # fmt: skip

# How far a sheet may be turned away from a parallel projection before its depth is interpolated:
# there the corners' rounding to 1/256 of a pixel moves a depth by four pixels' width.
_LEAST_FACING = 1e-3

# A far clip that the matrix does not tell from infinity is taken for this many near clips.
_FARTHEST = 2.0**60


def pixel_rays(
    view: View,
    origin: NDArray[np.float64],
    bounds: NDArray[np.float64],
    offset: tuple[float, float] = (0.0, 0.0),
) -> dict[str, Any]:
    """The values of `RAY_BLOCK`. Depths count from the camera's place.

    Args:
        view: whose.
        origin: (3,) world space, where local space has its origin.
        bounds: (2, 3) world space, of what there is to see.
        offset: where samples lie, in pixels from the pixels' centres.
    """
    # A pixel's centre lies at half-integers, which is where gl_FragCoord has it.
    size = np.array([view.width, view.height], dtype=np.float64)
    corners = np.array([[0.0, 0.0], [size[0], 0.0], [0.0, size[1]]]) + offset
    place, direction = view.rays(corners)
    axis = -view.world_from_camera[:3, 2]
    direction /= (direction @ axis)[:, None]
    near, far = clip_range(view)
    if view.perspective:
        # To the last bit the same for all pixels.
        place = np.broadcast_to(view.origin - origin, place.shape)
        # A share of the far distance: as a float it has its precision at any distance.
        clip = [1.0 / far, 0.0, 0.0]
    else:
        place = place + ((view.origin - place) @ axis)[:, None] * direction - origin
        # A viewport may see from a million metres behind to a million before it: what depths
        # there are lie together.
        middle, half = 0.5 * bounds.sum(axis=0), 0.5 * (bounds[1] - bounds[0])
        depth, reach = (middle - view.origin) @ axis, half @ np.abs(axis)
        # Flat scenes are given some depth, and rounding its place.
        reach += 1e-6 * (np.abs(depth) + half.max())
        first = max(near, depth - reach)
        last = min(far, depth + reach)
        # Of a single place in the camera's own plane any span will do.
        span = float(last - first if first < last else reach) or 1.0
        clip = [1.0 / span, -first / span, 1.0]
    values: dict[str, Any] = {"clip": [*clip, -float(axis @ place[0])]}
    for name, (first, right, up) in (("origin", place), ("direction", direction)):
        values[name] = np.append(first, 0.0)
        values[f"{name}_x"] = np.append((right - first) / size[0], 0.0)
        values[f"{name}_y"] = np.append((up - first) / size[1], 0.0)
    values["axis"] = np.append(axis, 0.0 if view.perspective else _LEAST_FACING)
    return values


def clip_range(view: View) -> tuple[float, float]:
    """Metres from the camera to its near and far planes, as far as the matrix tells them."""
    z = view.clip_from_camera[2]
    if not view.perspective:
        return float((1.0 + z[3]) / z[2]), float((z[3] - 1.0) / z[2])
    near = float(z[3] / (z[2] - 1.0))
    with np.errstate(divide="ignore"):
        far = float(np.divide(z[3], z[2] + 1.0))
    return near, far if near < far < near * _FARTHEST else near * _FARTHEST
