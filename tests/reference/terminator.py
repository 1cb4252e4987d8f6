# SPDX-License-Identifier: GPL-3.0-or-later
"""Where shadow rays start near the terminator, one by one: what Cycles' shadow_ray_offset says."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def lift(
    corners: Array, normals: Array, place: Array, facing: Array, *, toward: Array, cutoff: float
) -> Array:
    """(3,) from a place on a triangle to where its ray starts.

    Args:
        corners: (3, 3).
        normals: (3, 3) unit, of the corners.
        place: (3,) in the triangle.
        facing: (3,) unit: the triangle's normal on the viewer's side.
        toward: (3,) unit, to the light.
        cutoff: the object's Shadow Terminator Geometry Offset.
    """
    # The triangle's plane does not go through the origin, but for luck.
    share = np.linalg.solve(corners.T, place)
    normal = share @ normals
    shading = normal / np.linalg.norm(normal)
    if np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ facing < 0.0:
        shading = -shading
    cosine, of_facet, up = float(shading @ toward), float(facing @ toward), facing
    if cosine < 0.0:
        cosine, of_facet, up = -cosine, -of_facet, -facing
    if cutoff <= 0.0:
        return np.zeros(3)
    if cosine < cutoff:
        amount = min(max(2.0 - (of_facet + cosine) / cutoff, 0.0), 1.0)
    else:
        amount = min(max(1.0 - of_facet / cutoff, 0.0), 1.0)
    u, v, _ = share
    v0, v1, v2 = corners
    n0, n1, n2 = normals
    a, b, c = (n2 - n0) @ (v0 - v2), (n2 - n1) @ (v1 - v2), (n1 - n0) @ (v1 - v0)
    height = a * u * (u - 1.0) + (a + b + c) * u * v + b * v * (v - 1.0)
    if normal @ up > 0.0:
        # The highest of the corners along each corner's normal.
        each = [max(n @ (w - place) for w in corners) for n in normals]
        height = max(min(each), 0.5 * height)
    else:
        each = [max(n @ (place - w) for w in corners) for n in normals]
        height = min(-min(each), 0.5 * height)
    return np.asarray(amount * height * normal)
