# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a scene's world, and renders the picture of one that varies with direction."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..temporary_folder import TemporaryFolder
from .node_reader import constant_color, constant_value, output_source, source_of
from .temporary_render import render_to
from .tree_lines_reader import tree_lines
from .world import World

# Rows of a world's picture. 512 rows are a third of a degree each, finer than a pixel of most
# views; a sun of half a degree is still more than one texel.
PICTURE_HEIGHT = 512


def read_world(depsgraph: Any) -> World | None:
    """The world of a dependency graph's scene; None when it is black, unless the film lets it
    through.

    A world that varies with direction comes back without its picture (`World.needs_baking`).
    """
    scene = depsgraph.scene_eval
    world = scene.world
    visibility = getattr(world, "cycles_visibility", None)
    result = World(
        radiance=None,
        camera_visible=visibility is None or bool(visibility.camera),
        diffuse_visible=visibility is None or bool(visibility.diffuse),
        glossy_visible=visibility is None or bool(visibility.glossy),
        film_transparent=bool(scene.render.film_transparent),
    )
    if world is None:
        return _constant(result, np.zeros(3))
    if not world.use_nodes or world.node_tree is None:
        return _constant(result, np.array(world.color, dtype=np.float64))
    node = output_source(world.node_tree, "ShaderNodeOutputWorld")
    if node is None:
        return _constant(result, np.zeros(3))
    if node.bl_idname == "ShaderNodeBackground" and not node.mute:
        color = constant_color(node.inputs["Color"])
        strength = constant_value(node.inputs["Strength"])
        if strength == 0.0:
            return _constant(result, np.zeros(3))
        if color is not None and strength is not None:
            return _constant(result, color * strength)
    return replace(result, fingerprint=world_fingerprint(depsgraph.scene))


def world_warnings(depsgraph: Any) -> tuple[str, ...]:
    """A sentence for each thing about the scene's world, black or not, and its film that is not
    modelled."""
    # Cycles may be switched off; the evaluated scene need not hear of its settings.
    cycles = getattr(depsgraph.scene, "cycles", None)
    exposure = getattr(cycles, "film_exposure", 1.0)
    film: tuple[str, ...] = ()
    if exposure != 1.0:
        film = (
            f"Cycles' film exposure of {exposure:.4g} is not shown; use Color Management's instead",
        )
    world = depsgraph.scene_eval.world
    if world is None or world.node_tree is None:
        return film
    output = world.node_tree.get_output_node("CYCLES") or world.node_tree.get_output_node("ALL")
    if output is None or source_of(output.inputs["Volume"]) is None:
        return film
    return (*film, f"world '{world.name}': its volume is not shown")


def world_fingerprint(scene: Any) -> str:
    """64 hexadecimal digits for the world of a `bpy.types.Scene`; "" when it has none."""
    world = scene.world
    if world is None:
        return ""
    digest = hashlib.sha256(repr(tuple(world.color)).encode())
    if world.node_tree is not None:
        for line in tree_lines(world.node_tree):
            digest.update(line.encode())
    return digest.hexdigest()


def _constant(world: World, radiance: NDArray[np.float64]) -> World | None:
    constant = replace(world, radiance=radiance)
    return None if constant.is_black and not world.film_transparent else constant


def render_world(scene: Any, height: int = PICTURE_HEIGHT) -> NDArray[np.float32]:
    """The scene's world as Cycles sees it: (height, 2 height, 3) float32, equirectangular.

    Renders an empty scene that has the same world with a panoramic camera, and removes it
    again; the open scene is not touched. Row 0 looks straight down.
    """
    stage = bpy.data.scenes.new("Relume world")
    camera_data = bpy.data.cameras.new("Relume world")
    camera = bpy.data.objects.new("Relume world", camera_data)
    picture = None
    try:
        stage.world = scene.world
        stage.frame_set(scene.frame_current)
        stage.collection.objects.link(camera)
        stage.camera = camera
        # Cycles' panorama looks along the camera's -Z in its middle; Blender's pictures of
        # surroundings along +X, with +Z up.
        camera.rotation_euler = (np.pi / 2.0, 0.0, -np.pi / 2.0)
        camera_data.type = "PANO"
        camera_data.panorama_type = "EQUIRECTANGULAR"
        _set_up(stage, height)
        with TemporaryFolder() as folder:
            path = folder / "world.exr"
            stage.render.filepath = str(path)
            size = height * 2 * height * 3 * np.dtype(np.float32).itemsize
            render_to(path, size, "the world's picture", scene=stage.name)
            picture = bpy.data.images.load(str(path))
            pixels = np.empty(height * 2 * height * 4, dtype=np.float32)
            picture.pixels.foreach_get(pixels)
        return pixels.reshape(height, 2 * height, 4)[..., :3].copy()
    finally:
        if picture is not None:
            bpy.data.images.remove(picture)
        bpy.data.scenes.remove(stage)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(camera_data)


def _set_up(stage: Any, height: int) -> None:
    render = stage.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = 2 * height, height
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_file_extension = False
    render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    stage.cycles.device = "CPU"
    stage.cycles.samples = 4
    stage.cycles.use_adaptive_sampling = False
    stage.cycles.use_denoising = False
