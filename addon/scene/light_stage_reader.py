# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene in which Cycles shows what a light's nodes emit.

A copy of the light, without extent, stands in the middle of a white ball in a scene of its own,
and a camera with it. What the nodes emit is the picture of the ball lit by the copy over the
picture of the ball lit by the same light without nodes: whatever the ball and the light's own
falloff do is in both. The open scene is not touched.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..temporary_folder import TemporaryFolder
from .light import Light
from .light_nodes_reader import of_extent, of_world, stretch
from .temporary_render import render_to
from .written_light import take_out

Pixels = NDArray[np.float64]

# Along each side of an area light, a power of 2.
AREA_SIDE = 64
# Metres: half the side that stands for an area light's middle.
_POINT_SIZE = 1e-4


class LightStage:
    """The scene with the ball."""

    def __init__(self, scene: Any, ball: Any, camera: Any, lamp: Any, folder: Path) -> None:
        self._scene, self._ball, self._camera, self._lamp = scene, ball, camera, lamp
        self._data = data = lamp.data
        self._path = folder / "light.exr"
        self._emission = data.node_tree.nodes.new("ShaderNodeEmission")

    def emission(self, height: int, half_width: float, radius: float) -> Pixels:
        """(H, W, 3) what the nodes emit, 0 where the light does not shine."""
        self._look(height, half_width)
        self._ball.scale = (radius, radius, radius)
        ratio = self._ratio()
        if self._data.type == "AREA" and half_width == 0.0:
            _continue_behind(ratio)
        return ratio

    def area(self, light: Light, in_world: bool) -> Pixels:
        """(AREA_SIDE, AREA_SIDE, 3) what an area light itself shows to one that looks at it."""
        lamp, data = self._lamp, self._data
        sides = (
            light.size,
            light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size,
        )
        data.shape, (data.size, data.size_y) = "RECTANGLE", sides
        matrix = light.world_from_light if in_world else np.eye(4)
        lamp.matrix_world, lamp.visible_camera, self._ball.hide_render = matrix.T, True, True
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        width, height = (float(side) for side in np.array(sides) * scale[:2])
        x, y, z = (matrix[:3, :3] / scale).T
        # It shines down its -Z: from there its X goes to the left, unless it is mirrored.
        right = np.cross(y, -z)
        # One metre, as tables of directions are for.
        eye = matrix[:3, 3] - z
        camera = np.eye(4)
        camera[:3] = np.stack([right, y, -z, eye], axis=1)
        self._camera.matrix_world = camera.T
        view, render = self._camera.data, self._scene.render
        view.type, view.ortho_scale, view.sensor_fit = "ORTHO", width, "HORIZONTAL"
        view.clip_start, view.clip_end = 1e-6, 1e6
        render.resolution_x = render.resolution_y = AREA_SIDE
        render.pixel_aspect_x, render.pixel_aspect_y = (
            max(1.0, width / height),
            max(1.0, height / width),
        )
        picture = self._ratio()
        return picture[:, ::-1] if right @ x < 0.0 else picture

    def _look(self, height: int, half_width: float) -> None:
        render, data = self._scene.render, self._camera.data
        render.resolution_y = height
        render.resolution_x = height if half_width > 0.0 else 2 * height
        if half_width > 0.0:
            data.type, data.sensor_width = "PERSP", 36.0
            data.lens = 18.0 / half_width
        else:
            data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"

    def _ratio(self) -> Pixels:
        shown = self._render()
        with self._plain():
            plain = self._render()
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(plain > 0.0, shown / plain, 0.0)

    @contextmanager
    def _plain(self) -> Iterator[None]:
        """The light without its nodes."""
        tree = self._data.node_tree
        surfaces = [n.inputs[0] for n in tree.nodes if n.bl_idname == "ShaderNodeOutputLight"]
        kept = [(s, s.links[0].from_socket) for s in surfaces if s.is_linked]
        for surface in surfaces:
            tree.links.new(self._emission.outputs[0], surface)
        yield
        for surface in surfaces:
            for link in list(surface.links):
                tree.links.remove(link)
        for surface, source in kept:
            tree.links.new(source, surface)

    def _render(self) -> Pixels:
        render = self._scene.render
        width, height = render.resolution_x, render.resolution_y
        render.filepath = str(self._path)
        size = width * height * 3 * np.dtype(np.float32).itemsize
        render_to(self._path, size, "what a light's nodes emit", scene=self._scene.name)
        picture = bpy.data.images.load(str(self._path))
        try:
            pixels = np.empty(width * height * 4, dtype=np.float32)
            picture.pixels.foreach_get(pixels)
        finally:
            bpy.data.images.remove(picture)
        return pixels.reshape(height, width, 4)[..., :3].astype(np.float64)


