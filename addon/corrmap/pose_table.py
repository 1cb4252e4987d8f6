# SPDX-License-Identifier: GPL-3.0-or-later
"""Where objects are at one time, for the passes that draw them there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Samplers, Texture, texture_from_array

POSE_SAMPLERS: Samplers = (("pose_table", "FLOAT_2D"),)

# Texels in a row of the table and for an object; also in `pose_table.glsl`.
_WIDTH = 4096
_TEXELS = 8


def upload_poses(moved: NDArray[np.float64], origin: NDArray[np.float64]) -> Texture:
    """RGBA32F: rows of each object's transform and of its inverse, in local space.

    Args:
        moved: (O, 4, 4), world space, from where the geometry has an object's points to where
            they are.
        origin: (3,), world space, where local space has its origin.
    """
    local = moved.copy()
    # By differences: far from the world's origin both terms are large.
    local[:, :3, 3] += moved[:, :3, :3] @ origin - origin
    texels = np.zeros((len(moved), _TEXELS, 4))
    texels[:, 0:3] = local[:, :3]
    texels[:, 3:6] = np.linalg.inv(local)[:, :3]
    rows = -(-len(moved) * _TEXELS // _WIDTH)
    table = np.zeros((rows * _WIDTH, 4), dtype=np.float32)
    table[: len(moved) * _TEXELS] = texels.reshape(-1, 4)
    return texture_from_array(table.reshape(rows, _WIDTH, 4), "RGBA32F")
