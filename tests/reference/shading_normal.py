# SPDX-License-Identifier: GPL-3.0-or-later
"""The normal that a mesh interpolates for shading, in float64: Cycles' triangle_smooth_normal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry
from addon.scene.octahedral import from_codes


def shading_normals(
    geometry: SceneGeometry, triangle: NDArray[np.int64], point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, 3) unit vectors, on the side of the triangles' own normals.

    Args:
        geometry: with corner normals.
        triangle: (N,) which of its triangles.
        point: (N, 3) in the plane of each, world space.
    """
    assert geometry.corner_normals is not None
    corner = geometry.vertices[geometry.triangles[triangle]]  # (N, 3, 3)
    normal = geometry.normal[triangle]
    # The area of the triangle that each corner's opposite edge makes with the point.
    beyond, before = np.roll(corner, -1, axis=1), np.roll(corner, 1, axis=1)
    area = (np.cross(before - beyond, point[:, None] - beyond) * normal[:, None]).sum(-1)
    share = area / area.sum(axis=1, keepdims=True)
    given = from_codes(geometry.corner_normals[triangle]).astype(np.float64)
    smooth = (share[..., None] * given).sum(axis=1)
    return np.asarray(smooth / np.linalg.norm(smooth, axis=1, keepdims=True))
