# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's triangles on the GPU, for every pass that rasterizes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import PassShader, ShaderProgram, Varying, texture_from_array
from ..glsl.triangles import depth_tested, triangle_batch
from ..glsl.uniforms import Field, UniformBlock
from ..scene.geometry import PART, Cutout, SceneGeometry
from .clusters import Clusters, order_of_objects, overlaps
from .corner_normal_table import CornerNormalTable
from .pose_table import POSE_SAMPLERS
from .triangle_table import TABLE_SAMPLERS, TriangleTable

# Who looks at the triangles: a camera, or a light that casts shadows.
Audience = Literal["camera", "shadow"]

# The block that every rasterizing pass has.
RASTER_BLOCK = UniformBlock(
    "raster", (Field("mat4", "clip_from_local"), Field("int", "first_triangle"))
)

_EXTENSION_CODE = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}
_CUTOUT_BLOCK = UniformBlock("cutout", (Field("int", "extension"),))


@dataclass(frozen=True)
class RasterProgram:
    """A rasterizing pass, built for plain triangles and, if the scene has any, for cut-outs."""

    opaque: ShaderProgram
    cutout: ShaderProgram | None
    reads_planes: bool = False
    has_poses: bool = False


def build_raster_program(
    description: PassShader,
    with_cutouts: bool,
    *,
    numbers_triangles: bool = False,
    reads_planes: bool = False,
    has_poses: bool = False,
) -> RasterProgram:
    """Complete a pass's description with the geometry's vertex stage, and compile it.

    The fragment shader finds `local_position` (vec3), and calls `cut_away()` first, which
    discards the fragment where the material's mask says so. If it `numbers_triangles`, it also
    finds `surface_triangle` (int), and if it `reads_planes`, `surface_plane()`. One that
    `has_poses`, and `numbers_triangles`, draws objects where a table of poses has them.
    """
    plain = replace(
        description,
        vertex="geometry_vert",
        vertex_in=(("VEC3", "position"),),
        varyings=(Varying("smooth", "VEC3", "local_position"),),
        blocks=(RASTER_BLOCK, *description.blocks),
        library=("cutout", *description.library),
    )
    if numbers_triangles:
        plain = replace(
            plain,
            varyings=(*plain.varyings, Varying("flat", "INT", "surface_triangle")),
            defines=(*plain.defines, ("HAS_TRIANGLES", "1")),
        )
    if reads_planes:
        plain = replace(
            plain,
            library=("triangle_table", *plain.library),
            samplers=(TABLE_SAMPLERS[0], *plain.samplers),
        )
    if has_poses:
        plain = replace(
            plain,
            name=f"{plain.name}_posed",
            library=("pose_table", *plain.library),
            vertex_library=("pose_table",),
            samplers=(TABLE_SAMPLERS[1], *POSE_SAMPLERS, *plain.samplers),
            defines=(*plain.defines, ("HAS_POSES", "1")),
        )
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


@dataclass(frozen=True)
class _Group:
    """Triangles that are drawn in one call.

    Attributes:
        clusters: its triangles, some at a time.
        first: the number of its first triangle.
        run_end, run_object: (R,) int64, runs of triangles of one object: where each ends, and
            whose it is.
    """

    batch: Any
    clusters: Clusters
    first: int
    run_end: NDArray[np.int64]
    run_object: NDArray[np.int64]
    camera_visible: bool
    shadow_visible: bool
    cutout: Cutout | None
    mask: Any

    def ranges(
        self, clip_from_local: NDArray[np.float64] | None, objects: NDArray[np.bool_] | None
    ) -> list[tuple[int, int]]:
        """(first, end) triangle of each stretch that is in a picture and shows some objects."""
        if clip_from_local is None:
            seen = [(0, self.clusters.count)]
        else:
            seen = self.clusters.ranges(self.clusters.seen(clip_from_local))
        return seen if objects is None else overlaps(seen, self._showing(objects))

    def _showing(self, objects: NDArray[np.bool_]) -> list[tuple[int, int]]:
        shown = np.concatenate([[False], objects[self.run_object], [False]])
        changes = np.flatnonzero(shown[1:] != shown[:-1]).reshape(-1, 2)
        ends = np.append(0, self.run_end)
        return [(int(first), int(end)) for first, end in ends[changes]]


