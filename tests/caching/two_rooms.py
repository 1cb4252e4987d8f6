# SPDX-License-Identifier: GPL-3.0-or-later
"""Two rooms with a wall between, a caching camera in each, and things to change in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from addon.caching.bake import BakeReport, BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera

from ..synthetic import box, looking_at
from .material_grid import empty_material, empty_scene, geometry_of_scene, node_in

RESOLUTION = 48
# Camera ids: from the middle of each room's ceiling down on the floor, and over it to the wall.
LEFT, LEFT_WALL, RIGHT, RIGHT_WALL = range(4)
ALL = (LEFT, LEFT_WALL, RIGHT, RIGHT_WALL)


def add_box(name: str, center: tuple[float, float, float], size: float, material: Any) -> Any:
    """A cube in the open scene."""
    corners, faces = box((0.0, 0.0, 0.0), size)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners.tolist(), [], faces.tolist())
    mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = center
    bpy.context.scene.collection.objects.link(obj)
    return obj


def paint(name: str, color: tuple[float, float, float]) -> Any:
    """A diffuse material."""
    material, surface = empty_material(name)
    node = node_in(material.node_tree, "ShaderNodeBsdfDiffuse", Color=color)
    material.node_tree.links.new(node.outputs[0], surface)
    return material


def set_color(name: str, color: tuple[float, float, float]) -> None:
    """Edit the material `name` that `paint` made."""
    node = bpy.data.materials[name].node_tree.nodes["Diffuse BSDF"]
    node.inputs["Color"].default_value = (*color, 1.0)


def two_rooms() -> Any:
    """Rooms of 4 m about x = -2.1 and x = 2.1, a ball in each; the walls are two boxes."""
    scene = empty_scene()
    grey = paint("Grey", (0.5, 0.4, 0.3))
    for side, x in (("left", -2.1), ("right", 2.1)):
        add_box(f"Room {side}", (x, 0.0, 0.0), 4.0, grey)
        color = (0.8, 0.1, 0.1) if side == "left" else (0.1, 0.1, 0.8)
        add_box(f"Ball {side}", (x, 0.5, -1.0), 0.6, paint(f"Paint {side}", color))
    return scene


def cameras() -> list[CachingCamera]:
    """Two in each room: one sees the ball, the other the ceiling and a wall only."""
    result = []
    for number in ALL:
        x = -2.1 if number in {LEFT, LEFT_WALL} else 2.1
        # The ball is below; the second one looks up and away.
        target = (x, 0.5, -1.9) if number in {LEFT, RIGHT} else (x, -1.9, 1.0)
        matrix = looking_at((x, 0.0, 1.0), target, (1.0, 0.0, 0.0))
        result.append(
            CachingCamera(number, matrix, 0.9, 0.01, 20.0, RESOLUTION, "PERSPECTIVE", number)
        )
    return result


def bake(scene: Any, folder: Path, settings: BakeSettings | None = None) -> BakeReport:
    """Bake the scene as it is now."""
    chosen = settings or BakeSettings("draft")
    return bake_scene(scene, geometry_of_scene(scene), cameras(), folder, chosen)


def bake_again(scene: Any, folder: Path) -> BakeReport:
    """Bake what a change made necessary."""
    return bake(scene, folder, BakeSettings("draft", resume=True))


def assert_as_fresh(scene: Any, folder: Path, fresh: Path) -> None:
    """Every picture of a cache is that of a fresh bake, bit for bit; materials may be numbered
    otherwise, so that their names are compared."""
    bake(scene, fresh)
    assert_same(CacheStore.open(folder), CacheStore.open(fresh))


def assert_same(one: CacheStore, other: CacheStore) -> None:
    """Two caches show the same."""
    assert [c.id for c in one.cameras] == [c.id for c in other.cameras]
    for camera in one.cameras:
        mine, theirs = one.read_camera(camera.id), other.read_camera(camera.id)
        assert mine.channels.keys() == theirs.channels.keys()
        for name, pixels in mine.channels.items():
            if name == "material_id":
                named = [
                    np.array(["", *store.plan.material_names])[picture.channels[name].astype(int)]
                    for store, picture in ((one, mine), (other, theirs))
                ]
                assert np.array_equal(*named), f"camera {camera.id}"
            else:
                assert np.array_equal(pixels, theirs.channels[name]), f"camera {camera.id} {name}"
