# SPDX-License-Identifier: GPL-3.0-or-later
"""Unit planes in a row, a material on each, baked by one camera that looks down on them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from addon.caching.bake import BakeReport, BakeSettings, bake_scene
from addon.caching.channels import CHANNEL_BY_NAME
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry import SceneGeometry
from addon.scene.geometry_reader import read_geometry

from ..synthetic import looking_at

RESOLUTION = 64

# Half keeps 11 bits.
HALF = 2.0**-11


def empty_scene() -> Any:
    """A new file's scene, with nothing in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add_plane(
    scene: Any, name: str, center: tuple[float, float, float], material: Any, size: float = 1.0
) -> Any:
    """A square that faces up, its UV map from corner to corner."""
    mesh = bpy.data.meshes.new(name)
    half = 0.5 * size
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    if material is not None:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = center
    scene.collection.objects.link(obj)
    return obj


def empty_material(name: str) -> tuple[Any, Any]:
    """A material with nothing but an output, and that output's Surface input."""
    material = bpy.data.materials.new(name)
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    return material, output.inputs["Surface"]


def node_in(tree: Any, kind: str, **inputs: Any) -> Any:
    """A new node of a tree with values or links for its inputs (`Base_Color` is "Base Color")."""
    return set_inputs(tree, tree.nodes.new(kind), **inputs)


def set_inputs(tree: Any, node: Any, **inputs: Any) -> Any:
    """A node that is there, with values or links for its inputs."""
    for key, value in inputs.items():
        socket = node.inputs[key.replace("_", " ")]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
    return node


def camera_above(
    center: tuple[float, float, float], height: float, fov: float = 0.5 * np.pi, number: int = 0
) -> CachingCamera:
    """A camera over a point that looks straight down, its picture's top toward +Y."""
    place = (center[0], center[1], center[2] + height)
    return CachingCamera(
        id=number,
        world_from_camera=looking_at(place, center, (0, 1, 0)),
        fov=fov,
        near=0.01,
        far=100.0,
        resolution=RESOLUTION,
        kind="PERSPECTIVE",
        source=0,
    )


def geometry_of_scene(scene: Any) -> SceneGeometry:
    """What a render of the scene shows."""
    return with_render_depsgraph(scene, read_geometry)


def bake(
    scene: Any, cameras: list[CachingCamera], folder: Path, **settings: Any
) -> tuple[CacheStore, BakeReport]:
    """Bake the cameras and open the cache."""
    report = bake_scene(scene, geometry_of_scene(scene), cameras, folder, BakeSettings(**settings))
    return CacheStore.open(folder), report


def at(
    framebuffer: DeepFramebuffer, store: CacheStore, name: str, point: tuple[float, float, float]
) -> NDArray[np.float64]:
    """A channel, stored or constant, where a world point is seen."""
    plan = store.plan
    constant = plan.constant(name)
    if constant is not None:
        return np.array(constant)
    u, v, _ = framebuffer.camera.project(np.array(point, dtype=np.float64))
    column, row = (int(x * framebuffer.camera.resolution) for x in (u, v))
    if name in plan.material_constants:
        number = int(framebuffer.channels["material_id"][row, column, 0])
        return np.array(plan.material_constants[name][number - 1])
    values = framebuffer.channels[plan.same.get(name, name)][row, column].astype(np.float64)
    return np.broadcast_to(values, CHANNEL_BY_NAME[name].components).copy()