class GeometryBuffer:
    """Vertex buffers in local space: world axes, metres, origin at `origin`.

    Attributes:
        origin: (3,) float64, world space. Vertices are made relative to it in float64, so a
            scene far from the world's origin keeps its precision in float32.
        has_cutouts: whether any triangle has an alpha mask.
        triangle_count: triangles on the GPU.
        bounds: (2, 3) float64, world space.
        scene_triangle: (T,) int64, the geometry's triangle by the number that it has here.
    """

    def __init__(self, geometry: SceneGeometry, origin: NDArray[np.float64]) -> None:
        self.origin = np.array(origin, dtype=np.float64)
        self.triangle_count = len(geometry)
        self.bounds = geometry.bounds
        local = (geometry.vertices - self.origin).astype(np.float32)
        cutout_of_material = np.full(len(geometry.material_names), -1)
        for index, cutout in enumerate(geometry.cutouts):
            cutout_of_material[cutout.material_id] = index
        cutout_index = cutout_of_material[geometry.material_id]
        # One number for each combination that needs a draw call of its own.
        combination = (
            (cutout_index + 1) * 4
            + geometry.camera_visible.astype(np.int64) * 2
            + geometry.shadow_visible.astype(np.int64)
        )
        self._geometry = geometry
        self._groups: list[_Group] = []
        # Sorting keeps what is equal in the geometry's order.
        rank = order_of_objects(geometry.vertices, geometry.triangles, geometry.object_id)
        self.scene_triangle = np.argsort(
            combination * len(rank) + rank[geometry.object_id], kind="stable"
        )
        sorted_keys = combination[self.scene_triangle]
        starts = np.append(0, np.flatnonzero(sorted_keys[1:] != sorted_keys[:-1]) + 1)
        parts = np.split(self.scene_triangle, starts[1:])
        for key, first, chosen in zip(sorted_keys[starts], starts, parts, strict=True):
            cutout_number = int(key) // 4 - 1
            cutout_used = geometry.cutouts[cutout_number] if cutout_number >= 0 else None
            corners = _corners(local, geometry.triangles, chosen)
            self._groups.append(
                _Group(
                    batch=_batch(geometry, corners, chosen, cutout_used is not None),
                    clusters=Clusters.of(corners),
                    first=int(first),
                    **_runs(geometry.object_id[chosen]),
                    camera_visible=bool(key & 2),
                    shadow_visible=bool(key & 1),
                    cutout=cutout_used,
                    mask=(
                        texture_from_array(cutout_used.alpha[..., None], "R32F")
                        if cutout_used is not None
                        else None
                    ),
                )
            )
        self.has_cutouts = any(group.cutout is not None for group in self._groups)

    @cached_property
    def table(self) -> TriangleTable:
        """What is known of each triangle by its number; made when a pass first asks."""
        return TriangleTable.upload(self._geometry, self.scene_triangle, self.origin)

    @cached_property
    def corner_normals(self) -> CornerNormalTable | None:
        """The normals of each triangle's corners; None where every face is flat."""
        geometry, order = self._geometry, self.scene_triangle
        if geometry.corner_normals is None:
            return None
        return CornerNormalTable.upload(
            geometry.vertices - self.origin,
            geometry.triangles[order],
            geometry.normal[order],
            geometry.corner_normals[order],
        )

    def draw(
        self,
        program: RasterProgram,
        clip_from_local: NDArray[np.float64],
        audience: Audience,
        textures: Mapping[str, Any] | None = None,
        uniforms: Mapping[str, Mapping[str, Any]] | None = None,
        *,
        objects: NDArray[np.bool_] | None = None,
    ) -> None:
        """Draw all triangles that `audience` sees into the bound framebuffer.

        Clusters beside the picture are left out.

        Args:
            program: built by `build_raster_program`.
            clip_from_local: (4, 4), OpenGL clip space from local space.
            audience: who looks.
            textures: what the pass declares beyond the geometry's own.
            uniforms: likewise.
            objects: which of `SceneGeometry.object_names` are drawn; None for all.
        """
        textures = dict(textures or {})
        if program.reads_planes:
            textures[TABLE_SAMPLERS[0][0]] = self.table.plane
        if program.has_poses:
            textures[TABLE_SAMPLERS[1][0]] = self.table.ids
        uniforms = dict(uniforms or {})
        with depth_tested():
            for group in self._groups:
                if group.camera_visible if audience == "camera" else group.shadow_visible:
                    raster = {"clip_from_local": clip_from_local, "first_triangle": group.first}
                    # What moves may be anywhere.
                    matrix = None if program.has_poses else clip_from_local
                    ranges = group.ranges(matrix, objects)
                    _draw_group(group, program, textures, {**uniforms, "raster": raster}, ranges)


def _draw_group(
    group: _Group,
    program: RasterProgram,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
    ranges: list[tuple[int, int]],
) -> None:
    if not ranges:
        return
    shader = _bind_group(group, program, textures, uniforms)
    for first, end in ranges:
        group.batch.draw_range(shader, elem_start=3 * first, elem_count=3 * (end - first))


def _bind_group(
    group: _Group,
    program: RasterProgram,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
) -> Any:
    """The shader that draws a group, bound."""
    if group.cutout is None:
        program.opaque.bind(textures, uniforms)
        return program.opaque.shader
    if program.cutout is None:
        raise ValueError("the pass was built without cut-outs, but the scene has some")
    extension = _EXTENSION_CODE[group.cutout.extension]
    program.cutout.bind(
        {**textures, "cutout_alpha": group.mask}, {**uniforms, "cutout": {"extension": extension}}
    )
    return program.cutout.shader


def _runs(object_id: NDArray[np.int32]) -> dict[str, NDArray[np.int64]]:
    """The runs of a `_Group` whose triangles are of these objects."""
    changes = np.flatnonzero(object_id[1:] != object_id[:-1]) + 1
    ends = np.append(changes, len(object_id)).astype(np.int64)
    return {"run_end": ends, "run_object": object_id[ends - 1].astype(np.int64)}


def _corners(
    local: NDArray[np.float32], triangles: NDArray[np.int32], chosen: NDArray[np.int64]
) -> NDArray[np.float32]:
    """(N, 3, 3) the corners of some triangles."""
    corners = np.empty((len(chosen), 3, 3), dtype=np.float32)
    for start in range(0, len(chosen), PART):
        some = chosen[start : start + PART]
        np.take(local, triangles[some], axis=0, out=corners[start : start + len(some)], mode="clip")
    return corners


def _batch(
    geometry: SceneGeometry,
    corners: NDArray[np.float32],
    chosen: NDArray[np.int64],
    with_uv: bool,
) -> Any:
    attributes: dict[str, NDArray[Any]] = {
        "position": corners.reshape(-1, 3),
    }
    if with_uv:
        if geometry.uv is None:
            raise ValueError("the geometry has cut-outs but no texture coordinates")
        attributes["uv"] = geometry.uv[chosen].reshape(-1, 2)
    return triangle_batch(attributes)
