# SPDX-License-Identifier: GPL-3.0-or-later
"""What is shown in place of a relit picture while there is no usable cache."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..corrmap.geometry_buffer import GeometryBuffer
from ..corrmap.visible_surface import VisibleSurfacePass
from ..errors import InputError
from ..glsl.shader import read_texture
from ..scene.geometry_reader import read_geometry
from ..scene.view import View

# Scene-linear grey of a surface that faces the viewer, and of what lies behind the scene.
FACING = 0.35
BACKGROUND = 0.05


def draw_unbaked(depsgraph: Any, view: View) -> NDArray[np.float32]:
    """The scene's shapes in grey, as if lit by a lamp at the camera.

    Needs a GPU context. Returns (H, W, 4) float32, scene-linear, row 0 at the bottom; plain
    grey where the scene has nothing that can be shown.
    """
    pixels = np.full((view.height, view.width, 4), BACKGROUND, dtype=np.float32)
    pixels[..., 3] = 1.0
    try:
        geometry = read_geometry(depsgraph)
    except InputError:
        return pixels
    surface = VisibleSurfacePass(GeometryBuffer(geometry, view.origin)).draw(view)
    normal = read_texture(surface.normal)[..., :3]
    seen = read_texture(surface.position)[..., 3] > 0.0
    centres = np.stack(
        np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5), axis=-1
    )
    _, direction = view.rays(centres)
    facing = np.abs(np.sum(normal * direction, axis=-1))
    pixels[..., :3] = np.where(seen, FACING * facing, BACKGROUND)[..., None]
    return pixels
