# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes in which a mesh stands many times, as the reader makes them, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import Cutout, SceneGeometry
from addon.scene.mesh_copies import MeshCopies
from addon.scene.octahedral import from_codes, to_codes
from tests import synthetic


def with_copies(
    mesh: SceneGeometry,
    places: Sequence[NDArray[np.float64]],
    rest: SceneGeometry | None = None,
) -> SceneGeometry:
    """A mesh, of float32 corners, at (4, 4) places, and what stands there once, before it.

    Each copy is an object of its own; the mesh's materials come after those of the rest.
    """
    stack = np.stack(places)
    count, first_material = len(mesh), 0 if rest is None else len(rest.material_names)
    first = (0 if rest is None else len(rest)) + count * np.arange(len(places))
    first_object = 0 if rest is None else len(rest.object_names)
    parts, codes = [], []
    for place in stack:
        world = mesh.vertices @ place[:3, :3].T + place[:3, 3]
        mirrored = np.linalg.det(place[:3, :3]) < 0.0
        triangles = mesh.triangles[:, ::-1] if mirrored else mesh.triangles
        parts.append((world, triangles.astype(np.int64)))
        if mesh.corner_normals is not None:
            smooth = from_codes(mesh.corner_normals) @ np.linalg.inv(place[:3, :3])
            codes.append(to_codes(smooth[:, ::-1] if mirrored else smooth))
    copied = synthetic.geometry_of(parts)
    copied = replace(
        copied,
        object_id=copied.object_id + first_object,
        material_id=np.tile(mesh.material_id, len(places)) + first_material,
        material_names=mesh.material_names,
        corner_normals=np.concatenate(codes) if codes else None,
    )
    if mesh.uv is not None:
        uv = [mesh.uv[:, ::-1] if np.linalg.det(p[:3, :3]) < 0.0 else mesh.uv for p in stack]
        copied = replace(copied, uv=np.concatenate(uv))
    copies = MeshCopies(
        vertices=mesh.vertices.astype(np.float32),
        triangles=mesh.triangles,
        material_id=mesh.material_id + np.int32(first_material),
        camera_visible=True,
        shadow_visible=True,
        world_from_mesh=stack,
        first=first.astype(np.int64),
        object_id=(np.arange(len(places)) + first_object).astype(np.int32),
        uv=mesh.uv,
        corner_normals=mesh.corner_normals,
    )
    cutouts = tuple(
        Cutout(cutout.material_id + first_material, cutout.alpha, cutout.extension)
        for cutout in mesh.cutouts
    )
    if rest is None:
        return replace(copied, copies=(copies,), cutouts=cutouts)
    return SceneGeometry(
        vertices=np.concatenate([rest.vertices, copied.vertices]),
        triangles=np.concatenate([rest.triangles, copied.triangles + len(rest.vertices)]).astype(
            np.int32
        ),
        object_id=np.concatenate([rest.object_id, copied.object_id]),
        material_id=np.concatenate([rest.material_id, copied.material_id]),
        weight=np.ones(len(rest) + len(copied), dtype=np.float32),
        camera_visible=np.ones(len(rest) + len(copied), dtype=bool),
        shadow_visible=np.ones(len(rest) + len(copied), dtype=bool),
        object_names=(*rest.object_names, *(f"copy {i}" for i in range(len(places)))),
        material_names=(*rest.material_names, *mesh.material_names),
        uv=None if copied.uv is None else np.concatenate([_no_uv(rest), copied.uv]),
        corner_normals=(
            None
            if copied.corner_normals is None
            else np.concatenate([_flat(rest), copied.corner_normals])
        ),
        cutouts=(*rest.cutouts, *cutouts),
        copies=(copies,),
    )  # fmt: skip


def _no_uv(geometry: SceneGeometry) -> NDArray[np.float32]:
    return np.zeros((len(geometry), 3, 2), dtype=np.float32)


def _flat(geometry: SceneGeometry) -> NDArray[np.uint16]:
    return np.repeat(to_codes(geometry.normal)[:, None], 3, axis=1)


def tree(seed: int = 3, leaves: int = 40) -> SceneGeometry:
    """Small triangles about a stem, in two materials, with normals that lean from them."""
    rng = np.random.default_rng(seed)
    middle = rng.normal(size=(leaves, 1, 3)) * [0.3, 0.3, 0.6]
    corners = (middle + rng.normal(size=(leaves, 3, 3)) * 0.25).astype(np.float32)
    geometry = synthetic.geometry_of(
        [(corners.reshape(-1, 3).astype(np.float64), np.arange(3 * leaves).reshape(-1, 3))]
    )
    material = (rng.uniform(size=leaves) < 0.5).astype(np.int32)
    lean = rng.normal(size=(leaves, 3, 3)) * 0.3
    return replace(
        geometry,
        material_id=material,
        material_names=("bark", "leaf"),
        corner_normals=to_codes(geometry.normal[:, None] + lean),
    )


def places(
    count: int, spread: float, seed: int = 5, *, uneven: bool = True
) -> list[NDArray[np.float64]]:
    """(4, 4) turns, sizes (each axis its own, every third mirrored) and places."""
    rng = np.random.default_rng(seed)
    result = []
    for index in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        size = rng.uniform(0.5, 1.5, 3) if uneven else np.full(3, rng.uniform(0.5, 1.5))
        size[0] *= -1.0 if index % 3 == 0 else 1.0
        matrix = np.eye(4)
        matrix[:3, :3] = turn * size
        matrix[:3, 3] = rng.uniform(-spread, spread, 3)
        result.append(matrix)
    return result
