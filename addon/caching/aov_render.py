# SPDX-License-Identifier: GPL-3.0-or-later
"""Has Cycles render AOVs from caching cameras, on a stage of its own.

The stage is a linked copy of the scene: it shares every object, and has render settings, view
layer, camera and world of its own, so the artist's scene keeps all of its settings.
"""

from __future__ import annotations

import math
import time
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
from mathutils import Matrix
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..scene.temporary_render import render_to
from ..stopping import uninterrupted
from ..temporary_folder import TemporaryFolder
from .plan import ChannelPlan
from .specialize import AOV_PREFIX
from .texel_means import COVERED, averaged_channels

# The key of Cycles' own normal among the rendered channels.
PASS_NORMAL = "pass_normal"  # noqa: S105 - a picture, not a word

# Far beyond any number of overlapping cut-outs.
_TRANSPARENT_BOUNCES = 1024

# Opaque surfaces end the sum of AOVs, cut-away ones do not: any value between 0 and 1 serves.
_ALPHA_THRESHOLD = 0.5

# Texels, the narrowest that Blender allows.
_LEAST_FILTER = 0.01

# The light group of the white sky, whose light is told apart from that of the scene's lights.
_SKY = "relume_sky"

# Kinds of data-blocks that a bake makes, beside its stage's.
_MADE = ("images", "lights", "materials", "node_groups")


@dataclass(frozen=True)
class Region:
    """A rectangle of texels: those from the first to before the last, rows from the bottom."""

    rows: tuple[int, int]
    columns: tuple[int, int]

    @classmethod
    def around(cls, wanted: NDArray[np.bool_], margin: int) -> Region:
        """The least that holds what is wanted of (R, R) texels, and so many beside it."""

        def reach(axis: int) -> tuple[int, int]:
            some = np.flatnonzero(wanted.any(axis=axis))
            return max(int(some[0]) - margin, 0), min(int(some[-1]) + 1 + margin, len(wanted))

        return cls(reach(1), reach(0))

    def set(self, render: Any, resolution: int) -> None:
        """Make it the border of a render of that resolution, which Blender rounds to pixels."""
        render.use_crop_to_border = False
        render.border_min_y, render.border_max_y = (row / resolution for row in self.rows)
        render.border_min_x, render.border_max_x = (column / resolution for column in self.columns)


