# SPDX-License-Identifier: GPL-3.0-or-later
"""A made scene to time: rows of subdivided heads before a wall, under any number of lights."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

# Blender's monkey has so many triangles, four times as many with each subdivision; before that
# its quads count twice and its triangles thrice.
_TRIANGLES = (968, 3936, 15744, 62976, 251904)

_COLUMNS = 4


def build(triangles: int, lights: int, out: Path) -> int:
    """Save a scene of about so many triangles; gives how many it has.

    The heads are instances of one mesh, with a bumpy plastic, a metal and a rough clay in turn.
    The lights are spots, areas and points in turn; the first is "Key", the one to edit.
    """
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    # The finest head of which a few are enough, and never fewer than three.
    level = max((n for n, each in enumerate(_TRIANGLES) if 12 * each <= triangles), default=0)
    count = max(3, round(triangles / _TRIANGLES[level]))
    meshes = [_head(level, material) for material in _materials()]
    columns = max(_COLUMNS, math.ceil(math.sqrt(count)))
    step = 2.0 * _COLUMNS / columns
    for number in range(count):
        row, column = divmod(number, columns)
        head = bpy.data.objects.new(f"Head {number}", meshes[number % len(meshes)])
        head.location = ((column - 0.5 * (columns - 1)) * 1.5 * step, row * 1.5 * step, 0.5 * step)
        head.scale = (0.5 * step,) * 3
        head.rotation_euler = (0.0, 0.0, 0.35 * math.sin(2.4 * number))
        scene.collection.objects.link(head)
    depth = 1.5 * step * (count - 1) / columns
    bpy.ops.mesh.primitive_plane_add(size=60.0)
    bpy.context.object.data.materials.append(meshes[2].materials[0])
    bpy.ops.mesh.primitive_plane_add(
        size=60.0, location=(0.0, depth + 4.0, 0.0), rotation=(math.pi / 2.0, 0.0, 0.0)
    )
    bpy.context.object.data.materials.append(meshes[2].materials[0])
    for number in range(lights):
        _light(scene, number, lights, depth)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 35.0
    camera.location = (0.0, -11.0, 4.5)
    camera.rotation_euler = (math.radians(71.0), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(out))
    return count * _TRIANGLES[level] + 4


def _materials() -> list[Any]:
    import bpy

    kinds: list[tuple[str, dict[str, Any]]] = [
        ("Plastic", {"Base Color": (0.7, 0.15, 0.1, 1.0), "Roughness": 0.35}),
        ("Metal", {"Base Color": (0.9, 0.7, 0.4, 1.0), "Roughness": 0.3, "Metallic": 1.0}),
        ("Clay", {"Base Color": (0.6, 0.6, 0.6, 1.0), "Roughness": 0.9}),
    ]
    made = []
    for name, inputs in kinds:
        material: Any = bpy.data.materials.new(name)
        material.use_nodes = True
        node = material.node_tree.nodes["Principled BSDF"]
        for socket, value in inputs.items():
            node.inputs[socket].default_value = value
        made.append(material)
    return made


def _head(level: int, material: Any) -> Any:
    import bpy

    bpy.ops.mesh.primitive_monkey_add()
    head = bpy.context.object
    modifier: Any = head.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = level
    bpy.ops.object.shade_smooth()
    if level:
        bpy.ops.object.modifier_apply(modifier="Subdivision")
    mesh = head.data
    bpy.data.objects.remove(head)
    mesh.materials.append(material)
    return mesh


def _light(scene: Any, number: int, lights: int, depth: float) -> None:
    import bpy

    kind = ("SPOT", "AREA", "POINT")[number % 3]
    name = "Key" if number == 0 else f"{kind.title()} {number}"
    data: Any = bpy.data.lights.new(name, kind)
    data.energy = 4000.0 / lights
    if kind == "AREA":
        data.size = 0.8
    else:
        data.shadow_soft_size = 0.1
    if kind == "SPOT":
        data.spot_size = math.radians(75.0)
        data.spot_blend = 0.4
    light = bpy.data.objects.new(name, data)
    around = 2.0 * math.pi * number / lights - 2.2
    light.location = (6.0 * math.cos(around), 0.4 * depth + 6.0 * math.sin(around), 6.0)
    toward = math.atan2(0.4 * depth - light.location.y, -light.location.x)
    light.rotation_euler = (math.radians(45.0), 0.0, toward - math.pi / 2.0)
    scene.collection.objects.link(light)
