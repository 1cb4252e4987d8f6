# SPDX-License-Identifier: GPL-3.0-or-later
"""Where objects are at one time, for the passes that draw them there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_DEFINES, ROW_LIBRARY, row_texture
from ..glsl.shader import Samplers, Texture

POSE_SAMPLERS: Samplers = (("pose_table", "FLOAT_2D"),)
# For passes that are compiled with the table.
POSE_LIBRARY = (*ROW_LIBRARY, "pose_table")
POSE_DEFINES = (*ROW_DEFINES, ("HAS_POSES", "1"))

# Texels for an object; also in `pose_table.glsl`.
_TEXELS = 8

# An object that is stretched by less in any direction has no surface: float32, which has seven
# digits, could not tell from where it is seen which of its points that is.
_LEAST_STRETCH = 2.0**-23


def upload_poses(moved: NDArray[np.float64], origin: NDArray[np.float64]) -> Texture:
    """RGBA32F: rows of each object's transform and of its inverse, in local space. Of one without a
    surface all are zero: its corners come together in one point, which covers no pixel.

    Args:
        moved: (O, 4, 4), world space, from where the geometry has an object's points to where
            they are.
        origin: (3,), world space, where local space has its origin.
    """
    local = moved.copy()
    # By differences: far from the world's origin both terms are large.
    local[:, :3, 3] += moved[:, :3, :3] @ origin - origin
    seen = np.linalg.det(local) != 0.0
    inverse = np.linalg.inv(np.where(seen[:, None, None], local, np.eye(4)))
    seen &= (np.abs(inverse[:, :3, :3]) < 1.0 / _LEAST_STRETCH).all(axis=(1, 2))
    texels = np.zeros((len(moved), _TEXELS, 4))
    texels[seen, 0:3] = local[seen, :3]
    texels[seen, 3:6] = inverse[seen, :3]
    return row_texture(texels.reshape(-1, 4), "RGBA32F", "objects that may move")
