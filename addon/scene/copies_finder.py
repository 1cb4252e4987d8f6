# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds which objects of a scene are copies of one mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .mesh_copies import (
    LEAST_SPARED,
    LEAST_SPARED_OF_MESH,
    LEAST_TRIANGLES,
    MeshCopies,
    keeps_digits,
)
from .mesh_reader import MeshArrays
from .octahedral import to_codes


class Part(Protocol):
    """One object or instance, as the reader has it."""

    @property
    def mesh(self) -> MeshArrays:
        """Its mesh: the same one for all that share it."""

    @property
    def world_from_object(self) -> NDArray[np.float64]:
        """(4, 4)."""

    @property
    def material_of_slot(self) -> NDArray[np.int32]:
        """(S,) indices into the scene's materials."""

    @property
    def camera_visible(self) -> bool:
        """Whether cameras see it."""

    @property
    def shadow_visible(self) -> bool:
        """Whether it casts shadows."""

    @property
    def is_mirrored(self) -> bool:
        """Whether its corners run the other way round in world space."""


@dataclass(frozen=True)
class FlatTriangles:
    """All triangles of the parts, one part's after another's.

    Attributes:
        keep: (A,) which of them the scene has.
        material_id: (T,) of those that it has.
        uv: (T, 3, 2) likewise; None where it has none.
        is_smooth: whether the scene has corner normals.
    """

    keep: NDArray[np.bool_]
    material_id: NDArray[np.int32]
    uv: NDArray[np.float32] | None
    is_smooth: bool


def find_copies(parts: Sequence[Part], flat: FlatTriangles) -> tuple[MeshCopies, ...]:
    """The meshes that are worth being kept once; `parts` in the order of the triangles."""
    counts = np.array([len(part.mesh.triangles) for part in parts])
    end = np.cumsum(counts)
    first = np.append(0, np.cumsum(flat.keep))[end - counts]
    alike: dict[tuple[object, ...], list[int]] = {}
    for index, part in enumerate(parts):
        materials = part.material_of_slot.tobytes()
        key = (id(part.mesh), materials, part.camera_visible, part.shadow_visible)
        alike.setdefault(key, []).append(index)
    found = []
    for same in alike.values():
        count = int(counts[same[0]])
        if count < LEAST_TRIANGLES or (len(same) - 1) * count < LEAST_SPARED_OF_MESH:
            continue
        used = flat.keep[end[same[0]] - count : end[same[0]]]
        chosen = [
            index
            for index in same
            if keeps_digits(parts[index].world_from_object)
            and np.array_equal(flat.keep[end[index] - count : end[index]], used)
        ]
        if chosen and (len(chosen) - 1) * used.sum() >= LEAST_SPARED_OF_MESH:
            found.append(_copies(parts, np.array(chosen), used, first[chosen], flat))
    return tuple(found) if sum(copies.spared for copies in found) >= LEAST_SPARED else ()


def _copies(
    parts: Sequence[Part],
    chosen: NDArray[np.int64],
    used: NDArray[np.bool_],
    first: NDArray[np.int64],
    flat: FlatTriangles,
) -> MeshCopies:
    """The parts `chosen` (N,), which share a mesh of which triangles are `used` (A,); the scene
    has them from `first` (N,) on."""
    part = parts[chosen[0]]
    own = slice(int(first[0]), int(first[0] + used.sum()))
    uv = None if flat.uv is None else flat.uv[own].copy()
    if uv is not None and part.is_mirrored:
        uv = np.ascontiguousarray(uv[:, ::-1])
    return MeshCopies(
        vertices=part.mesh.vertices.astype(np.float32),
        triangles=part.mesh.triangles[used],
        material_id=flat.material_id[own].copy(),
        camera_visible=part.camera_visible,
        shadow_visible=part.shadow_visible,
        world_from_mesh=np.stack([parts[index].world_from_object for index in chosen]),
        first=first.astype(np.int64),
        object_id=chosen.astype(np.int32),
        uv=uv,
        corner_normals=_codes(part.mesh, used) if flat.is_smooth else None,
    )


def _codes(mesh: MeshArrays, used: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """(T, 3, 2) codes of what is interpolated for shading, in the mesh's space."""
    a, b, c = (mesh.vertices[corner] for corner in mesh.triangles[used].T)
    flat = np.cross(b - a, c - a)[:, None]
    if mesh.corner_normals is None:
        return to_codes(np.broadcast_to(flat, (len(flat), 3, 3)))
    smooth = mesh.corner_normals[used].astype(np.float64)
    size = np.linalg.norm(smooth, axis=-1, keepdims=True)
    return to_codes(np.where(np.isfinite(size) & (size > 0.0), smooth, flat))
