# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells the shot's own cameras from the caching cameras that are shown beside them."""

from __future__ import annotations

from typing import Any

# Custom property of the collection that holds caching cameras, whatever it is renamed to; and of
# each of them that was placed, with its number.
CACHING_MARK = "relume_caching_camera"


def caching_collection(scene: Any) -> Any | None:
    """The scene's collection of caching cameras, wherever it hangs; None without one."""
    found = (c for c in scene.collection.children_recursive if CACHING_MARK in c)
    return next(found, None)


def caching_objects(scene: Any) -> list[Any]:
    """The camera objects in the scene's collection of caching cameras."""
    collection = caching_collection(scene)
    if collection is None:
        return []
    return [obj for obj in collection.all_objects if obj.type == "CAMERA"]


def shot_cameras(scene: Any) -> list[Any]:
    """The camera objects of a `bpy.types.Scene` by name, without the caching cameras.

    A camera that is linked into their collection too is both.
    """
    collection = caching_collection(scene)
    cameras = [obj for obj in scene.objects if obj.type == "CAMERA"]
    if collection is not None:
        inside = {collection, *collection.children_recursive}
        cameras = [obj for obj in cameras if not inside.issuperset(obj.users_collection)]
    return sorted(cameras, key=lambda obj: str(obj.name))
