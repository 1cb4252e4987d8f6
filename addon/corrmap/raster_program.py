# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders of passes that rasterize the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..glsl.row_texture import ROW_DEFINES, ROW_LIBRARY
from ..glsl.shader import PassShader, Samplers, ShaderProgram, Varying
from ..glsl.uniforms import Field, UniformBlock
from .instance_table import INSTANCE_DEFINES, INSTANCE_LIBRARY, INSTANCE_SAMPLERS
from .mesh_store import MESH_SAMPLERS
from .pose_table import POSE_DEFINES, POSE_LIBRARY, POSE_SAMPLERS
from .triangle_table import TABLE_SAMPLERS

# The block that every rasterizing pass has.
RASTER_BLOCK = UniformBlock(
    "raster", (Field("mat4", "clip_from_local"), Field("int", "first_triangle"))
)
_COPIES_BLOCK = UniformBlock("raster", (*RASTER_BLOCK.fields, Field("int", "first_drawn")))

# The instances that a call draws, one after the other.
DRAWN_SAMPLERS: Samplers = (("drawn_instances", "FLOAT_2D"),)

_CUTOUT_BLOCK = UniformBlock("cutout", (Field("int", "extension"),))
_SHEER_BLOCK = UniformBlock("sheer", (Field("vec4", "outside"), Field("int", "extension")))


# Of triangles that are there once, and of instances.
_PLANE_LIBRARY = (
    ("triangle_code", "seen_plane"),
    (*INSTANCE_LIBRARY, "triangle_code", "seen_plane"),
)


@dataclass(frozen=True)
class RasterProgram:
    """A rasterizing pass, built for plain triangles and, if the scene has any, for cut-outs, sheer
    surfaces and repeated meshes. One that was not built for sheer ones leaves them out."""

    opaque: ShaderProgram | None
    cutout: ShaderProgram | None
    reads_planes: bool = False
    has_poses: bool = False
    copies: RasterProgram | None = None
    sheer: ShaderProgram | None = None


def build_raster_program(
    description: PassShader,
    with_cutouts: bool,
    *,
    numbers_triangles: bool = False,
    reads_planes: bool = False,
    has_poses: bool = False,
    with_copies: bool = False,
    with_sheer: bool = False,
) -> RasterProgram:
    """Complete a pass's description with the geometry's vertex stage, and compile it.

    The fragment shader finds `local_position` (vec3), and calls `cut_away()` first, which
    discards the fragment where the material's mask says so. If it `numbers_triangles`, it also
    finds `surface_code()`, and if it `reads_planes`, `seen_plane`. One that `has_poses`, and
    `numbers_triangles`, draws objects where a table of poses has them. One built `with_sheer`
    finds `transmission(surface_uv)` in fragments of sheer surfaces.
    """
    copies = None
    if with_copies:
        instanced = replace(
            description,
            name=f"{description.name}_instances",
            defines=(*description.defines, *INSTANCE_DEFINES),
        )
        copies = _built(
            instanced, with_cutouts, numbers_triangles, reads_planes, has_poses, instances=True
        )
    plain = _built(
        description, with_cutouts, numbers_triangles, reads_planes, has_poses, instances=False
    )
    sheer = None
    if with_sheer:
        sheer = _sheer(description, numbers_triangles, reads_planes, has_poses).build()
    return replace(plain, copies=copies, sheer=sheer)


def build_sheer_program(
    description: PassShader, *, reads_planes: bool = False, has_poses: bool = False
) -> RasterProgram:
    """A pass that numbers the triangles of sheer surfaces, and draws no others."""
    sheer = _sheer(description, True, reads_planes, has_poses).build()
    return RasterProgram(None, None, reads_planes, has_poses, sheer=sheer)


def _sheer(
    description: PassShader, numbers_triangles: bool, reads_planes: bool, has_poses: bool
) -> PassShader:
    """The pass for sheer surfaces, of which there are no repeated meshes."""
    plain = _plain(description, numbers_triangles, reads_planes, has_poses, instances=False)
    return replace(
        plain,
        name=f"{plain.name}_sheer",
        vertex_in=(*plain.vertex_in, ("VEC2", "uv")),
        varyings=(*plain.varyings, Varying("smooth", "VEC2", "surface_uv")),
        blocks=(*plain.blocks, _SHEER_BLOCK),
        samplers=(*plain.samplers, ("sheer_transmission", "FLOAT_2D")),
        library=("sheer", *plain.library),
        defines=(*plain.defines, ("HAS_SHEER", "1")),
    )


def _built(
    description: PassShader,
    with_cutouts: bool,
    numbers_triangles: bool,
    reads_planes: bool,
    has_poses: bool,
    *,
    instances: bool,
) -> RasterProgram:
    plain = _plain(description, numbers_triangles, reads_planes, has_poses, instances=instances)
    masked = replace(
        plain,
        name=f"{plain.name}_cutout",
        vertex_in=(*plain.vertex_in, ("VEC2", "uv")),
        varyings=(*plain.varyings, Varying("smooth", "VEC2", "surface_uv")),
        blocks=(*plain.blocks, _CUTOUT_BLOCK),
        samplers=(*plain.samplers, ("cutout_alpha", "FLOAT_2D")),
        defines=(*plain.defines, ("HAS_CUTOUT", "1")),
    )
    return RasterProgram(
        plain.build(), masked.build() if with_cutouts else None, reads_planes, has_poses
    )


def _plain(
    description: PassShader,
    numbers_triangles: bool,
    reads_planes: bool,
    has_poses: bool,
    *,
    instances: bool,
) -> PassShader:
    """The pass for triangles without masks."""
    plain = replace(
        description,
        vertex="geometry_vert",
        vertex_in=(("VEC3", "position"),),
        varyings=(Varying("smooth", "VEC3", "local_position"),),
        blocks=(_COPIES_BLOCK if instances else RASTER_BLOCK, *description.blocks),
        library=("cutout", *description.library),
    )
    if instances:
        plain = replace(
            plain,
            vertex_library=INSTANCE_LIBRARY,
            varyings=(*plain.varyings, Varying("flat", "INT", "surface_instance")),
            samplers=(*INSTANCE_SAMPLERS, *DRAWN_SAMPLERS, *plain.samplers),
        )
    if numbers_triangles:
        plain = replace(
            plain,
            varyings=(*plain.varyings, Varying("flat", "INT", "surface_triangle")),
            library=(*ROW_LIBRARY, "surface_code", *plain.library),
            defines=(*plain.defines, *ROW_DEFINES, ("HAS_TRIANGLES", "1")),
        )
    if reads_planes:
        plain = replace(
            plain,
            library=(*_PLANE_LIBRARY[instances], *plain.library),
            samplers=(TABLE_SAMPLERS[0], *(MESH_SAMPLERS if instances else ()), *plain.samplers),
        )
    if has_poses:
        plain = replace(
            plain,
            name=f"{plain.name}_posed",
            library=(*POSE_LIBRARY, *plain.library, *["seen_ids"] * reads_planes),
            vertex_library=(*POSE_LIBRARY, *plain.vertex_library),
            samplers=(TABLE_SAMPLERS[1], *POSE_SAMPLERS, *plain.samplers),
            defines=(*plain.defines, *POSE_DEFINES),
        )
    return plain