def _continue_behind(picture: Pixels) -> None:
    """Let what an area light emits go on behind it, so that its edge is not mixed with black."""
    quarter = picture.shape[1] // 4
    picture[:, :quarter] = picture[:, quarter : quarter + 1]
    picture[:, -quarter:] = picture[:, -quarter - 1 : -quarter]


@contextmanager
def light_stage(scene: Any, data: Any, light: Light, nodes: list[Any]) -> Iterator[LightStage]:
    """A stage for a light, removed at the end.

    Args:
        scene: the `bpy.types.Scene` that the light is in.
        data: the `bpy.types.Light`.
        light: as it was read.
        nodes: those that have a say in what it emits.
    """
    stage = bpy.data.scenes.new("Relume light")
    copy = data.copy()
    camera_data = bpy.data.cameras.new("Relume light")
    ball_data, white = _ball()
    camera = bpy.data.objects.new("Relume light", camera_data)
    ball = bpy.data.objects.new("Relume light", ball_data)
    lamp = bpy.data.objects.new("Relume light", copy)
    try:
        place = light.world_from_light if of_world(nodes) else stretch(light)
        _strip(copy, light, nodes)
        for obj in (camera, ball, lamp):
            stage.collection.objects.link(obj)
        stage.camera = camera
        lamp.matrix_world = place.T
        camera.matrix_world = _facing(light, place).T
        ball.location = place[:3, 3]
        stage.frame_set(scene.frame_current)
        _set_up(stage)
        with TemporaryFolder() as folder:
            yield LightStage(stage, ball, camera, lamp, folder)
    finally:
        bpy.data.scenes.remove(stage)
        for obj in (camera, ball, lamp):
            bpy.data.objects.remove(obj)
        bpy.data.cameras.remove(camera_data)
        bpy.data.meshes.remove(ball_data)
        bpy.data.materials.remove(white)
        bpy.data.lights.remove(copy)


def _facing(light: Light, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) a camera that looks along light space's axes where the light is placed."""
    matrix = np.eye(4)
    if not np.array_equal(place, stretch(light)):
        matrix[:3, :3] = light.axes.T
    matrix[:3, 3] = place[:3, 3]
    return matrix


def _strip(copy: Any, light: Light, nodes: list[Any]) -> None:
    """Leave of a light its nodes, and a plain light that shines all around where it may."""
    take_out(copy.node_tree)
    copy.animation_data_clear()
    # The cone has no say in what the nodes emit, but for the place in it.
    if light.type == "SPOT" and not of_extent(nodes):
        copy.type = "POINT"
    if copy.type == "SPOT":
        copy.spot_blend = 0.0
    if copy.type in ("POINT", "SPOT"):
        copy.shadow_soft_size = 0.0
    elif copy.type == "SUN":
        copy.angle = 0.0
    else:
        copy.shape, copy.size = "SQUARE", 2.0 * _POINT_SIZE
        copy.spread = np.pi
        copy.cycles.is_portal = False
    copy.use_temperature, copy.normalize, copy.use_shadow = False, True, False
    copy.energy, copy.exposure, copy.color = 100.0, 0.0, (1.0, 1.0, 1.0)


def _ball() -> tuple[Any, Any]:
    """A mesh and its material: off a sphere by a 1500th."""
    import bmesh

    mesh = bpy.data.meshes.new("Relume light")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=5, radius=1.0)
    bmesh.ops.reverse_faces(shape, faces=shape.faces)
    shape.to_mesh(mesh)
    shape.free()
    material = bpy.data.materials.new("Relume light")
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
    mesh.materials.append(material)
    return mesh, material


def _set_up(stage: Any) -> None:
    render, cycles = stage.render, stage.cycles
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.use_file_extension = False
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = False
    render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    cycles.device = "CPU"
    cycles.samples = 1
    cycles.max_bounces = 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = 0.0
    cycles.light_sampling_threshold = 0.0
    # The direction of a texel is its middle's.
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
