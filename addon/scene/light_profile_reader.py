# SPDX-License-Identifier: GPL-3.0-or-later
"""Has Cycles evaluate lights' nodes: a picture of what they emit in every direction.

A copy of the light, without extent, stands in the middle of a white ball in a scene of its own,
and a camera with it. What the nodes emit is the picture of the ball lit by the copy over the
picture of the ball lit by the same light without nodes: whatever the ball and the light's own
falloff do is in both. The open scene is not touched.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .depsgraph_reader import with_render_depsgraph
from .light import Light
from .light_nodes_reader import (
    MeasuredNodes,
    UnmeasuredLight,
    constant_emission,
    framing,
    is_fine,
    known,
    nodes_within,
    of_distance,
    of_extent,
    of_world,
    remember,
    stretch,
)
from .light_profile import LightProfile
from .light_reader import unmeasured_lights
from .temporary_render import render_to, temporary_folder
from .written_light import take_out

Pixels = NDArray[np.float64]

# Texels along the shorter side of pictures of textures: all around 0.35 degrees each.
FINE_HEIGHT = 512
# And of anything else. IES files tell an angle in some degrees.
HEIGHT = 256
# Of pictures that only tell how emission depends on the distance, or whether on the place.
_SMALL = 16
# Differences below are none: float32 through some nodes.
_SAME = 1e-5
# What a fitted falloff may be off before it is called another.
_FITTED = 5e-3
# Metres: half the side that stands for an area light's middle.
_POINT_SIZE = 1e-4


def measure_lights(scene: Any, lights: Sequence[UnmeasuredLight]) -> None:
    """Measure what is not known yet, at the scene's frame, and remember it.

    It renders, and so must not be called while something else does.

    Raises:
        InputError: there is no room for the pictures.
    """
    for each in lights:
        if known(each.key) is None:
            remember(each.key, each.light.name, _measure(scene, each.data, each.light))


def ensure_measured(scene: Any) -> None:
    """Measure whatever `read_lights` would lack in a render of a scene at its current frame.

    Only for background use, and not from within a render: it runs some itself.

    Raises:
        InputError: there is no room for the pictures.
    """
    if any(constant_emission(data) is None for data in bpy.data.lights):
        measure_lights(scene, with_render_depsgraph(scene, unmeasured_lights))


def _measure(scene: Any, data: Any, light: Light) -> MeasuredNodes:
    nodes = list(nodes_within(data.node_tree))
    problems = []
    half_width = framing(light)
    with _stage(scene, data, light, nodes) as stage:
        if light.type == "SUN":
            picture = stage.emission(_SMALL, 0.0, 1.0)
            return MeasuredNodes(np.asarray(picture.reshape(-1, 3).max(axis=0)))
        height = FINE_HEIGHT if is_fine(nodes) else HEIGHT
        picture = stage.emission(height, half_width, 1.0)
        exponent, smooth = 0.0, 0.0
        if of_distance(nodes):
            fitted = _fit_distance(stage, half_width)
            if fitted is None:
                problems.append(
                    "its nodes depend on the distance in a way that is not modelled; what they "
                    "give at one metre is used"
                )
            else:
                exponent, smooth = fitted
    if light.type == "AREA" and of_extent(nodes):
        problems.append("its nodes vary over its area; what they give in its middle is used")
    if light.has_disk and not light.use_soft_falloff:
        problems.append("its nodes are shaded as those of a light with soft falloff")
    color = picture.reshape(-1, 3).max(axis=0)
    spread = picture.reshape(-1, 3).max(axis=0) - picture.reshape(-1, 3).min(axis=0)
    if (spread <= _SAME * color.max()).all() and exponent == smooth == 0.0:
        return MeasuredNodes(color, None, tuple(problems))
    profile = LightProfile(picture.astype(np.float32), half_width, exponent, smooth)
    return MeasuredNodes(np.ones(3), profile, tuple(problems))


def _fit_distance(stage: _Stage, half_width: float) -> tuple[float, float] | None:
    """The exponent and smoothness of a LightProfile; None if they don't tell it."""
    radii = np.array([0.25, 1.0, 4.0, 16.0])
    pictures = np.stack([stage.emission(_SMALL, half_width, r) for r in radii])
    brightest = pictures[1] > 0.5 * pictures[1].max()
    gains = np.array([picture[brightest].mean() for picture in pictures])
    if not gains[1] > 0.0:
        return 0.0, 0.0
    gains /= gains[1]
    for exponent in (0.0, 1.0, 2.0):
        # g(r) = r^e (1 + s) r^2 / (s + r^2), solved for s at the first radius.
        ratio, r = gains[0] / radii[0] ** exponent, radii[0]
        smooth = r * r * (1.0 - ratio) / max(ratio - r * r, 1e-30) if ratio < 1.0 - _FITTED else 0.0
        if smooth < 0.0:
            continue
        wanted = radii**exponent * (1.0 + smooth) * radii**2 / (smooth + radii**2)
        shown = pictures / wanted[:, None, None, None]
        if np.abs(shown - shown[1]).max() <= _FITTED * shown[1].max():
            return exponent, float(smooth)
    return None


class _Stage:
    """The scene with the ball."""

    def __init__(self, scene: Any, ball: Any, camera: Any, data: Any, folder: Path) -> None:
        self._scene, self._ball, self._camera, self._data = scene, ball, camera, data
        self._path = folder / "light.exr"
        self._emission = data.node_tree.nodes.new("ShaderNodeEmission")

    def emission(self, height: int, half_width: float, radius: float) -> Pixels:
        """(H, W, 3) what the nodes emit, 0 where the light does not shine."""
        self._look(height, half_width)
        self._ball.scale = (radius, radius, radius)
        shown = self._render()
        with self._plain():
            plain = self._render()
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(plain > 0.0, shown / plain, 0.0)
        if self._data.type == "AREA" and half_width == 0.0:
            _continue_behind(ratio)
        return ratio

    def _look(self, height: int, half_width: float) -> None:
        render, data = self._scene.render, self._camera.data
        render.resolution_y = height
        render.resolution_x = height if half_width > 0.0 else 2 * height
        if half_width > 0.0:
            data.type, data.sensor_width = "PERSP", 36.0
            data.lens = 18.0 / half_width
        else:
            data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"

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
def _stage(scene: Any, data: Any, light: Light, nodes: list[Any]) -> Iterator[_Stage]:
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
        with temporary_folder() as folder:
            yield _Stage(stage, ball, camera, copy, folder)
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
