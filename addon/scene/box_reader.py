# SPDX-License-Identifier: GPL-3.0-or-later
"""The box of interest, as an object that the artist picked bounds it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .mesh_reader import MESH_TYPES
from .object_matrix_reader import world_from_object

# Object types that bound something.
BOX_TYPES = MESH_TYPES | {"EMPTY", "LATTICE", "CURVES", "POINTCLOUD", "VOLUME"}

_CUBE = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3, indexing="ij"), axis=-1).reshape(8, 3)


def find_box(depsgraph: Any, scene: Any, name: str) -> NDArray[np.float64]:
    """The box that the scene's object of this name bounds; see `read_box`.

    Raises:
        InputError: there is no such object, or it bounds no box.
    """
    obj = scene.objects.get(name)
    if obj is None:
        raise InputError(f"scene '{scene.name}' has no object '{name}'; check the name")
    return read_box(depsgraph, obj)


def read_box(depsgraph: Any, obj: Any) -> NDArray[np.float64]:
    """(2, 3) float64, the lowest and highest corner in world space of what an object bounds.

    An empty bounds the cube that reaches its display size along each of its axes, or what it
    instances. A mesh bounds its vertices, after its modifiers; anything else its own bounding box.

    Args:
        depsgraph: an evaluated dependency graph; need not contain the object.
        obj: the `bpy.types.Object`. It may be hidden.

    Raises:
        InputError: it has no extent, or none along some axis.
    """
    if obj.type not in BOX_TYPES:
        raise InputError(
            f"object '{obj.name}' is a {obj.type.lower()}, which bounds no box; pick an empty or "
            "a mesh"
        )
    points = (
        _instanced(depsgraph, obj) if obj.instance_type == "COLLECTION" else _points(depsgraph, obj)
    )
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise InputError(f"object '{obj.name}' holds nothing to bound a box; pick another")
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    if not (box[1] > box[0]).all():
        raise InputError(f"object '{obj.name}' is flat and bounds no box; give it some height")
    return box


def _points(depsgraph: Any, obj: Any) -> NDArray[np.float64]:
    """(N, 3) world-space points that span what an object bounds."""
    matrix = world_from_object(depsgraph, obj)
    if obj.type == "EMPTY":
        return _moved(_CUBE * obj.empty_display_size, matrix)
    evaluated = obj.evaluated_get(depsgraph)
    if obj.type != "MESH":
        return _moved(np.array([tuple(corner) for corner in evaluated.bound_box]), matrix)
    mesh = evaluated.data
    vertices = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", vertices)
    return _moved(vertices.reshape(-1, 3).astype(np.float64), matrix)


def _instanced(depsgraph: Any, obj: Any) -> NDArray[np.float64]:
    """(N, 3) corners of what an empty instances."""
    corners = [
        _moved(np.array([tuple(corner) for corner in instance.object.bound_box]),
               np.array(instance.matrix_world, dtype=np.float64))
        for instance in depsgraph.object_instances
        if instance.is_instance
        and instance.parent.original == obj
        and instance.object.type in MESH_TYPES
    ]  # fmt: skip
    return np.concatenate(corners) if corners else np.empty((0, 3))


def _moved(points: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])
