# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether surfaces reach into a lamp, where they hide a part of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.closest_point import closest_on_triangle
from ...scene.geometry import SceneGeometry
from ...scene.light import Light


def touches_surface(
    light: Light, geometry: SceneGeometry, objects: NDArray[np.bool_] | None = None
) -> bool:
    """Whether a surface that casts shadows is nearer to a point or spot light than its radius.

    Args:
        light: any light; False for those without such a radius.
        geometry: N triangles; the answer takes one look at each, some milliseconds for 100,000.
        objects: which of `geometry.object_names` cast this light's shadows; None for all.
    """
    if not (light.has_disk and light.use_shadow):
        return False
    centre, radius = light.position, light.shadow_soft_size
    # Vertices first: most triangles lie wholly beyond one side of the ball's box.
    beyond = geometry.vertices - centre
    sides = np.concatenate([beyond > radius, beyond < -radius], axis=1)
    a, b, c = (sides[geometry.triangles[:, corner]] for corner in range(3))
    near = ~(a & b & c).any(axis=1) & geometry.shadow_visible
    if objects is not None:
        near &= objects[geometry.object_id]
    corners = geometry.vertices[geometry.triangles[near]]
    gap = closest_on_triangle(centre, corners) - centre
    return bool(((gap * gap).sum(axis=-1) < radius * radius).any())
