# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the instances of repeated meshes are, for the passes that draw and read them there.

A mesh's corners are float32 in its own space, as Blender has them. From there to local space they
go by way of local space's origin as the mesh sees it, in two float32 numbers for each coordinate:
a difference of floats is rounded relative to itself, so that what lies near the viewer is as exact
as if it had been made relative to the viewer in float64, however far away or large the mesh is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_DEFINES, ROW_LIBRARY, row_texture
from ..glsl.shader import Samplers, Texture

INSTANCE_SAMPLERS: Samplers = (("instance_table", "FLOAT_2D"),)
# For passes that are compiled with the table.
INSTANCE_LIBRARY = (*ROW_LIBRARY, "instance_table")
INSTANCE_DEFINES = (*ROW_DEFINES, ("HAS_INSTANCES", "1"))

# Texels for an instance; also in `instance_table.glsl`.
_TEXELS = 8


def instance_texels(
    world_from_mesh: NDArray[np.float64],
    object_id: NDArray[np.int32],
    origin: NDArray[np.float64],
) -> NDArray[np.float32]:
    """(I, 8, 4): rows of the turn and stretch from mesh to local space; rows of its inverse; local
    space's origin in mesh space with 1 + object id. Beside the rows stands what rounding left of
    that origin.

    Args:
        world_from_mesh: (I, 4, 4).
        object_id: (I,).
        origin: (3,), world space, where local space has its origin.
    """
    texels = np.zeros((len(world_from_mesh), _TEXELS, 4))
    inverse = np.linalg.inv(world_from_mesh[:, :3, :3])
    texels[:, 0:3, :3] = world_from_mesh[:, :3, :3]
    texels[:, 3:6, :3] = inverse
    seen = np.einsum("nij,nj->ni", inverse, origin - world_from_mesh[:, :3, 3])
    texels[:, 6, :3] = seen.astype(np.float32)
    texels[:, 6, 3] = object_id + 1.0
    texels[:, 0:3, 3] = texels[:, 3:6, 3] = seen - texels[:, 6, :3]
    return texels.astype(np.float32)


def upload_instances(texels: NDArray[np.float32]) -> Texture:
    """RGBA32F of `instance_texels`."""
    return row_texture(texels.reshape(-1, 4), "RGBA32F", "instances")


def upload_numbers(numbers: NDArray[np.int64]) -> Texture:
    """R32F of (N,) numbers below 2^24."""
    return row_texture(numbers[:, None], "R32F", "instances that are drawn")
