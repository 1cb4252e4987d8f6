# SPDX-License-Identifier: GPL-3.0-or-later
"""The normals that the mesh interpolates for shading, at the very places that are seen.

The paper reads normals from texels, which blur them: of a bevel narrower than a texel nothing is
left. Where a material bends no normals (`ChannelPlan.mesh_normals`), these are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..glsl.shader import (
    MAX_COLOR_SLOTS,
    PassShader,
    ShaderProgram,
    Texture,
    framebuffer,
    source,
    texture_2d,
)
from ..scene.octahedral import GLSL as OCTAHEDRAL_GLSL
from .geometry_buffer import GeometryBuffer
from .seen_triangle import seen_textures, with_seen_triangle
from .surface_layout import SurfaceLayout

if TYPE_CHECKING:
    from .visible_surface import VisibleSurface

_PASS = PassShader(
    name="shading_normal",
    fragment="shading_normal",
    generated=OCTAHEDRAL_GLSL + source("lib/seen_corners.glsl") + source("lib/corner_normal.glsl"),
    samplers=(
        ("visible_position", "FLOAT_2D"),
        ("visible_normal", "FLOAT_2D"),
        ("visible_triangle", "FLOAT_2D"),
    ),
    outputs=(("VEC4", "visible_shading_normal"),),
)


class ShadingNormalPass:
    """Finds the normals of what is seen of one scene, some of which is smooth.

    Args:
        geometry: with corner normals.
    """

    def __init__(self, geometry: GeometryBuffer) -> None:
        self._geometry = geometry

    def draw(self, visible: VisibleSurface) -> Texture:
        """RGBA32F, xyz the unit normals on the viewer's side of the surface; 0 for nothing."""
        if visible.shading_normal is not None:
            return visible.shading_normal
        geometry = self._geometry
        textures = seen_textures(geometry, corners=True)
        has_copies = geometry.copies is not None
        normals = texture_2d(visible.position.width, visible.position.height)
        description = with_seen_triangle(_PASS, has_copies, corners=True)
        description.build().draw_fullscreen(
            framebuffer([normals]),
            {
                "visible_position": visible.position,
                "visible_normal": visible.normal,
                "visible_triangle": visible.triangles,
                **textures,
            },
            {},
        )
        return normals


class MeshNormalPass:
    """Puts normals that the mesh gives into surfaces' values that were found elsewhere.

    Args:
        layout: of the surfaces.
        material_table: their table.
    """

    def __init__(self, layout: SurfaceLayout, material_table: Texture) -> None:
        self._layout = layout
        self._table = material_table

    def draw(
        self, position: Texture, normal: Texture, values: Sequence[Texture]
    ) -> tuple[Texture, ...]:
        """The values, of which those that hold such normals are made anew.

        Args:
            position: of the surfaces, with their materials.
            normal: RGBA32F, xyz the mesh's normals there.
            values: the textures of `SurfaceBuffer.values`.
        """
        changed = self._layout.textures_with_mesh_normals
        result = list(values)
        for start in range(0, len(changed), MAX_COLOR_SLOTS):
            some = changed[start : start + MAX_COLOR_SLOTS]
            targets = [texture_2d(position.width, position.height) for _ in some]
            given = {f"mean_{self._layout.value_names[i]}": values[i] for i in some}
            self._program(some).draw_fullscreen(
                framebuffer(targets),
                {
                    "surface_position": position,
                    "surface_shading_normal": normal,
                    "material_table": self._table,
                    **given,
                },
                {},
            )
            for index, target in zip(some, targets, strict=True):
                result[index] = target
        return tuple(result)

    def _program(self, textures: Sequence[int]) -> ShaderProgram:
        names = [self._layout.value_names[i] for i in textures]
        return PassShader(
            name="mesh_normals",
            fragment="mesh_normals",
            library=("material_table",),
            generated=self._layout.mesh_normals_glsl(textures),
            samplers=(
                ("surface_position", "FLOAT_2D"),
                ("surface_shading_normal", "FLOAT_2D"),
                ("material_table", "FLOAT_2D"),
                *((f"mean_{name}", "FLOAT_2D") for name in names),
            ),
            outputs=tuple(("VEC4", name) for name in names),
        ).build()
