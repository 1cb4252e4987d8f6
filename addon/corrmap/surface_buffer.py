# SPDX-License-Identifier: GPL-3.0-or-later
"""The view's surfaces, read through the correspondence map: what the light passes shade.

Everything on the GPU is in *local* space: the world's axes, metres, with the origin at
`origin`. Lights and cameras are taken there in float64 before they become float32.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Samplers, Texture

# Sampler declarations of a pass that reads the surfaces, and the library that unpacks them.
SURFACE_SAMPLERS: Samplers = (
    ("surface_position", "FLOAT_2D"),
    ("surface_geometric_normal", "FLOAT_2D"),
    ("surface_shading", "FLOAT_2D"),
    ("surface_diffuse", "FLOAT_2D"),
    ("surface_specular_f0", "FLOAT_2D"),
    ("surface_specular_f90", "FLOAT_2D"),
    ("surface_emission", "FLOAT_2D"),
)


@dataclass(frozen=True)
class SurfaceBuffer:
    """Textures of one sample of the view, each width x height, RGBA32F.

    Attributes:
        width, height: pixels.
        origin: (3,) float64, world space, metres: where local space has its origin.
        eye: (3,) float64, local space: the view camera's place. For an orthographic view,
            (3,) unit vector from the surface toward the camera; see `perspective`.
        perspective: whether `eye` is a place (True) or a direction (False).
        position: xyz local position, w = 1 + material id; w = 0 where nothing is hit.
        geometric_normal: xyz unit, facing the viewer; w tells where the values come from:
            > 0 the correspondence score, -1 a small hole filled from its neighbours, 0 a
            larger one that got its material's mean values.
        shading: xyz unit shading normal, w roughness.
        diffuse: rgb diffuse_color, w layer_f0.
        specular_f0: rgb specular_f0, w layer_f90.
        specular_f90: rgb specular_f90, w ambient_occlusion.
        emission: rgb emission, w = 0.
    """

    width: int
    height: int
    origin: NDArray[np.float64]
    eye: NDArray[np.float64]
    perspective: bool
    position: Texture
    geometric_normal: Texture
    shading: Texture
    diffuse: Texture
    specular_f0: Texture
    specular_f90: Texture
    emission: Texture

    def textures(self) -> dict[str, Texture]:
        """The textures by the names in SURFACE_SAMPLERS."""
        return {name: getattr(self, name.removeprefix("surface_")) for name, _ in SURFACE_SAMPLERS}
