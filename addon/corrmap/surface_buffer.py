# SPDX-License-Identifier: GPL-3.0-or-later
"""The view's surfaces, read through the correspondence map: what the light passes shade.

Everything on the GPU is in *local* space: the world's axes, metres, with the origin at
`origin`. Lights and cameras are taken there in float64 before they become float32.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture
from .normal_bend import NormalBend
from .seen_triangles import SeenTriangles
from .surface_layout import OBJECT_SAMPLER, SurfaceLayout


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
            > 0 the correspondence score, -1 a small hole filled from its neighbours on the same
            surface, -2 from those of the same material beside it, 0 a larger one that got its
            material's mean values.
        values: the channels that vary, as `layout` has them.
        material_table: the channels that are constant over a material, and the means of others.
        layout: what lies where.
        objects: R32F, 1 + index into `SceneGeometry.object_names`, 0 where nothing is hit; None
            where nobody asked for it.
        picture_height: how many of the rows are a picture, with neighbours side by side; None for
            all.
        triangles: which triangles are seen; None where that is not known.
        bend: by how much the mesh's normals turn there; None where all faces are flat, or none has
            highlights.
        through: RGBA32F, the share of its light that sheer layers before it let through; None for
            all.
        before: these layers, nearest first.
        is_layer: whether it is one of them.
        shading_normal: xyz unit, as the mesh interpolates it, on the facet's side that faces the
            viewer; None where nobody needed it.
        around: (PLACES, 2) float64, pixels, x to the right and y up: from the sample's place in
            each pixel to others, which fill the pixel as the filter weighs it; None for no others.
    """

    width: int
    height: int
    origin: NDArray[np.float64]
    eye: NDArray[np.float64]
    perspective: bool
    position: Texture
    geometric_normal: Texture
    values: tuple[Texture, ...]
    material_table: Texture
    layout: SurfaceLayout
    objects: Texture | None = None
    picture_height: int | None = None
    triangles: SeenTriangles | None = None
    bend: NormalBend | None = None
    shading_normal: Texture | None = None
    around: NDArray[np.float64] | None = None
    through: Texture | None = None
    before: tuple[SurfaceBuffer, ...] = ()
    is_layer: bool = False

    def textures(self) -> dict[str, Texture]:
        """The textures by the names in `SurfaceLayout.samplers`."""
        objects = {} if self.objects is None else {OBJECT_SAMPLER[0]: self.objects}
        return {
            "surface_position": self.position,
            "surface_geometric_normal": self.geometric_normal,
            "material_table": self.material_table,
            **dict(zip(self.layout.value_names, self.values, strict=True)),
            **(objects if self.layout.edits_objects else {}),
        }
