# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that stand in a scene many times, on the GPU, each of them once and in its own space."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import row_texture
from ..glsl.shader import Samplers, Texture, texture_from_array
from ..glsl.triangles import triangle_batch
from ..scene.geometry import Cutout, SceneGeometry
from ..scene.mesh_copies import MeshCopies
from .corner_normal_table import CORNER_SAMPLERS, CornerNormalTable

# Triangles that are drawn in one call for all places, and left out together at each: a call costs
# about what some thousands cost to transform.
PIECE = 4096

# Numbers of triangles are exact in float32 up to here.
_MOST_TRIANGLES = 1 << 24

# GPUs whose textures have 16,384 rows have room for a table of twice as many.
_MOST_INSTANCES = 1 << 22

MESH_SAMPLERS: Samplers = (("mesh_plane", "FLOAT_2D"), ("mesh_corner", "FLOAT_2D"))
MESH_CORNER_SAMPLERS: Samplers = tuple((f"mesh_{name}", kind) for name, kind in CORNER_SAMPLERS)


@dataclass(frozen=True)
class Piece:
    """Triangles of one mesh that are drawn in one call.

    Attributes:
        first: the number of its first triangle.
        low, high: (3,) float64, corners of its bounding box, mesh space, metres.
    """

    batch: Any
    first: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    cutout: Cutout | None


@dataclass(frozen=True)
class StoredMesh:
    """One mesh.

    Attributes:
        copies: the mesh and where it stands, triangles in the order of their numbers.
        first_instance: the number of its first instance.
        first: the number of its first triangle.
    """

    copies: MeshCopies
    pieces: tuple[Piece, ...]
    first_instance: int
    first: int


class MeshStore:
    """The repeated meshes of a scene, wherever the view is.

    Instances are numbered mesh by mesh, and so are triangles, each mesh's once.

    Attributes:
        meshes: in the order of their numbers.
        object_id: (I,) int32, whose each instance is.
        first_triangle: (I,) int64, the scene's triangle that is triangle 0 of the instance's mesh.
        mesh_triangle: (M,) int64, by a triangle's number which of its mesh it is.
    """

    def __init__(self, geometry: SceneGeometry) -> None:
        cutout_of_material = np.full(len(geometry.material_names), -1)
        for index, cutout in enumerate(geometry.cutouts):
            cutout_of_material[cutout.material_id] = index
        self.meshes: list[StoredMesh] = []
        orders: list[NDArray[np.int64]] = []
        instances = numbers = 0
        for copies in geometry.copies:
            count = len(copies.triangles)
            if numbers + count > _MOST_TRIANGLES or instances + len(copies) > _MOST_INSTANCES:
                continue
            mask = cutout_of_material[copies.material_id]
            order = np.argsort(mask, kind="stable")
            sorted_copies = _in_order(copies, order)
            pieces = _pieces(sorted_copies, mask[order], geometry.cutouts, numbers)
            self.meshes.append(StoredMesh(sorted_copies, pieces, instances, numbers))
            orders.append(order.astype(np.int64))
            instances += len(copies)
            numbers += count
        self._masks: dict[int, Texture] = {}
        self.mesh_triangle = np.concatenate([np.zeros(0, np.int64), *orders])
        every = [mesh.copies for mesh in self.meshes]
        self.object_id = np.concatenate([np.zeros(0, np.int32), *(c.object_id for c in every)])
        self.first_triangle = np.concatenate([np.zeros(0, np.int64), *(c.first for c in every)])

    def __len__(self) -> int:
        """How many instances there are."""
        return len(self.object_id)

    @property
    def has_cutouts(self) -> bool:
        """Whether any triangle has an alpha mask."""
        return any(piece.cutout is not None for mesh in self.meshes for piece in mesh.pieces)

    def mask(self, cutout: Cutout) -> Texture:
        """A cut-out's alpha, R32F."""
        key = id(cutout)
        if key not in self._masks:
            self._masks[key] = texture_from_array(cutout.alpha[..., None], "R32F")
        return self._masks[key]

    def alone(self, count: int) -> NDArray[np.bool_]:
        """(count,) which of the scene's triangles are of no mesh here."""
        result = np.ones(count, dtype=np.bool_)
        for mesh in self.meshes:
            for first in mesh.copies.first:
                result[first : first + len(mesh.copies.triangles)] = False
        return result

    @cached_property
    def _planes(self) -> tuple[Texture, Texture]:
        plane = np.concatenate(
            [
                np.append(mesh.copies.normal, mesh.copies.material_id[:, None] + 1.0, axis=1)
                for mesh in self.meshes
            ]
        )
        corner = np.concatenate([mesh.copies.corners[:, 0] for mesh in self.meshes])
        corner = np.append(corner, np.zeros((len(corner), 1)), axis=1)
        first, second = (
            row_texture(values, "RGBA32F", "repeated meshes' triangles")
            for values in (plane, corner)
        )
        return first, second

    def textures(self) -> dict[str, Texture]:
        """By the names in `MESH_SAMPLERS`: RGBA32F, of each triangle its unit normal by the
        corners' winding and 1 + material id; its first corner, metres; both in mesh space."""
        return {name: t for (name, _), t in zip(MESH_SAMPLERS, self._planes, strict=True)}

    @cached_property
    def corner_normals(self) -> CornerNormalTable:
        """The normals of each triangle's corners, mesh space; of scenes that have some."""
        every = [mesh.copies for mesh in self.meshes]
        codes = [copies.corner_normals for copies in every if copies.corner_normals is not None]
        corners = np.concatenate([copies.corners for copies in every]).reshape(-1, 3)
        triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
        normal = np.concatenate([copies.normal for copies in every])
        return CornerNormalTable.upload(corners, triangles, normal, np.concatenate(codes))

    def corner_textures(self) -> dict[str, Texture]:
        """By the names in `MESH_CORNER_SAMPLERS`."""
        return {f"mesh_{name}": t for name, t in self.corner_normals.textures().items()}


def _in_order(copies: MeshCopies, order: NDArray[np.int64]) -> MeshCopies:
    codes, uv = copies.corner_normals, copies.uv
    return replace(
        copies,
        triangles=copies.triangles[order],
        material_id=copies.material_id[order],
        uv=None if uv is None else uv[order],
        corner_normals=None if codes is None else codes[order],
    )


def _pieces(
    copies: MeshCopies, mask: NDArray[np.int64], cutouts: tuple[Cutout, ...], first: int
) -> tuple[Piece, ...]:
    """The pieces of a mesh whose triangles are sorted by `mask` (T,), their cut-outs' numbers."""
    ends = np.append(np.flatnonzero(mask[1:] != mask[:-1]) + 1, len(mask))
    pieces, start = [], 0
    for end in ends:
        cutout = cutouts[mask[start]] if mask[start] >= 0 else None
        while start < end:
            some = slice(start, min(start + PIECE, int(end)))
            points = copies.vertices[copies.triangles[some]].reshape(-1, 3)
            attributes: dict[str, NDArray[Any]] = {"position": points}
            if cutout is not None:
                if copies.uv is None:
                    raise ValueError("the geometry has cut-outs but no texture coordinates")
                attributes["uv"] = copies.uv[some].reshape(-1, 2)
            low, high = points.min(axis=0), points.max(axis=0)
            pieces.append(
                Piece(
                    triangle_batch(attributes),
                    first + start,
                    low.astype(np.float64),
                    high.astype(np.float64),
                    cutout,
                )
            )
            start = some.stop
    return tuple(pieces)
