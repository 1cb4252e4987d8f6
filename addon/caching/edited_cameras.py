# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads caching cameras back from the scene, with what the artist did to them.

Also where the extension's properties are not registered, as on the command line.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..camplace.camera import WIDEST, CachingCamera
from ..camplace.settings import RESOLUTIONS
from ..errors import InputError
from ..scene.caching_collection_reader import CACHING_MARK, caching_collection
from ..scene.object_matrix_reader import world_from_object
from ..scene.view_reader import rigid

# Place's result, read by Bake, kept beside what it was baked into.
PLACEMENT_NAME = "cameras.json"

# Blender holds float32 values, and makes a transform of several of them: a few roundings of 6e-8
# for a place, and some more for a rotation, which goes through angles. No artist changes so little.
SAME_PLACE = 5e-7
SAME_VALUE = 1e-5

# Custom property of a camera that the artist put into the collection: its number in the cache.
OWN_MARK = "relume_own_camera"


def drawn_resolution(resolution: int) -> int:
    """The tier that a camera object shows for a number of texels along a side."""
    return next((tier for tier in RESOLUTIONS if tier >= resolution), RESOLUTIONS[-1])


def number_own(collection: Any, placed: Sequence[CachingCamera]) -> None:
    """Give the artist's own cameras in the collection numbers of their own, for good."""
    for number, obj in _numbered(collection, placed).items():
        if CACHING_MARK not in obj or obj[CACHING_MARK] != number:
            obj.pop(CACHING_MARK, None)  # a copy of a placed camera is the artist's
            obj[OWN_MARK] = number


def own_numbers(collection: Any) -> frozenset[int]:
    """The numbers that `number_own` gave."""
    return frozenset(obj[OWN_MARK] for obj in collection.all_objects if OWN_MARK in obj)


def forget_own(collection: Any, numbers: Collection[int]) -> None:
    """Let the artist's cameras of these numbers be numbered anew."""
    for obj in collection.all_objects:
        if obj.get(OWN_MARK) in numbers:
            del obj[OWN_MARK]


def edited_cameras(
    depsgraph: Any,
    scene: Any,
    placed: Sequence[CachingCamera],
    largest: int = RESOLUTIONS[-1],
    baked: Sequence[CachingCamera] = (),
) -> tuple[CachingCamera, ...] | None:
    """The cameras in the scene's collection by their numbers; None without a collection.

    A camera that was not touched is the placed one to the last bit, so that what is baked of it
    stays current. One that the artist added gets the next free number.

    Args:
        depsgraph: the scene's evaluated one.
        scene: a `bpy.types.Scene`.
        placed: what was shown in the collection last; may be empty.
        largest: resolutions count as the same that are the same up to here.
        baked: a cache's cameras. One that stands as it is baked is that to the last bit too:
            what two computers read of one edit may differ in it.

    Raises:
        InputError: the collection holds no camera, or one that cannot be baked.
    """
    collection = caching_collection(scene)
    if collection is None:
        return None
    numbered = _numbered(collection, placed)
    if not numbered:
        raise InputError(
            f"the collection '{collection.name}' holds no camera; place again, or delete it"
        )
    known = {number: [c for c in (*placed, *baked) if c.id == number] for number in numbered}
    return tuple(
        _read(depsgraph, scene, obj, number=number, known=known[number], largest=largest)
        for number, obj in sorted(numbered.items())
    )


def _numbered(collection: Any, placed: Sequence[CachingCamera]) -> dict[int, Any]:
    """The collection's camera objects by their numbers; new ones get the next free numbers."""
    cameras = (obj for obj in collection.all_objects if obj.type == "CAMERA")
    numbered: dict[int, Any] = {}
    added = []
    for obj in sorted(cameras, key=lambda obj: str(obj.name)):
        number = obj.get(CACHING_MARK, obj.get(OWN_MARK))
        # A copy has the number of what it was copied from, and a later name.
        if isinstance(number, int) and number not in numbered:
            numbered[number] = obj
        else:
            added.append(obj)
    free = max([*numbered, *(camera.id for camera in placed), -1]) + 1
    return numbered | dict(enumerate(added, start=free))


def _read(
    depsgraph: Any,
    scene: Any,
    obj: Any,
    *,
    number: int,
    known: Sequence[CachingCamera],
    largest: int,
) -> CachingCamera:
    data = obj.data
    if data.type != "PERSP":
        raise InputError(
            f"caching camera '{obj.name}' is {data.type.lower()}; make it a perspective camera, "
            "or take it out of its collection"
        )
    if not data.clip_start < data.clip_end:
        raise InputError(f"caching camera '{obj.name}' ends before it begins; mend its clips")
    matrix = rigid(world_from_object(depsgraph, obj), f"caching camera '{obj.name}'")
    if np.linalg.det(matrix[:3, :3]) < 0.0:  # a mirrored object: its picture is not
        matrix[:3, 0] *= -1.0
    read = CachingCamera(
        id=number,
        world_from_camera=matrix,
        fov=_fov(depsgraph, scene, obj),
        near=float(data.clip_start),
        far=float(data.clip_end),
        resolution=_resolution(data),
        kind=known[0].kind if known else "PERSPECTIVE",
        source=known[0].source if known else number,
    )
    same = next((camera for camera in known if _untouched(read, camera, largest)), read)
    if drawn_resolution(same.resolution) == read.resolution:
        return same
    return replace(same, resolution=read.resolution)  # a preset's limit made it the same


def _resolution(data: Any) -> int:
    """The tier of `bpy.types.Camera.relume`; Blender keeps an enumeration's number in the file."""
    if hasattr(data, "relume"):
        return int(data.relume.resolution)
    kept = data.bl_system_properties_get()
    group = None if kept is None else kept.get("relume")
    number = None if group is None else group.get("resolution")
    return RESOLUTIONS[-1] if number is None else RESOLUTIONS[number]


def _fov(depsgraph: Any, scene: Any, obj: Any) -> float:
    """The angle of the square picture that holds what the camera shows at the render's shape."""
    render = scene.render
    matrix = obj.calc_matrix_camera(
        depsgraph,
        x=render.resolution_x,
        y=render.resolution_y,
        scale_x=render.pixel_aspect_x,
        scale_y=render.pixel_aspect_y,
    )
    fov = 2.0 * float(np.arctan(1.0 / min(matrix[0][0], matrix[1][1])))
    if fov > WIDEST * (1.0 + SAME_VALUE):
        raise InputError(
            f"caching camera '{obj.name}' sees {np.degrees(fov):.0f} degrees wide, of which Relume "
            f"bakes {np.degrees(WIDEST):.0f} at most; give it a longer lens"
        )
    return min(fov, float(WIDEST))


def _untouched(read: CachingCamera, placed: CachingCamera, largest: int) -> bool:
    """Whether Blender's float32 values are those of the placed camera."""
    moved = float(np.abs(read.origin - placed.origin).max())
    turned = float(np.abs(read.world_from_camera - placed.world_from_camera)[:3, :3].max())
    now, then = ((c.fov, c.near, c.far) for c in (read, placed))
    return bool(
        moved <= SAME_PLACE * max(placed.far, float(np.abs(placed.origin).max()))
        and turned <= SAME_VALUE
        and np.allclose(now, then, rtol=SAME_VALUE, atol=0.0)
        and min(read.resolution, largest) == min(drawn_resolution(placed.resolution), largest)
    )
