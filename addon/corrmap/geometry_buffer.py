# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's triangles on the GPU, for every pass that rasterizes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import texture_from_array
from ..glsl.triangles import depth_tested, triangle_batch
from ..scene.geometry import PART, Cutout, SceneGeometry, Sheer
from .clusters import Clusters, order_of_objects, overlaps
from .copies_buffer import Audience, CopiesBuffer, CopiesCall
from .corner_normal_table import CornerNormalTable
from .instance_table import INSTANCE_SAMPLERS, upload_numbers
from .mesh_store import MeshStore
from .raster_program import DRAWN_SAMPLERS, RasterProgram
from .triangle_codes import TriangleCodes
from .triangle_table import TABLE_SAMPLERS, TriangleTable

_EXTENSION_CODE = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}


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
    cutout: Cutout | Sheer | None
    mask: Any

    @property
    def is_sheer(self) -> bool:
        """Whether light passes through them in part."""
        return isinstance(self.cutout, Sheer)

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

    Meshes that the scene has many times are held once, in their own space (`copies`).

    Attributes:
        origin: (3,) float64, world space. Vertices are made relative to it in float64, so a
            scene far from the world's origin keeps its precision in float32.
        has_cutouts: whether any triangle has an alpha mask.
        has_sheer: whether light passes through any triangle in part.
        triangle_count: triangles that are drawn.
        bounds: (2, 3) float64, world space.
        codes: how triangles are told apart.
        copies: the repeated meshes; None where there are none.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        origin: NDArray[np.float64],
        meshes: MeshStore | None = None,
    ) -> None:
        """Put a geometry on the GPU.

        Args:
            geometry: the scene.
            origin: (3,), world space, where local space is to have its origin.
            meshes: the geometry's repeated ones, if they are on the GPU already.
        """
        self.origin = np.array(origin, dtype=np.float64)
        self.triangle_count = len(geometry)
        self.bounds = geometry.bounds
        self._geometry = geometry
        self.copies: CopiesBuffer | None = None
        # The scene's triangles that are there once.
        alone: slice | NDArray[np.int64] = slice(None)
        if geometry.copies:
            meshes = MeshStore(geometry) if meshes is None else meshes
            if len(meshes):
                self.copies = CopiesBuffer(meshes, self.origin)
                alone = np.flatnonzero(meshes.alone(len(geometry)))
        # Sorting keeps what is equal in the geometry's order.
        order, key = _draw_order(geometry, alone)
        if isinstance(alone, np.ndarray):
            order = alone[order]
        self._order = order
        self.codes = self._codes()
        self._groups = self._grouped(order, key) if len(order) else []
        in_groups = any(isinstance(group.cutout, Cutout) for group in self._groups)
        self.has_sheer = any(group.is_sheer for group in self._groups)
        self.has_cutouts = in_groups or (self.copies is not None and self.copies.meshes.has_cutouts)

    def _codes(self) -> TriangleCodes:
        if self.copies is None:
            none = np.zeros(0, dtype=np.int64)
            return TriangleCodes(self._order, none, none)
        meshes = self.copies.meshes
        places = tuple(
            (mesh.first_instance, len(mesh.copies), mesh.first, len(mesh.copies.triangles))
            for mesh in meshes.meshes
        )
        return TriangleCodes(self._order, meshes.first_triangle, meshes.mesh_triangle, places)

    def _grouped(self, order: NDArray[np.int64], key: NDArray[np.int64]) -> list[_Group]:
        """The draw calls of triangles that are there once, sorted by `key`."""
        geometry = self._geometry
        groups = []
        starts = np.append(0, np.flatnonzero(key[1:] != key[:-1]) + 1)
        for number, first, chosen in zip(
            key[starts], starts, np.split(order, starts[1:]), strict=True
        ):
            cutout_number = int(number) // 4 - 1
            cutout_used = _masks(geometry)[cutout_number] if cutout_number >= 0 else None
            corners = _corners(geometry, self.origin, chosen)
            groups.append(
                _Group(
                    batch=_batch(geometry, corners, chosen, cutout_used is not None),
                    clusters=Clusters.of(corners),
                    first=int(first),
                    **_runs(geometry.object_id[chosen]),
                    camera_visible=bool(number & 2),
                    shadow_visible=bool(number & 1),
                    cutout=cutout_used,
                    mask=_mask_texture(cutout_used),
                )
            )
        return groups

    @cached_property
    def table(self) -> TriangleTable:
        """What is known of each triangle that is there once, by its number; made when a pass first
        asks."""
        return TriangleTable.upload(self._geometry, self._order, self.origin)

    @cached_property
    def corner_normals(self) -> CornerNormalTable | None:
        """The normals of the corners of each triangle that is there once; None where every face of
        the scene is flat."""
        geometry, order = self._geometry, self._order
        if geometry.corner_normals is None:
            return None
        return CornerNormalTable.upload(
            geometry.vertices - self.origin,
            geometry.triangles[order],
            geometry.normal_of(order),
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
        only_sheer: bool = False,
    ) -> None:
        """Draw all triangles that `audience` sees into the bound framebuffer.

        Clusters beside the picture are left out, and sheer surfaces but by a program that was
        built for them.

        Args:
            program: built by `build_raster_program`.
            clip_from_local: (4, 4), OpenGL clip space from local space.
            audience: who looks.
            textures: what the pass declares beyond the geometry's own.
            uniforms: likewise.
            objects: which of `SceneGeometry.object_names` are drawn; None for all.
            only_sheer: whether sheer surfaces alone are drawn.
        """
        textures = dict(textures or {})
        if program.reads_planes:
            textures[TABLE_SAMPLERS[0][0]] = self.table.plane
        if program.has_poses:
            textures[TABLE_SAMPLERS[1][0]] = self.table.ids
        uniforms = dict(uniforms or {})
        with depth_tested():
            for group in self._groups:
                if program.sheer is None if group.is_sheer else only_sheer:
                    continue
                if group.camera_visible if audience == "camera" else group.shadow_visible:
                    raster = {"clip_from_local": clip_from_local, "first_triangle": group.first}
                    # What moves may be anywhere.
                    matrix = None if program.has_poses else clip_from_local
                    ranges = group.ranges(matrix, objects)
                    _draw_group(group, program, textures, {**uniforms, "raster": raster}, ranges)
            if self.copies is not None and not only_sheer:
                matrix = None if program.has_poses else clip_from_local
                raster = {"clip_from_local": clip_from_local}
                _draw_copies(
                    self.copies,
                    program,
                    textures,
                    {**uniforms, "raster": raster},
                    self.copies.calls(matrix, audience, objects),
                )


