# SPDX-License-Identifier: GPL-3.0-or-later
"""A white floor with two balls, lit by one light without shadows, as Cycles renders it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class CyclesStage:
    """A new scene with a camera above a floor and balls, all of them white and diffuse.

    Attributes:
        scene: the `bpy.types.Scene`.
        light: the object of its only light.
        objects: (H, W) float32 of the last picture, a number for each object.
    """

    def __init__(self, kind: str, folder: Path, size: int = 64) -> None:
        import bpy

        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene: Any = bpy.context.scene
        self._path = folder / "stage.exr"
        white = _white()
        _mesh(bpy.ops.mesh.primitive_plane_add(size=6.0), white)
        _mesh(bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0.7, 0.2, 0.5)), white)
        _mesh(bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(-0.6, -0.5, 0.3)), white)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.location, camera.rotation_euler = (0.0, -3.5, 4.0), (0.72, 0.0, 0.0)
        data: Any = bpy.data.lights.new("Key", kind)
        data.energy, data.use_shadow = 100.0, False
        if kind in ("POINT", "SPOT"):
            data.shadow_soft_size = 0.0
        if kind == "SUN":
            data.angle = 0.0
        if kind == "SPOT":
            data.spot_size, data.spot_blend = 2.4, 0.3
        self.light: Any = bpy.data.objects.new("Key", data)
        self.light.location, self.light.rotation_euler = (0.4, -0.6, 2.2), (0.25, 0.2, 0.4)
        for obj in (camera, self.light):
            self.scene.collection.objects.link(obj)
        self.scene.camera = camera
        self._set_up(size)
        self.objects: NDArray[np.float32] = np.zeros((size, size), dtype=np.float32)

    def _set_up(self, size: int) -> None:
        from tools.reference import prepare

        prepare(self.scene)
        scene = self.scene
        scene.render.resolution_x = scene.render.resolution_y = size
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
        layer = scene.view_layers[0]
        layer.use_pass_position = layer.use_pass_normal = True
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
        scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
        scene.render.image_settings.color_depth = "32"
        scene.render.filepath, scene.render.use_file_extension = str(self._path), False

    def render(self, samples: int = 1) -> tuple[Array, Array, Array]:
        """(H, W, 3) each: radiance, positions and normals, row 0 at the bottom."""
        from addon.scene.temporary_render import render_to
        from tools.picture_file import read_picture

        self.scene.cycles.samples = samples
        render_to(self._path, 1000, "the stage")
        picture = read_picture(self._path)

        def of(name: str) -> Array:
            found = [
                next(v for k, v in picture.extra.items() if k.endswith(f".{name}.{axis}"))
                for axis in "XYZ"
            ]
            return np.stack(found, axis=-1).astype(np.float64)

        self.objects = next(v for k, v in picture.extra.items() if k.endswith(".Object Index.X"))
        return picture.rgb.astype(np.float64), of("Position"), of("Normal")


def _white() -> Any:
    import bpy

    material: Any = bpy.data.materials.new("White")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
    return material


def _mesh(_: Any, material: Any) -> None:
    """The object that was added last is of this material."""
    import bpy

    obj: Any = bpy.context.object
    obj.data.materials.append(material)
    obj.data.shade_smooth()
