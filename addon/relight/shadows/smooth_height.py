# SPDX-License-Identifier: GPL-3.0-or-later
"""How far places on triangles lie below the smooth surface that their corners' normals tell of.

Cycles' (shadow_ray_offset), as heights above a point p of the triangle with corners v_i and normals
n_i: each corner's envelope max_j (v_j - p) . n_i, and half of the parabolic surface through them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.geometry import SceneGeometry
from ...scene.octahedral import from_codes
from .vectors import corner_weights, dot

Array = NDArray[np.float64]


def smooth_height(
    geometry: SceneGeometry, triangle: NDArray[np.integer], place: Array, up: Array
) -> tuple[Array, Array]:
    """(R,), (3, R) how many times their interpolated normal, which is not a unit vector, places on
    triangles lie below the smooth surface, on the side of `up`.

    Args:
        geometry: the triangles.
        triangle: (R,) which of them.
        place: (3, R) on these.
        up: (3, R) their normals on the side that is asked.
    """
    assert geometry.corner_normals is not None
    corner = geometry.triangles.take(triangle, axis=0).T.ravel()
    corners = geometry.vertices.take(corner, axis=0).reshape(3, -1, 3)
    away = [np.subtract(each.T, place, order="C") for each in corners]
    codes = from_codes(geometry.corner_normals.take(triangle, axis=0))
    normals = [codes[:, i].T.astype(np.float64, order="C") for i in range(3)]
    b, c = away[1] - away[0], away[2] - away[0]
    weights = corner_weights(away[0], b, c)
    normal = weights[0] * normals[0] + weights[1] * normals[1] + weights[2] * normals[2]
    side = np.where(dot(normal, up) > 0.0, 1.0, -1.0)
    along = [[side * dot(n, v) for v in away] for n in normals]
    highest = [np.maximum(np.maximum(x, y), z) for x, y, z in along]
    envelope = np.minimum(np.minimum(highest[0], highest[1]), highest[2])
    (n00, n01, n02), (n10, n11, n12), (n20, n21, n22) = along
    # Of the differences of normals and corners.
    of_u, of_v, of_both = n20 - n22 - n00 + n02, n21 - n22 - n11 + n12, n11 - n10 - n01 + n00
    u, v, _ = weights
    parabola = of_u * u * (u - 1.0) + (of_u + of_v + of_both) * u * v + of_v * v * (v - 1.0)
    return np.maximum(np.maximum(envelope, 0.0), 0.5 * parabola), side * normal