def _draw_copies(
    copies: CopiesBuffer,
    program: RasterProgram,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
    drawn: tuple[list[CopiesCall], NDArray[np.int64]],
) -> None:
    calls, numbers = drawn
    if not calls:
        return
    if program.copies is None:
        raise ValueError("the pass was built without repeated meshes, but the scene has some")
    textures = {
        **textures,
        INSTANCE_SAMPLERS[0][0]: copies.table,
        DRAWN_SAMPLERS[0][0]: upload_numbers(numbers),
    }
    if program.reads_planes:
        textures.update(copies.meshes.textures())
    for call in calls:
        piece = call.piece
        raster = {
            **uniforms["raster"], "first_triangle": piece.first, "first_drawn": call.first
        }  # fmt: skip
        mask = None if piece.cutout is None else copies.meshes.mask(piece.cutout)
        shader = _bind(piece.cutout, mask, program.copies, textures, {**uniforms, "raster": raster})
        piece.batch.draw_instanced(shader, instance_start=0, instance_count=call.count)


def _draw_group(
    group: _Group,
    program: RasterProgram,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
    ranges: list[tuple[int, int]],
) -> None:
    if not ranges:
        return
    shader = _bind(group.cutout, group.mask, program, textures, uniforms)
    for first, end in ranges:
        group.batch.draw_range(shader, elem_start=3 * first, elem_count=3 * (end - first))


