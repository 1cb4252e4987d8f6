# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures by plain Cycles, at the very points that a caching camera samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
from mathutils import Matrix
from numpy.typing import NDArray

from addon.camplace.camera import CachingCamera


def emission_of(scene: Any, camera: CachingCamera, folder: Path) -> NDArray[np.float32]:
    """(R, R, 3) what the scene's surfaces send out, row 0 at the bottom: one sample at the
    centre of each pixel, in float32, without light that falls on them."""
    data = bpy.data.cameras.new("probe")
    eye = bpy.data.objects.new("probe", data)
    scene.collection.objects.link(eye)
    eye.matrix_world = Matrix(camera.world_from_camera.tolist())
    data.sensor_fit, data.lens_unit = "HORIZONTAL", "FOV"
    data.angle, data.clip_start, data.clip_end = camera.fov, camera.near, camera.far
    scene.camera = eye
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    cycles.samples, cycles.max_bounces = 1, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    # A hundredth of a pixel wide; Cycles has no filter that is a point.
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    cycles.transparent_max_bounces = 64
    render.resolution_x = render.resolution_y = camera.resolution
    render.resolution_percentage = 100
    render.film_transparent = True
    settings = render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = "NONE"
    path = folder / "probe.exr"
    render.filepath, render.use_file_extension = str(path), False
    try:
        bpy.ops.render.render(write_still=True, scene=scene.name)
    finally:
        scene.camera = None
        bpy.data.objects.remove(eye)
        bpy.data.cameras.remove(data)
    pixels = OpenEXR.File(str(path)).channels()["RGBA"].pixels
    return np.array(pixels[::-1, :, :3], dtype=np.float32)
