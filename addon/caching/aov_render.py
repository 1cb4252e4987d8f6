# SPDX-License-Identifier: GPL-3.0-or-later
"""Has Cycles render AOVs from caching cameras, on a stage of its own.

The stage is a linked copy of the scene: it shares every object, and has render settings, view
layer, camera and world of its own, so the artist's scene keeps all of its settings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np
import OpenEXR
from mathutils import Matrix
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from .channels import CHANNEL_BY_NAME
from .specialize import AOV_PREFIX

# Far beyond any number of overlapping cut-outs.
_TRANSPARENT_BOUNCES = 1024

# Opaque surfaces end the sum of AOVs, cut-away ones do not: any value between 0 and 1 serves.
_ALPHA_THRESHOLD = 0.5

# Cycles' pixel filter cannot be switched off; over a hundredth of a texel it moves the sample
# by no more than that from the centre.
_FILTER_WIDTH = 0.01


class Stage:
    """A scene that renders texel-centre AOVs of the artist's scene."""

    def __init__(self, scene: Any, camera: Any, folder: Path, channels: Sequence[str]) -> None:
        self._scene = scene
        self._camera = camera
        self._path = folder / "deep.exr"
        self._channels = [name for name in channels if name != "depth"]

    def render(self, camera: CachingCamera) -> dict[str, NDArray[np.float32]]:
        """Depth, the AOVs, and the shading normal as Cycles' own pass has it.

        Returns:
            (R, R, components) float32 by channel, row 0 at the bottom; "pass_normal" beside
            them for surfaces whose material wrote no AOV.

        Raises:
            InputError: Cycles wrote no picture.
        """
        data = self._camera.data
        data.angle = camera.fov
        data.clip_start = camera.near
        data.clip_end = camera.far
        self._camera.matrix_world = Matrix(camera.world_from_camera.tolist())
        render = self._scene.render
        render.resolution_x = render.resolution_y = camera.resolution
        self._path.unlink(missing_ok=True)
        bpy.ops.render.render(scene=self._scene.name, write_still=True)
        if not self._path.is_file():
            raise InputError(
                f"Cycles rendered nothing for caching camera {camera.id}; free some memory or "
                "lower the preset"
            )
        return self._read(camera.resolution)

    def _read(self, resolution: int) -> dict[str, NDArray[np.float32]]:
        found: dict[str, NDArray[np.float32]] = {}
        exr = OpenEXR.File(str(self._path), separate_channels=True)
        for part in exr.parts:
            for name, channel in part.channels.items():
                # Names are layer.pass.component.
                found[".".join(name.split(".")[-2:])] = channel.pixels
        layers = {"depth": ("Depth", "Z"), "pass_normal": ("Normal", "XYZ")}
        for name in self._channels:
            single = CHANNEL_BY_NAME[name].components == 1
            layers[name] = (AOV_PREFIX + name, "X" if single else "RGB")
        result = {}
        for name, (layer, letters) in layers.items():
            planes = [_plane(found, layer, letter) for letter in letters]
            pixels = np.stack(planes, axis=-1).astype(np.float32)
            # EXR's rows run downward.
            result[name] = np.ascontiguousarray(pixels[::-1])
            if pixels.shape[:2] != (resolution, resolution):
                raise InputError(f"Cycles rendered {layer} at the wrong size {pixels.shape[:2]}")
        return result


def _plane(found: dict[str, NDArray[np.float32]], layer: str, letter: str) -> Any:
    # A value pass may be written under any of these letters.
    for candidate in (letter, *(("V", "Z", "R") if letter == "X" else ())):
        if f"{layer}.{candidate}" in found:
            return found[f"{layer}.{candidate}"]
    raise InputError(f"Cycles wrote no pass {layer}; is this Blender built with Cycles?")


@contextmanager
def staged(scene: Any, channels: Sequence[str]) -> Iterator[Stage]:
    """A `Stage` for `scene`, a `bpy.types.Scene`, taken down again at the end."""
    stage = scene.copy()
    data = bpy.data.cameras.new("Relume caching camera")
    camera = bpy.data.objects.new("Relume caching camera", data)
    try:
        stage.name = "Relume bake"
        stage.collection.objects.link(camera)
        stage.camera = camera
        stage.world = None
        stage.use_nodes = False
        data.type = "PERSP"
        data.sensor_fit = "HORIZONTAL"
        data.lens_unit = "FOV"
        with TemporaryDirectory(prefix="relume-") as folder:
            _set_up_render(stage, Path(folder) / "deep.exr")
            _set_up_cycles(stage.cycles)
            _set_up_layer(stage, channels)
            yield Stage(stage, camera, Path(folder), channels)
    finally:
        bpy.data.scenes.remove(stage)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)


def _set_up_render(stage: Any, path: Path) -> None:
    render = stage.render
    render.engine = "CYCLES"
    render.filepath = str(path)
    render.use_file_extension = False
    render.use_overwrite = True
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = False
    render.use_border = render.use_motion_blur = render.use_simplify = False
    render.use_multiview = render.use_stamp = False
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.film_transparent = True
    settings = render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth = "32"
    settings.exr_codec = "NONE"


def _set_up_cycles(cycles: Any) -> None:
    cycles.device = "CPU"
    cycles.samples = 1
    cycles.seed = 0
    cycles.use_animated_seed = False
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = _FILTER_WIDTH
    cycles.max_bounces = 0
    cycles.transparent_max_bounces = _TRANSPARENT_BOUNCES
    cycles.use_auto_tile = False
    cycles.time_limit = 0.0
    cycles.shading_system = False


def _set_up_layer(stage: Any, channels: Sequence[str]) -> None:
    layer = stage.view_layers[0]
    for other in stage.view_layers:
        other.use = other == layer
    layer.material_override = None
    layer.world_override = None
    layer.samples = 0
    layer.use_pass_z = layer.use_pass_normal = True
    layer.pass_alpha_threshold = _ALPHA_THRESHOLD
    while layer.aovs:
        layer.aovs.remove(layer.aovs[0])
    for name in channels:
        if name == "depth":
            continue
        aov = layer.aovs.add()
        aov.name = AOV_PREFIX + name
        aov.type = "VALUE" if CHANNEL_BY_NAME[name].components == 1 else "COLOR"


def far_is_nothing(depth: NDArray[np.float32], far: float) -> NDArray[np.float32]:
    """Depth with 0 for what Cycles left empty (it writes a huge number) or beyond `far`."""
    nothing = ~np.isfinite(depth) | (depth > far * (1.0 + math.sqrt(np.finfo(np.float32).eps)))
    return np.where(nothing, np.float32(0.0), depth)
