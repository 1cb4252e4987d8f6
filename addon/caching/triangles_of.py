# SPDX-License-Identifier: GPL-3.0-or-later
"""Some of a scene's triangles, as a scene of their own for rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry


def triangles_of(geometry: SceneGeometry, chosen: NDArray[np.int64]) -> SceneGeometry:
    """The triangles `chosen` (N,) in their order, solid all over; vertices are shared."""
    return replace(
        geometry,
        triangles=geometry.triangles[chosen],
        object_id=geometry.object_id[chosen],
        material_id=geometry.material_id[chosen],
        weight=geometry.weight[chosen],
        camera_visible=geometry.camera_visible[chosen],
        shadow_visible=np.ascontiguousarray(geometry.shadow_visible[chosen]),
        uv=None,
        cutouts=(),
        sheers=(),
        copies=(),
    )
