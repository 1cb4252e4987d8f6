# SPDX-License-Identifier: GPL-3.0-or-later
"""The sheer surfaces that a view sees before what is opaque, one layer after the other.

Depth peeling: each pass draws the nearest sheer triangle of each pixel that lies behind the one
before, until there is none (C. Everitt, "Interactive Order-Independent Transparency", 2001). Only
sheer triangles are drawn again; where the picture shows none, nothing is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import (
    PassShader,
    Texture,
    framebuffer,
    read_texture,
    texture_2d,
    texture_from_array,
)
from .geometry_buffer import GeometryBuffer
from .pixel_rays import RAY_BLOCK
from .raster_program import build_sheer_program

# Layers that are told apart along a ray; what lies between them and the opaque is left out.
MOST_LAYERS = 32

_PASS = PassShader(
    name="sheer_triangle",
    fragment="sheer_triangle",
    library=("view_depth",),
    blocks=(RAY_BLOCK,),
    samplers=(("opaque_depth", "DEPTH_2D"), ("last_depth", "DEPTH_2D")),
    outputs=(("VEC2", "visible_triangle"), ("VEC4", "let_through")),
    writes_depth=True,
)
_EXACT_PASS = replace(
    _PASS,
    name="sheer_triangle_exact",
    library=("pixel_ray", "view_depth"),
    defines=(("EXACT_DEPTH", "1"),),
)
_THROUGH = PassShader(
    name="seen_through",
    fragment="seen_through",
    samplers=(("let_through", "FLOAT_2D"), ("through_before", "FLOAT_2D")),
    outputs=(("VEC4", "through"),),
)


@dataclass(frozen=True)
class SheerLayer:
    """One layer of a picture.

    Attributes:
        triangles: RG32F, as `VisibleSurface.triangles`.
        depth: DEPTH_COMPONENT32F, as the opaque surfaces' is.
        through: RGBA32F, the share of its light that reaches the viewer, or None for all.
    """

    triangles: Texture
    depth: Texture
    through: Texture | None


class SheerLayersPass:
    """Peels them off."""

    def __init__(self, geometry: GeometryBuffer) -> None:
        self._geometry = geometry
        self._all: Texture | None = None

    def peel(
        self,
        clip_from_local: NDArray[np.float64],
        rays: Mapping[str, Any],
        opaque_depth: Texture,
        poses: Mapping[str, Texture],
        *,
        exact: bool,
    ) -> tuple[list[SheerLayer], Texture | None]:
        """The layers before what is opaque, nearest first, and what reaches the viewer from there:
        RGBA32F, or None for all.

        Args:
            clip_from_local: as of the opaque surfaces' picture.
            rays: of its pixels, `pixel_rays`.
            opaque_depth: its depth.
            poses: where objects are then, for the vertex stage; none where they are at rest.
            exact: whether depth is taken from the triangles' planes.
        """
        size = (opaque_depth.width, opaque_depth.height)
        program = build_sheer_program(
            _EXACT_PASS if exact else _PASS, reads_planes=exact, has_poses=bool(poses)
        )
        layers: list[SheerLayer] = []
        through: Texture | None = None
        last = texture_2d(*size, "DEPTH_COMPONENT32F")
        last.clear(format="FLOAT", value=(0.0,))
        for _ in range(MOST_LAYERS):
            triangles, let_through = texture_2d(*size, "RG32F"), texture_2d(*size)
            depth = texture_2d(*size, "DEPTH_COMPONENT32F")
            target = framebuffer([triangles, let_through], depth)
            textures = {"opaque_depth": opaque_depth, "last_depth": last, **poses}
            with target.bind():
                target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
                self._geometry.draw(
                    program, clip_from_local, "camera", textures, {"ray": rays}, only_sheer=True
                )
            if not read_texture(triangles).any():
                break
            layers.append(SheerLayer(triangles, depth, through))
            through, last = self._behind(let_through, through), depth
        return layers, through

    def _behind(self, let_through: Texture, before: Texture | None) -> Texture:
        if before is None:
            if self._all is None:
                self._all = texture_from_array(np.ones((1, 1, 4), np.float32), "RGBA32F")
            before = self._all
        through = texture_2d(let_through.width, let_through.height)
        _THROUGH.build().draw_fullscreen(
            framebuffer([through]), {"let_through": let_through, "through_before": before}, {}
        )
        return through
