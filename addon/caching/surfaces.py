# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache was baked from: the scene's objects and materials, each as a fingerprint.

Lights and cameras are not among them: they may change without a new bake. The world has a
fingerprint of its own, as only its picture depends on it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry

# Objects of one name (the instances of one object) are told apart up to this many; a crowd that
# is larger is recorded as a whole, so that a meadow does not fill the manifest.
CROWD = 64
# 64 bits: of a million states, two have the same digest with a chance of 3e-8.
_DIGEST_BYTES = 8


@dataclass(frozen=True)
class ObjectState:
    """One object or instance as it was baked, or a crowd of one name.

    Attributes:
        name: Blender's.
        digest: of its place, shape, attributes and what else a material reads of it.
        shape: a digest of its place, shape and materials' names alone, which are what others feel
            of it.
        low, high: (3,) its bounding box, world space, metres.
    """

    name: str
    digest: str
    shape: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]

    @property
    def center(self) -> NDArray[np.float64]:
        """(3,) of the ball about its bounding box, metres."""
        return np.asarray(0.5 * (np.array(self.low) + np.array(self.high)))

    @property
    def radius(self) -> float:
        """Of that ball, metres."""
        return 0.5 * float(np.linalg.norm(np.array(self.high) - np.array(self.low)))


@dataclass(frozen=True)
class MaterialState:
    """One material as it was baked.

    Attributes:
        digest: of what its nodes compute, and of the frame if that has a say in it.
        feels_near: it reads the shapes about it (Bevel, Ambient Occlusion, Raycast).
    """

    digest: str
    feels_near: bool = False


@dataclass(frozen=True)
class Surfaces:
    """The state of everything that a bake shows.

    Attributes:
        objects: by digest; two that are alike in all, place included, are one.
        materials: by Blender's full names, those that triangles use.
    """

    objects: Mapping[str, ObjectState] = field(default_factory=dict)
    materials: Mapping[str, MaterialState] = field(default_factory=dict)

    @cached_property
    def fingerprint(self) -> str:
        """64 hexadecimal digits that change with any of it, but not with its order."""
        digest = hashlib.sha256()
        for key in sorted(self.objects):
            digest.update(f"{key}\n".encode())
        for name in sorted(self.materials):
            digest.update(f"{name}\n{self.materials[name].digest}\n".encode())
        return digest.hexdigest()

    def to_json(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        return {
            "objects": [
                [o.name, o.digest, o.shape, *o.low, *o.high] for o in self.objects.values()
            ],
            "materials": {n: [m.digest, m.feels_near] for n, m in self.materials.items()},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Surfaces:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        objects = [
            ObjectState(str(name), str(digest), str(shape), _point(box[:3]), _point(box[3:]))
            for name, digest, shape, *box in data["objects"]
        ]
        materials = {
            str(name): MaterialState(str(digest), bool(feels_near))
            for name, (digest, feels_near) in data["materials"].items()
        }
        return cls({o.digest: o for o in objects}, materials)


def _point(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def short_digest(*parts: bytes | str | NDArray[Any]) -> str:
    """The digest that states go by."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode() if isinstance(part, str) else part)
    return digest.digest()[:_DIGEST_BYTES].hex()


def object_states(geometry: SceneGeometry) -> list[ObjectState]:
    """The state of each of `geometry.object_names`; those of a crowd have one in common."""
    singles = _single_states(geometry)
    members: dict[str, list[int]] = {}
    for index, name in enumerate(geometry.object_names):
        members.setdefault(name, []).append(index)
    for name, indices in members.items():
        if len(indices) > CROWD:
            crowd = _joined(name, [singles[i] for i in indices])
            for index in indices:
                singles[index] = crowd
    return singles


def _single_states(geometry: SceneGeometry) -> list[ObjectState]:
    count = len(geometry.object_names)
    order: NDArray[np.int64] | None = None
    object_id = geometry.object_id
    if np.any(object_id[1:] < object_id[:-1]):
        order = np.argsort(object_id, kind="stable")
        object_id = object_id[order]
    ends = np.searchsorted(object_id, np.arange(count + 1))
    names = [name.encode() for name in geometry.material_names]
    result = []
    for index in range(count):
        some: Any = slice(ends[index], ends[index + 1])
        if order is not None:
            some = order[some]
        result.append(_single_state(geometry, index, some, names))
    return result


def _single_state(
    geometry: SceneGeometry, index: int, some: Any, material_names: list[bytes]
) -> ObjectState:
    """Of the triangles `some`, which are one object's."""
    name = geometry.object_names[index]
    triangles = geometry.triangles[some]
    if not len(triangles):
        return ObjectState(name, short_digest(name), "", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    # An object's vertices lie together; numbering them from 0 makes it independent of others.
    first, last = int(triangles.min()), int(triangles.max())
    points = geometry.vertices[first : last + 1]
    used, slot = np.unique(geometry.material_id[some], return_inverse=True)
    shape = short_digest(
        np.ascontiguousarray(points),
        np.ascontiguousarray(triangles - first),
        b"\0".join(material_names[i] for i in used),
        slot.astype(np.int32),
        np.ascontiguousarray(geometry.camera_visible[some]),
        np.ascontiguousarray(geometry.shadow_visible[some]),
    )
    state = geometry.object_states[index] if geometry.object_states else b""
    digest = short_digest(shape, state, name)
    touched = np.zeros(len(points), dtype=np.bool_)
    touched[(triangles - first).ravel()] = True
    corners = points if touched.all() else points[touched]
    low, high = _point(corners.min(axis=0)), _point(corners.max(axis=0))
    return ObjectState(name, digest, shape, low, high)


def _joined(name: str, states: list[ObjectState]) -> ObjectState:
    low = np.min([state.low for state in states], axis=0)
    high = np.max([state.high for state in states], axis=0)
    digest = short_digest(name, *sorted({state.digest for state in states}))
    shape = short_digest(*sorted({state.shape for state in states}))
    return ObjectState(name, digest, shape, _point(low), _point(high))