class Stage:
    """A scene that renders texel-centre AOVs of the artist's scene.

    Attributes:
        seconds: that Cycles took for all pictures so far, and that it took to read them.
    """

    def __init__(
        self,
        scene: Any,
        camera: Any,
        path: Path,
        channels: Sequence[str],
        *,
        single: frozenset[str],
        has_normal: bool,
        sky_rays: int,
        averaged: Sequence[str],
        texel_samples: int,
    ) -> None:
        self._scene = scene
        self._camera = camera
        self._path = path
        self._sky_rays = sky_rays
        self._averaged, self._texel_samples = averaged, texel_samples
        self.seconds = {"cycles": 0.0, "read": 0.0}
        # Channel -> Cycles' pass and the letters of its components.
        self._passes = {"depth": ("Depth", "Z")}
        for name in channels:
            if name != "depth" and not (name == "ambient_occlusion" and sky_rays):
                self._passes[name] = (AOV_PREFIX + name, "X" if name in single else "RGB")
        if has_normal:
            self._passes[PASS_NORMAL] = ("Normal", "XYZ")

    @property
    def measures_sky(self) -> bool:
        """Whether ambient occlusion is the light of a white sky, and not an AOV."""
        return self._sky_rays > 0

    def render(
        self, camera: CachingCamera, region: Region | None = None
    ) -> dict[str, NDArray[np.float32]]:
        """Depth, the AOVs, and the shading normal as Cycles' own pass has it.

        Args:
            camera: that sees them.
            region: of the picture, if not all of it is wanted; nothing is seen outside.

        Returns:
            (R, R, components) float32 by channel, row 0 at the bottom; PASS_NORMAL beside
            them if the stage was made with it.

        Raises:
            InputError: Cycles wrote no picture, or had no room for it.
        """
        data = self._camera.data
        data.angle = camera.fov
        data.clip_start = camera.near
        data.clip_end = camera.far
        self._camera.matrix_world = Matrix(camera.world_from_camera.tolist())
        render = self._scene.render
        render.resolution_x = render.resolution_y = camera.resolution
        render.use_border = region is not None
        if region is not None:
            region.set(render, camera.resolution)
        result = self._picture(camera, self._passes)
        if self._sky_rays:
            result["ambient_occlusion"] = self._render_sky(camera)
        return result

    def render_means(self, camera: CachingCamera) -> dict[str, NDArray[np.float32]]:
        """The means over texels of what the stage was asked to average, after `render`.

        Returns:
            (R, R, components) float32 by channel, with `material_id` where the stage has it, else
            with COVERED; none if nothing is averaged.
        """
        if not self._averaged:
            return {}
        wanted = {
            name: self._passes[name]
            for name in ("material_id", *self._averaged)
            if name in self._passes
        }
        if "material_id" not in wanted:
            wanted[COVERED] = ("Combined", "A")
        with self._only_aovs(wanted), self._sampled(self._texel_samples):
            return self._picture(camera, wanted)

    @contextmanager
    def _only_aovs(self, channels: Container[str]) -> Iterator[None]:
        """Only these channels' AOVs: Cycles works out all that a layer has, and of ambient
        occlusion each sample would cast all of its rays again."""
        layers = [layer for layer in self._scene.view_layers if layer.use]
        removed = []
        for layer in layers:
            for name, kind in [(aov.name, aov.type) for aov in layer.aovs]:
                if name.removeprefix(AOV_PREFIX) not in channels:
                    layer.aovs.remove(layer.aovs[name])
                    removed.append((layer, name, kind))
        try:
            yield
        finally:
            for layer, name, kind in removed:
                aov = layer.aovs.add()
                aov.name, aov.type = name, kind

    def _render_sky(self, camera: CachingCamera) -> NDArray[np.float32]:
        """(R, R, 1): the light of a sky of radiance 1 on white surfaces, which is the open share
        of the cosine-weighted hemisphere. At the texels' centres, as all else: what is beside an
        edge in a texel is another surface."""
        cycles = self._scene.cycles
        sky = {"sky": (f"Combined_{_SKY}", "R")}
        try:
            cycles.max_bounces = 1
            cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", _LEAST_FILTER
            with self._only_aovs(()), self._sampled(self._sky_rays):
                return np.clip(self._picture(camera, sky)["sky"], 0.0, 1.0)
        finally:
            cycles.max_bounces, cycles.pixel_filter_type = 0, "BOX"

    @contextmanager
    def _sampled(self, samples: int) -> Iterator[None]:
        """So many samples of each texel, as the filter has them, but for the first, which is at its
        centre.

        They are the view layer's: with persistent data, a change of the scene's alone does not
        reach Cycles.
        """
        layers = [layer for layer in self._scene.view_layers if layer.use]
        for layer in layers:
            layer.samples = samples
        try:
            yield
        finally:
            for layer in layers:
                layer.samples = 1

    def _picture(
        self, camera: CachingCamera, passes: Mapping[str, tuple[str, str]]
    ) -> dict[str, NDArray[np.float32]]:
        """Render, and read these passes."""
        started = time.monotonic()
        # Blender writes the four of the combined picture whatever is asked.
        components = 4 + sum(len(letters) for _, letters in passes.values())
        least_bytes = components * camera.resolution**2 * np.dtype(np.float32).itemsize
        what = f"caching camera {camera.id}"
        render_to(self._path, least_bytes, what, scene=self._scene.name)
        rendered = time.monotonic()
        pictures = self._read(camera.resolution, passes)
        self.seconds["cycles"] += rendered - started
        self.seconds["read"] += time.monotonic() - rendered
        return pictures

    def _read(
        self, resolution: int, passes: Mapping[str, tuple[str, str]]
    ) -> dict[str, NDArray[np.float32]]:
        planes: dict[str, NDArray[np.float32]] = {}
        for part in OpenEXR.File(str(self._path), separate_channels=True).parts:
            for name, channel in part.channels.items():
                # Names are layer.pass.component.
                planes[".".join(name.split(".")[-2:])] = channel.pixels
        result = {}
        for name, (layer, letters) in passes.items():
            pixels = np.empty((resolution, resolution, len(letters)), dtype=np.float32)
            for index, letter in enumerate(letters):
                # EXR's rows run downward.
                pixels[..., index] = _plane(planes, layer, letter)[::-1]
            result[name] = pixels
        return result


def _plane(planes: dict[str, NDArray[np.float32]], layer: str, letter: str) -> Any:
    # A value pass may be written under any of these letters.
    for candidate in (letter, *(("V", "Z", "R") if letter == "X" else ())):
        if f"{layer}.{candidate}" in planes:
            return planes[f"{layer}.{candidate}"]
    raise InputError(f"Cycles wrote no pass {layer}; is this Blender built with Cycles?")


