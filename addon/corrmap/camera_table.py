# SPDX-License-Identifier: GPL-3.0-or-later
"""The caching cameras on the GPU, as a texture: a uniform block would hold only a few hundred."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..glsl.shader import Samplers, Texture, max_texture_width, texture_from_array
from .depth_ranges import range_places
from .tile_layout import BlockNumbers

# What a pass declares that includes caching_camera.glsl.
CAMERA_SAMPLERS: Samplers = (("camera_table", "FLOAT_2D"),)


def camera_rows(
    cameras: Sequence[CachingCamera],
    numbers: BlockNumbers,
    origin: NDArray[np.float64],
    scale_shifts: NDArray[np.int64] | int = 0,
) -> NDArray[np.float32]:
    """(N, 5, 4) float32, a row for each camera in the space whose origin is `origin` (3,): its
    unit axes right (with the row of its depth ranges), up and forward (with their column); its
    place with tan(fov / 2); and its picture: first block, blocks along a side, the shift (N,) of
    its scales' rows, texels along a side.

    Raises:
        InputError: their depth ranges do not fit the GPU.
    """
    world_from_camera = np.stack([camera.world_from_camera for camera in cameras])
    rows = np.zeros((len(cameras), 5, 4))
    rows[:, :3, :3] = np.swapaxes(world_from_camera[:, :3, :3], 1, 2)
    rows[:, 2] *= -1.0
    rows[:, 2, 3], rows[:, 0, 3] = range_places(numbers).T
    rows[:, 3, :3] = world_from_camera[:, :3, 3] - origin
    rows[:, 3, 3] = [camera.half_extent for camera in cameras]
    # Whole numbers, which float32 holds: blocks are fewer than 2^24.
    rows[:, 4, 0], rows[:, 4, 1] = numbers.first, numbers.across
    rows[:, 4, 2] = scale_shifts
    rows[:, 4, 3] = [camera.resolution for camera in cameras]
    return rows.astype(np.float32)


def camera_table(
    cameras: Sequence[CachingCamera],
    numbers: BlockNumbers,
    origin: NDArray[np.float64],
    scale_shifts: NDArray[np.int64] | int = 0,
) -> Texture:
    """RGBA32F, `camera_rows` of the cameras.

    Raises:
        InputError: there are more cameras than the GPU's textures have rows, or their depth ranges
            do not fit it.
    """
    most = max_texture_width()
    if len(cameras) > most:
        raise InputError(
            f"the cache has {len(cameras)} caching cameras, and this GPU can search {most} at "
            "once; place fewer"
        )
    return texture_from_array(camera_rows(cameras, numbers, origin, scale_shifts), "RGBA32F")
