# SPDX-License-Identifier: GPL-3.0-or-later
"""What an evaluated scene's update means for a relight session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..scene.light_controls_reader import is_blocker
from .surface_edit_watch import OWNERS, is_edit_alone

_SHAPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
# An edit of a node tree is listed for its owner too: a light, a world or a material.
_SHADING = (bpy.types.Material, bpy.types.Texture, bpy.types.Image)


@dataclass(frozen=True)
class SceneChanges:
    """What to tell the session.

    Attributes:
        geometry: shapes moved, changed, came or went: everything is redone.
        lights: lights moved, changed, came or went: their layers are redone.
        world: the world's shading changed.
        materials: shading changed that is baked: the cache may be stale.
        edits: surface edits may have changed: every layer is redone if they have.
    """

    geometry: bool = False
    lights: bool = False
    world: bool = False
    materials: bool = False
    edits: bool = False

    def __or__(self, other: SceneChanges) -> SceneChanges:
        return SceneChanges(
            self.geometry or other.geometry,
            self.lights or other.lights,
            self.world or other.world,
            self.materials or other.materials,
            self.edits or other.edits,
        )

    def __bool__(self) -> bool:
        return self.geometry or self.lights or self.world or self.materials or self.edits


NOTHING = SceneChanges()


def read_changes(depsgraph: Any) -> SceneChanges:
    """The changes that the dependency graph lists since its last evaluation.

    An object that comes, goes or is hidden is not listed itself: compare `scene_key` for that.
    """
    changes = NOTHING
    for update in depsgraph.updates:
        changes = changes | _of_update(update)
    return changes


def _of_update(update: Any) -> SceneChanges:  # noqa: PLR0911 - one case for each type of ID
    changed = update.id
    if isinstance(changed, OWNERS) and is_edit_alone(changed):
        return SceneChanges(edits=True)
    if isinstance(changed, bpy.types.Object):
        moved = update.is_updated_transform
        if changed.type == "LIGHT":
            return SceneChanges(lights=True)
        blocks = moved and is_blocker(changed.original, bpy.data.lights)
        if changed.type in _SHAPES:
            shapes = moved or update.is_updated_geometry
            return SceneChanges(geometry=shapes, lights=blocks, edits=True)
        # An empty or an armature may instance or carry others.
        instances = changed.instance_type != "NONE" and moved
        return SceneChanges(geometry=instances, lights=instances or blocks)
    if isinstance(changed, bpy.types.Light):
        return SceneChanges(lights=True)
    if isinstance(changed, bpy.types.World):
        return SceneChanges(world=True)
    if isinstance(changed, _SHADING):
        # An image may be a light's slide too.
        image = isinstance(changed, bpy.types.Image)
        return SceneChanges(materials=True, lights=image, edits=True)
    return NOTHING


def scene_key(depsgraph: Any) -> int:
    """A number that changes when shapes or lights come, go, or are hidden or shown, to cameras
    or to lights' shadows too."""
    entries = []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if instance.show_self and (obj.type in _SHAPES or obj.type == "LIGHT"):
            shown = [
                (each.visible_camera, each.visible_shadow)
                for each in (obj, instance.parent)
                if each is not None
            ]
            entries.append((obj.original.session_uid, tuple(instance.persistent_id), *shown))
    return hash(tuple(entries))


def world_key(depsgraph: Any) -> tuple[int, bool]:
    """Changes when the scene gets another world, or its film lets the world through: neither
    lists a world."""
    scene = depsgraph.scene
    world = scene.world
    return (0 if world is None else world.session_uid), bool(scene.render.film_transparent)