@contextmanager
def staged(
    scene: Any,
    plan: ChannelPlan,
    *,
    has_normal: bool,
    sky_rays: int = 0,
    texel_samples: int = 1,
) -> Iterator[Stage]:
    """A `Stage` for `scene`, a `bpy.types.Scene`, taken down again at the end.

    Args:
        scene: whose objects are rendered, at its current frame.
        plan: whose stored channels are rendered.
        has_normal: whether Cycles' own normal is wanted beside them.
        sky_rays: rays of each texel towards a white sky, where its light is the channel of
            ambient occlusion; 0 where that is an AOV or is not wanted.
        texel_samples: of each texel, whose mean its colours are; 1 for those of its centre.
    """
    stage = scene.copy()
    data = bpy.data.cameras.new("Relume caching camera")
    camera = bpy.data.objects.new("Relume caching camera", data)
    sky = _white_sky() if sky_rays else None
    try:
        with TemporaryFolder() as folder:
            path = folder / "deep.exr"
            stage.name = "Relume bake"
            stage.collection.objects.link(camera)
            stage.camera = camera
            stage.world = sky
            data.type = "PERSP"
            data.sensor_fit = "HORIZONTAL"
            data.lens_unit = "FOV"
            _set_up_render(stage, path)
            _set_up_cycles(stage.cycles)
            single = frozenset(name for name in plan.stored if plan.components(name) == 1)
            aovs = [n for n in plan.stored if not (n == "ambient_occlusion" and sky_rays)]
            averaged = averaged_channels(plan) if texel_samples > 1 else ()
            has_cover = bool(averaged) and "material_id" not in plan.stored
            _set_up_layer(stage, aovs, single, has_normal, has_cover)
            if sky is not None:
                next(layer for layer in stage.view_layers if layer.use).lightgroups.add(name=_SKY)
            yield Stage(
                stage,
                camera,
                path,
                plan.stored,
                single=single,
                has_normal=has_normal,
                sky_rays=sky_rays,
                averaged=averaged,
                texel_samples=texel_samples,
            )
    finally:
        with uninterrupted():
            # Frees what Cycles keeps between cameras. Blender would keep a dependency graph of
            # the removed scene with it, and crash on a later look at that.
            stage.render.use_persistent_data = False
            bpy.data.scenes.remove(stage)
            bpy.data.objects.remove(camera)
            bpy.data.cameras.remove(data)
            if sky is not None:
                bpy.data.worlds.remove(sky)


def _white_sky() -> Any:
    """A world of radiance 1 that only rays from surfaces find: of those that go about the
    normal by its cosine, the share that gets through is the answer, without other noise."""
    sky = bpy.data.worlds.new("Relume sky")
    background = next(n for n in sky.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.0
    sky.cycles.sampling_method = "NONE"
    sky.lightgroup = _SKY
    return sky


@contextmanager
def without_new_pictures() -> Iterator[None]:
    """Removes the image block, Render Result, that the first render in a file makes; and copies
    of materials, their groups and lights that an error has left in the middle of being made."""
    known = {block.session_uid for kind in _MADE for block in getattr(bpy.data, kind)}
    try:
        yield
    finally:
        new = [
            block
            for kind in _MADE
            for block in getattr(bpy.data, kind)
            if block.session_uid not in known
            and (kind != "images" or block.type == "RENDER_RESULT")
        ]
        bpy.data.batch_remove(new)


def _set_up_render(stage: Any, path: Path) -> None:
    """Everything that would change the picture but not the surfaces is off; simplification
    changes the surfaces and stays as the artist has it."""
    render = stage.render
    render.engine = "CYCLES"
    render.filepath = str(path)
    render.use_file_extension = False
    render.use_overwrite = True
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = render.use_freestyle = False
    render.use_border = render.use_motion_blur = False
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
    # Of a pixel, the first sample looks through the centre, whatever the filter.
    cycles.samples = 1
    cycles.use_sample_subset = False
    # The filter of ambient occlusion wants each texel's rays to be its own: blue noise of a single
    # sample has neighbours' correlated by 0.4, and leaves more than twice the noise.
    cycles.sampling_pattern = "TABULATED_SOBOL"
    # View layers say how many further ones there are.
    cycles.use_layer_samples = "USE"
    # Light tells how open the sky is.
    cycles.film_exposure = 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.seed = 0
    cycles.use_animated_seed = False
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = 0
    cycles.transparent_max_bounces = _TRANSPARENT_BOUNCES
    cycles.use_camera_cull = cycles.use_distance_cull = False
    cycles.use_auto_tile = False
    cycles.time_limit = 0.0


def _set_up_layer(
    stage: Any,
    channels: Sequence[str],
    single: frozenset[str],
    has_normal: bool,
    has_cover: bool,
) -> None:
    """The view layer that the geometry is read from, with nothing that has no triangles."""
    layer = next((layer for layer in stage.view_layers if layer.use), stage.view_layers[0])
    for other in stage.view_layers:
        other.use = other == layer
    layer.use_solid = True
    layer.use_strand = layer.use_volumes = layer.use_grease_pencil = False
    for passes in (layer, layer.cycles):
        for key in passes.bl_rna.properties.keys():  # noqa: SIM118 - not a dict
            if key.startswith(("use_pass_", "pass_debug_")):
                setattr(passes, key, False)
    layer.cycles.denoising_store_passes = False
    layer.material_override = None
    layer.world_override = None
    layer.samples = 1
    layer.use_pass_z = True
    layer.use_pass_normal = has_normal
    layer.use_pass_combined = has_cover
    layer.pass_alpha_threshold = _ALPHA_THRESHOLD
    while layer.aovs:
        layer.aovs.remove(layer.aovs[0])
    for name in channels:
        if name == "depth":
            continue
        aov = layer.aovs.add()
        aov.name = AOV_PREFIX + name
        aov.type = "VALUE" if name in single else "COLOR"


def far_is_nothing(depth: NDArray[np.float32], far: float) -> NDArray[np.float32]:
    """Depth with 0 for what Cycles left empty (it writes a huge number) or beyond `far`."""
    nothing = ~np.isfinite(depth) | (depth > far * (1.0 + math.sqrt(np.finfo(np.float32).eps)))
    return np.where(nothing, np.float32(0.0), depth)
