# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the repeated meshes of a scene, all places of a piece of one in one call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture
from .clusters import BOX_MARGIN
from .instance_table import instance_texels, upload_instances
from .mesh_store import MeshStore, Piece, StoredMesh

# Who looks at the triangles: a camera, or a light that casts shadows.
Audience = Literal["camera", "shadow"]


@dataclass(frozen=True)
class CopiesCall:
    """One draw call.

    Attributes:
        piece: what is drawn.
        first: its first instance in the list of all that are drawn.
        count: how many times it is drawn.
    """

    piece: Piece
    first: int
    count: int


class CopiesBuffer:
    """The instances of repeated meshes in local space.

    Args:
        meshes: the meshes.
        origin: (3,), world space, where local space has its origin.

    Attributes:
        table: see `instance_texels`.
    """

    def __init__(self, meshes: MeshStore, origin: NDArray[np.float64]) -> None:
        self.meshes = meshes
        every = np.concatenate([mesh.copies.world_from_mesh for mesh in meshes.meshes])
        self.table: Texture = upload_instances(instance_texels(every, meshes.object_id, origin))
        self._local_from_mesh = every.copy()
        self._local_from_mesh[:, :3, 3] -= origin

    def calls(
        self,
        clip_from_local: NDArray[np.float64] | None,
        audience: Audience,
        objects: NDArray[np.bool_] | None,
    ) -> tuple[list[CopiesCall], NDArray[np.int64]]:
        """What is to be drawn, and (N,) the instances one call's after another's.

        Args:
            clip_from_local: (4, 4); None for all there is.
            audience: who looks.
            objects: which objects; None for all.
        """
        calls: list[CopiesCall] = []
        numbers = [np.zeros(0, dtype=np.int64)]
        total = 0
        for mesh in self.meshes.meshes:
            copies = mesh.copies
            if not (copies.camera_visible if audience == "camera" else copies.shadow_visible):
                continue
            first, count = mesh.first_instance, len(copies)
            shown = np.ones((count, len(mesh.pieces)), dtype=np.bool_)
            if clip_from_local is not None:
                shown = self._seen(mesh, clip_from_local)
            if objects is not None:
                shown &= objects[copies.object_id][:, None]
            for column, piece in enumerate(mesh.pieces):
                drawn = np.flatnonzero(shown[:, column]) + first
                if len(drawn):
                    calls.append(CopiesCall(piece, total, len(drawn)))
                    numbers.append(drawn)
                    total += len(drawn)
        return calls, np.concatenate(numbers)

    def _seen(self, mesh: StoredMesh, clip_from_local: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N, P) whether something of each piece of each copy may lie before the sides of a
        picture, as `Clusters.seen`."""
        some = slice(mesh.first_instance, mesh.first_instance + len(mesh.copies))
        matrix = self._local_from_mesh[some]
        low = np.stack([piece.low for piece in mesh.pieces])
        high = np.stack([piece.high for piece in mesh.pieces])
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        # Of each box about the turned piece: (N, P, 3).
        place = np.einsum("nij,pj->npi", matrix[:, :3, :3], middle) + matrix[:, None, :3, 3]
        reach = np.einsum("nij,pj->npi", np.abs(matrix[:, :3, :3]), half)
        reach += BOX_MARGIN * (np.abs(place) + reach)
        x, y, _, w = clip_from_local
        planes = np.stack([w + x, w - x, w + y, w - y])
        beyond = place @ planes[:, :3].T + reach @ np.abs(planes[:, :3]).T + planes[:, 3]
        return np.asarray((beyond >= 0.0).all(axis=2))
