# SPDX-License-Identifier: GPL-3.0-or-later
"""The set-ups of `benchmarks.accuracy`: every lobe in a cell of its own of one picture.

- sphere: a ball each.
- plane: a square each, turned so that it mirrors the light's centre to the viewer; that of the
  translucent lobe has the light behind.
- furnace: a patch each of a closed sphere's inside, with the light in its middle.

Each comes with and without occluders: quads between the light and each ball or square, bars
before the furnace's patches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from addon.camplace.camera import CachingCamera

from .accuracy_cases import LOBES, add_worlds

COLUMNS, ROWS = 6, 4
PIXELS = 32  # of a cell
SETUPS = tuple(f"{kind}{more}" for kind in ("sphere", "plane", "furnace") for more in ("", "+"))

_LAMP = np.array([-3.5, -6.0, 4.5])
_FURNACE_EYE, _FURNACE_RADIUS, _FURNACE_FOV = -2.6, 3.0, np.radians(90.0)


@dataclass(frozen=True)
class Setup:
    """One of them, in Blender's open file.

    Attributes:
        scene: the `bpy.types.Scene`, with its camera.
        caching: the camera that its cache is baked from.
        world_from_light: (4, 4) where lights go.
        scale: times the lights' sizes.
    """

    scene: Any
    caching: CachingCamera
    world_from_light: np.ndarray
    scale: float


def build(name: str) -> Setup:
    """Make a set-up in a new file; a "+" at its name's end is for occluders."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    materials = [_material(lobe, number) for number, lobe in enumerate(LOBES, start=1)]
    kind, occluded = name.removesuffix("+"), name.endswith("+")
    setup = (_furnace if kind == "furnace" else _grid)(scene, kind, materials, occluded)
    scene.render.resolution_x, scene.render.resolution_y = COLUMNS * PIXELS, ROWS * PIXELS
    # Through the pixels' centres: nothing is at an edge that is not there.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    add_worlds()
    return setup


def _material(name: str, number: int) -> Any:
    made: Any = bpy.data.materials.new(name)
    made.pass_index = number
    made.node_tree.nodes.clear()
    output = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
    made.node_tree.links.new(LOBES[name](made.node_tree), output.inputs["Surface"])
    return made


def _mesh(name: str, vertices: np.ndarray, faces: list[tuple[int, ...]]) -> Any:
    mesh: Any = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _quad(centre: np.ndarray, normal: np.ndarray, side: float) -> Any:
    normal = normal / np.linalg.norm(normal)
    right = np.cross([0.0, 0.0, 1.0], normal)
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    vertices = np.array([centre + 0.5 * side * (x * right + y * up) for x, y in corners])
    return _mesh("quad", vertices, [(0, 1, 2, 3)])


def _camera(scene: Any, **settings: Any) -> Any:
    data: Any = bpy.data.cameras.new("Camera")
    for key, value in settings.items():
        setattr(data, key, value)
    camera: Any = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_euler = (np.pi / 2, 0.0, 0.0)  # along +Y
    return camera


def _looking(eye: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(4, 4) whose -Z looks from `eye` at `at`."""
    back = (eye - at) / np.linalg.norm(eye - at)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = eye
    return matrix


def _grid(scene: Any, kind: str, materials: list[Any], occluded: bool) -> Setup:
    black: Any = bpy.data.materials.new("black")
    for index, material in enumerate(materials):
        row, column = divmod(index, COLUMNS)
        place = np.array([column + 0.5 - COLUMNS / 2, 0.0, row + 0.5 - ROWS / 2])
        toward = (_LAMP - place) / np.linalg.norm(_LAMP - place)
        if kind == "sphere":
            bpy.ops.mesh.primitive_uv_sphere_add(
                segments=64, ring_count=32, radius=0.45, location=place.tolist()
            )
            obj: Any = bpy.context.object
            obj.data.shade_smooth()
        else:
            # What light comes through has it behind.
            behind = material.name == "translucent"
            normal = np.array([0.0, -1.0, 0.0]) + (-toward if behind else toward)
            obj = _quad(place, normal, 0.9)
        obj.data.materials.append(material)
        if occluded:
            shade = _quad(place + 0.9 * toward, toward, 0.2)
            shade.data.materials.append(black)
            shade.visible_camera = False
    camera = _camera(scene, type="ORTHO", ortho_scale=float(COLUMNS))
    camera.location = (0.0, -20.0, 0.0)
    # From far away its rays are nearly as parallel as the view's.
    world_from_camera = np.array(_looking(np.array([0.0, -100.0, 0.0]), np.zeros(3)))
    fov = float(2.0 * np.arctan(0.51 * COLUMNS / 99.0))
    caching = CachingCamera(0, world_from_camera, fov, 50.0, 150.0, 1024, "PERSPECTIVE", 0)
    return Setup(scene, caching, _looking(_LAMP, np.zeros(3)), 1.0)


def _furnace(scene: Any, _kind: str, materials: list[Any], occluded: bool) -> Setup:
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=192, ring_count=96, radius=_FURNACE_RADIUS, rotation=(np.pi / 2, 0.0, 0.0)
    )
    bpy.ops.object.transform_apply(rotation=True)
    wall: Any = bpy.context.object
    wall.data.flip_normals()
    wall.data.shade_smooth()
    for material in materials:
        wall.data.materials.append(material)
    half = np.tan(0.5 * _FURNACE_FOV)
    for face in wall.data.polygons:
        x, y, z = face.center
        depth = max(y - _FURNACE_EYE, 1e-3) * half
        column = int(np.clip((x / depth * 0.5 + 0.5) * COLUMNS, 0, COLUMNS - 1))
        row = int(np.clip((z / depth * COLUMNS / ROWS * 0.5 + 0.5) * ROWS, 0, ROWS - 1))
        face.material_index = row * COLUMNS + column
    if occluded:
        for height in (-0.6, -0.2, 0.2, 0.6):
            bpy.ops.mesh.primitive_cube_add(location=(0.0, 1.2, height))
            bar: Any = bpy.context.object
            bar.scale = (1.6, 0.05, 0.05)
            bar.visible_camera = False
    camera = _camera(scene, angle=float(_FURNACE_FOV), sensor_fit="HORIZONTAL")
    camera.location = (0.0, _FURNACE_EYE, 0.0)
    eye = np.array([0.0, _FURNACE_EYE, 0.0])
    caching = CachingCamera(
        0, _looking(eye, np.zeros(3)), float(_FURNACE_FOV * 1.01), 0.05, 10.0, 1024,
        "PERSPECTIVE", 0)  # fmt: skip
    light = _looking(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    return Setup(scene, caching, light, 0.3)
