# SPDX-License-Identifier: GPL-3.0-or-later
"""What passes are given that ask about a triangle by its code (`TriangleCodes`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..glsl.shader import PassShader, Samplers, Texture
from .corner_normal_table import CORNER_SAMPLERS
from .instance_table import INSTANCE_DEFINES, INSTANCE_LIBRARY, INSTANCE_SAMPLERS
from .mesh_store import MESH_CORNER_SAMPLERS, MESH_SAMPLERS
from .triangle_table import TABLE_SAMPLERS

if TYPE_CHECKING:
    from .geometry_buffer import GeometryBuffer


def with_seen_triangle(
    description: PassShader,
    has_copies: bool,
    *,
    plane: bool = False,
    ids: bool = False,
    corners: bool = False,
) -> PassShader:
    """The pass with the libraries and samplers of what it asks of triangles.

    Args:
        description: the pass.
        has_copies: whether the geometry has repeated meshes; only then are they compiled.
        plane: for `seen_plane`.
        ids: for `seen_ids`.
        corners: for lib/seen_corners.glsl, which the pass generates after `octahedral_normal`.
    """
    library = INSTANCE_LIBRARY if has_copies else ()
    library = (*library, "triangle_code", *["seen_plane"] * plane, *["seen_ids"] * ids)
    samplers = _samplers(has_copies, plane=plane, ids=ids, corners=corners)
    return replace(
        description,
        name=f"{description.name}_instances" if has_copies else description.name,
        library=(*library, *description.library),
        samplers=(*description.samplers, *samplers),
        defines=(*description.defines, *(INSTANCE_DEFINES if has_copies else ())),
    )


def seen_textures(
    geometry: GeometryBuffer, *, plane: bool = False, ids: bool = False, corners: bool = False
) -> dict[str, Texture]:
    """The textures of `with_seen_triangle`'s samplers.

    Raises:
        ValueError: it asks for the corners of a geometry without corner normals.
    """
    found = dict(geometry.table.textures())
    if corners:
        if geometry.corner_normals is None:
            raise ValueError("the geometry has no corner normals")
        found.update(geometry.corner_normals.textures())
    copies = geometry.copies
    if copies is not None:
        found.update(copies.meshes.textures())
        found[INSTANCE_SAMPLERS[0][0]] = copies.table
        if corners:
            found.update(copies.meshes.corner_textures())
    wanted = _samplers(copies is not None, plane=plane, ids=ids, corners=corners)
    return {name: found[name] for name, _ in wanted}


def _samplers(has_copies: bool, *, plane: bool, ids: bool, corners: bool) -> Samplers:
    own = (*TABLE_SAMPLERS[: int(plane or corners)], *TABLE_SAMPLERS[1 : 1 + ids])
    own = (*own, *(CORNER_SAMPLERS if corners else ()))
    if not has_copies:
        return own
    first, corner = MESH_SAMPLERS
    mesh = (first,)
    mesh = (*mesh, *((corner,) if plane or corners else ()))
    return (*own, *mesh, *(MESH_CORNER_SAMPLERS if corners else ()), *INSTANCE_SAMPLERS)