def _bind(
    cutout: Cutout | Sheer | None,
    mask: Any,
    program: RasterProgram,
    textures: Mapping[str, Any],
    uniforms: Mapping[str, Mapping[str, Any]],
) -> Any:
    """The shader that draws triangles with or without a cut-out and its mask, bound."""
    if isinstance(cutout, Sheer):
        if program.sheer is None:
            raise ValueError("the pass was built without sheer surfaces, but the scene has some")
        outside = np.append(cutout.outside, 1.0)
        sheer = {"outside": outside, "extension": _EXTENSION_CODE[cutout.extension]}
        program.sheer.bind({**textures, "sheer_transmission": mask}, {**uniforms, "sheer": sheer})
        return program.sheer.shader
    if cutout is None:
        if program.opaque is None:
            raise ValueError("the pass was built for sheer surfaces alone")
        program.opaque.bind(textures, uniforms)
        return program.opaque.shader
    if program.cutout is None:
        raise ValueError("the pass was built without cut-outs, but the scene has some")
    extension = _EXTENSION_CODE[cutout.extension]
    program.cutout.bind(
        {**textures, "cutout_alpha": mask}, {**uniforms, "cutout": {"extension": extension}}
    )
    return program.cutout.shader


def _draw_order(
    geometry: SceneGeometry, some: slice | NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(N,) the order in which some triangles are drawn, and (N,) in that order a number for each
    combination that needs a draw call of its own."""
    cutout_of_material = np.full(len(geometry.material_names), -1)
    for index, cutout in enumerate(_masks(geometry)):
        cutout_of_material[cutout.material_id] = index
    combination = (
        (cutout_of_material[geometry.material_id[some]] + 1) * 4
        + geometry.camera_visible[some].astype(np.int64) * 2
        + geometry.shadow_visible[some].astype(np.int64)
    )
    object_id = geometry.object_id[some]
    rank = order_of_objects(geometry.vertices, geometry.triangles[some], object_id)
    order = np.argsort(combination * len(rank) + rank[object_id], kind="stable")
    return order, combination[order]


def _masks(geometry: SceneGeometry) -> list[Cutout | Sheer]:
    """What materials have masks of either kind."""
    return [*geometry.cutouts, *geometry.sheers]


def _mask_texture(mask: Cutout | Sheer | None) -> Any:
    """What a group's shader reads of its material's mask."""
    if mask is None:
        return None
    if isinstance(mask, Cutout):
        return texture_from_array(mask.alpha[..., None], "R32F")
    opaque = np.ones((*mask.transmission.shape[:2], 1), dtype=np.float32)
    return texture_from_array(np.concatenate([mask.transmission, opaque], axis=-1), "RGBA32F")


def _runs(object_id: NDArray[np.int32]) -> dict[str, NDArray[np.int64]]:
    """The runs of a `_Group` whose triangles are of these objects."""
    changes = np.flatnonzero(object_id[1:] != object_id[:-1]) + 1
    ends = np.append(changes, len(object_id)).astype(np.int64)
    return {"run_end": ends, "run_object": object_id[ends - 1].astype(np.int64)}


def _corners(
    geometry: SceneGeometry, origin: NDArray[np.float64], chosen: NDArray[np.int64]
) -> NDArray[np.float32]:
    """(N, 3, 3) the corners of some triangles, relative to an origin."""
    corners = np.empty((len(chosen), 3, 3), dtype=np.float32)
    # Most corners are shared, but not where few of the scene's are wanted.
    shared = 2 * len(chosen) > len(geometry)
    local = (geometry.vertices - origin).astype(np.float32) if shared else None
    for start in range(0, len(chosen), PART):
        triangles = geometry.triangles[chosen[start : start + PART]]
        out = corners[start : start + len(triangles)]
        if local is not None:
            np.take(local, triangles, axis=0, out=out, mode="clip")
        else:
            out[:] = geometry.vertices[triangles] - origin
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
