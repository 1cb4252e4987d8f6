# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth to compare with: Cycles, with the same lights, and direct light only.

The open scene is changed for it, so that Cycles computes what Relume sets out to compute: no
bounces (but as many transparent surfaces as the scene allows, for cut-outs), no clamping, no
denoiser. What glows lights other surfaces once, in the render without lights.

Each light is rendered alone and the pictures are added. Cycles tosses a coin for each sample
to choose a light; without it, the same samples leave a tenth of the noise or less, and a
reference after an edit needs only the edited lights anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.progress import Progress, part_of
from addon.scene.view_reader import read_view, render_size
from addon.temporary_folder import TemporaryFolder

from . import metrics
from .comparison import DEPTH_CHANNEL, OBJECT_CHANNEL, PERSPECTIVE_HEADER, PIXEL_HEADER
from .picture_file import PictureFile, read_picture, write_exr

# Far beyond any number of overlapping cut-outs; Cycles' own default is 8.
MIN_TRANSPARENT_BOUNCES = 64
# More lights than this are rendered in so many groups, which bounds the time.
MAX_GROUPS = 8
# The label of nodes that say whether what glows lights others.
_SWITCH = "Relume: glow lights others"

Halves = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True)
class Reference:
    """A reference picture, in scene-linear values, row 0 at the bottom.

    Attributes:
        base: what is seen without lights: the background, what glows, its light and the world's:
            (H, W, 4) float32 of two independent renders, of other seeds.
        layers: by the names of their lights, (H, W, 3) float32 of two such renders.
        depth: (H, W) float32 at the pixel centres, along the view axis, metres; 0 where
            nothing is seen.
        objects: (H, W) float32, a number for each object.
        pixel: a pixel's width in metres, at distance 1 m with perspective.
        perspective: False for an orthographic camera.
    """

    base: Halves
    layers: Mapping[tuple[str, ...], Halves]
    depth: NDArray[np.float32]
    objects: NDArray[np.float32]
    pixel: float
    perspective: bool

    def half(self, number: int) -> NDArray[np.float64]:
        """(H, W, 4): all lights together, of one of the two renders."""
        rgba = self.base[number].astype(np.float64)
        for layer in self.layers.values():
            rgba[..., :3] += layer[number]
        return rgba

    @property
    def rgba(self) -> NDArray[np.float32]:
        """(H, W, 4): the picture, the mean of the two renders."""
        return (0.5 * (self.half(0) + self.half(1))).astype(np.float32)

    def noise_floor(self, mask: NDArray[np.bool_] | None = None) -> dict[str, float | None]:
        """PSNR in decibels of `rgba` against the noiseless picture, estimated.

        The renders differ by twice the variance of one, and their mean has half of it: a
        quarter of their squared difference is the mean's squared error.
        """
        encoded = [metrics.encode_srgb(self.half(n)[..., :3]) * 255.0 for n in range(2)]
        rgb, luma = metrics.squared_error(*encoded)
        means = {"rgb": metrics.mean_over(rgb, mask), "luma": metrics.mean_over(luma, mask)}
        return {
            f"psnr_{name}": None if mean is None else metrics.psnr(mean / 4.0)
            for name, mean in means.items()
        }

    def noiseless_psnr(
        self, image: NDArray[np.floating], mask: NDArray[np.bool_] | None = None
    ) -> float | None:
        """PSNR of a picture's luma against the noiseless reference, in decibels, estimated.

        The two renders' noise is independent, so that in the product of what the picture is off
        the one and off the other it has a mean of zero: what is left is the square of what the
        picture is off the truth, whatever the noise. Encoding for a display bends noise a
        little, which is of second order.

        Args:
            image: (H, W, 3), scene-linear.
            mask: (H, W), the pixels that count; all without it.

        Returns:
            Infinite where nothing is left; None for no pixels.
        """
        shown = metrics.quantize(metrics.encode_srgb(image))
        off = [
            (shown - 255.0 * metrics.encode_srgb(self.half(number)[..., :3])) @ metrics.LUMA
            for number in range(2)
        ]
        mean = metrics.mean_over(off[0] * off[1], mask)
        return None if mean is None else metrics.psnr(max(mean, 0.0))

    def joined(self, other: Reference) -> Reference:
        """The mean with another reference of the same view and samples, but other seeds."""
        layers = {name: _mean(halves, other.layers[name]) for name, halves in self.layers.items()}
        return replace(self, base=_mean(self.base, other.base), layers=layers)

    def write(self, path: Path) -> None:
        """Write the picture as EXR, with what `relume compare` needs to find edges."""
        write_exr(
            path,
            self.rgba,
            {DEPTH_CHANNEL: self.depth, OBJECT_CHANNEL: self.objects},
            {PIXEL_HEADER: self.pixel, PERSPECTIVE_HEADER: float(self.perspective)},
        )


def _mean(a: Halves, b: Halves) -> Halves:
    half = np.float32(0.5)
    return half * (a[0] + b[0]), half * (a[1] + b[1])


def prepare(scene: Any) -> None:
    """Set the open scene up for references: lasting changes, so never save it afterwards."""
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = True
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.use_border = scene.render.use_motion_blur = False
    scene.render.use_simplify = False
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = max(cycles.transparent_max_bounces, MIN_TRANSPARENT_BOUNCES)
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.use_animated_seed = cycles.use_sample_subset = False
    cycles.film_exposure = 1.0
    cycles.use_fast_gi = cycles.use_guiding = False
    cycles.time_limit = 0.0
    # Persistent data keeps the passes that the first render had.
    layer = scene.view_layers[0]
    layer.samples = 0
    layer.use_pass_z = layer.use_pass_object_index = layer.use_pass_emit = True
    for number, obj in enumerate(scene.objects, start=1):
        obj.pass_index = number
    _switch_glow()


def _switch_glow() -> None:
    """Give what glows a switch that says whether it lights others too: see `_let_glow_light`."""
    import bpy

    trees: list[Any] = [m.node_tree for m in bpy.data.materials if m.node_tree is not None]
    trees += [group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree"]
    for tree in trees:
        for node in list(tree.nodes):
            if node.bl_idname == "ShaderNodeEmission":
                _add_switch(tree, node.inputs["Strength"])
            elif node.bl_idname == "ShaderNodeBsdfPrincipled":
                _add_switch(tree, node.inputs["Emission Strength"])


def _add_switch(tree: Any, strength: Any) -> None:
    """Multiply a strength by the greater of the switch and "is this ray from a camera"."""
    if not strength.is_linked and strength.default_value == 0.0:
        return
    path = tree.nodes.new("ShaderNodeLightPath")
    switch = tree.nodes.new("ShaderNodeMath")
    switch.operation, switch.label = "MAXIMUM", _SWITCH
    tree.links.new(path.outputs["Is Camera Ray"], switch.inputs[0])
    product = tree.nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    product.inputs[0].default_value = strength.default_value
    if strength.is_linked:
        tree.links.new(strength.links[0].from_socket, product.inputs[0])
    tree.links.new(switch.outputs[0], product.inputs[1])
    tree.links.new(product.outputs[0], strength)


def _let_glow_light(scene: Any, lights: bool) -> None:
    """Whether what glows lights other surfaces, or is only seen."""
    import bpy

    trees: list[Any] = [m.node_tree for m in bpy.data.materials if m.node_tree is not None]
    trees += [group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree"]
    switches = [node for tree in trees for node in tree.nodes if node.label == _SWITCH]
    for switch in switches:
        switch.inputs[1].default_value = float(lights)
    for material in bpy.data.materials:
        if hasattr(material, "cycles"):
            # Which only decides how noise is kept low.
            material.cycles.emission_sampling = "FRONT_BACK" if lights else "NONE"
    if switches:
        # What Cycles keeps for the next render would go on sampling what glows as the first one
        # did: in vain beside each light, which triples the noise, or not at all.
        scene.render.use_persistent_data = not lights


def render_reference(
    scene: Any,
    camera: Any,
    samples: int,
    progress: Progress,
    *,
    known: Reference | None = None,
    changed: Sequence[str] = (),
    first_seed: int = 0,
) -> Reference:
    """Render a camera of a scene that `prepare` has set up, at its current frame and size.

    Args:
        scene: a `bpy.types.Scene`.
        camera: the camera's object.
        samples: of a pixel for each light, in all; half of them with each of two seeds.
        progress: told of each render.
        known: the same view's reference before an edit; its layers are taken over,
        changed: but those of these lights.
        first_seed: where the seeds begin; references that are to be joined need others.
    """
    scene.camera = camera
    write_controls(scene)
    half = max(1, samples // 2)
    groups = [group for group in light_groups() if known is None or set(group) & set(changed)]
    renders = ([()] if known is None else []) + groups
    layers: dict[tuple[str, ...], Halves] = dict(known.layers) if known is not None else {}
    with TemporaryFolder() as folder, _only_these_lights(scene) as choose:
        place = folder / "render.exr"
        for number, group in enumerate(renders):
            step = part_of(progress, number / (len(renders) + 1), (number + 1) / (len(renders) + 1))
            step(0.0, f"Cycles, {camera.name}: {', '.join(group) or 'without lights'}")
            choose(group)
            # Other seeds for other lights, so that their noise at edges does not add up.
            seeds = (first_seed + 2 * number, first_seed + 2 * number + 1)
            pictures = [render_passes(scene, place, half, seed) for seed in seeds]
            if group:
                layers[group] = (_lit(pictures[0]), _lit(pictures[1]))
            else:
                base = (_rgba(pictures[0]), _rgba(pictures[1]))
        if known is not None:
            progress(1.0, f"Cycles, {camera.name}: rendered")
            return replace(known, layers=layers)
        choose(())
        depth, objects = _render_guides(scene, place)
    progress(1.0, f"Cycles, {camera.name}: rendered")
    pixel, perspective = pixel_size(camera)
    return Reference(base, layers, depth, objects, pixel, perspective)


def write_controls(scene: Any) -> None:
    """Have Cycles show the lights' controls too, as far as it can.

    Raises:
        InputError: a light's nodes have no place for them.
    """
    from addon.scene.depsgraph_reader import viewport_depsgraph
    from addon.scene.light_controls_reader import read_controls
    from addon.ui import write_back

    depsgraph = viewport_depsgraph(scene)
    lights = {o.data.name_full: o.data for o in scene.objects if o.type == "LIGHT"}
    shown = [
        (data, read_controls(depsgraph, data.evaluated_get(depsgraph), []))
        for data in lights.values()
    ]
    for data, controls in shown:
        if not write_back.is_current(data, controls):
            write_back.write(data, controls)


def light_groups() -> list[tuple[str, ...]]:
    """The names of the lights that are rendered together: one each, when there are few."""
    import bpy

    names = sorted(o.name for o in bpy.data.objects if o.type == "LIGHT" and not o.hide_render)
    return [tuple(names[i::MAX_GROUPS]) for i in range(min(MAX_GROUPS, len(names)))]


@contextmanager
def _only_these_lights(scene: Any) -> Iterator[Callable[[Sequence[str]], None]]:
    """Give a function that leaves only the named lights lit; the world goes with no light."""
    import bpy

    lights = [o for o in bpy.data.objects if o.type == "LIGHT" and not o.hide_render]
    world = scene.world

    def choose(names: Sequence[str]) -> None:
        scene.world = None if names else world
        _let_glow_light(scene, not names)
        for light in lights:
            light.hide_render = light.name not in names

    try:
        yield choose
    finally:
        scene.world = world
        for light in lights:
            light.hide_render = False


def render_passes(scene: Any, path: Path, samples: int, seed: int) -> PictureFile:
    """Render with Cycles through a multi-layer EXR, the only way from Cycles to Python."""
    from addon.scene.temporary_render import render_to

    scene.cycles.samples, scene.cycles.seed = samples, seed
    settings = scene.render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    settings.exr_codec = "NONE"
    scene.render.filepath, scene.render.use_file_extension = str(path), False
    width, height = render_size(scene)
    render = scene.render
    if render.use_border and render.use_crop_to_border:
        width = int((render.border_max_x - render.border_min_x) * width)
        height = int((render.border_max_y - render.border_min_y) * height)
    size = width * height * 3 * np.dtype(np.float32).itemsize
    render_to(path, size, "the reference", layer=scene.view_layers[0].name)
    return read_picture(path)


def pass_of(picture: PictureFile, name: str) -> NDArray[np.float32]:
    """A pass's channel, (H, W), by its pass and channel: "Depth.Z"."""
    return next(v for channel, v in picture.extra.items() if channel.endswith("." + name))


def _rgba(picture: PictureFile) -> NDArray[np.float32]:
    return np.concatenate([picture.rgb, pass_of(picture, "Combined.A")[..., None]], axis=-1)


def _lit(picture: PictureFile) -> NDArray[np.float32]:
    """What the lights alone add: all but what glows by itself."""
    return picture.rgb - np.stack([pass_of(picture, f"Emission.{c}") for c in "RGB"], axis=-1)


def _render_guides(scene: Any, path: Path) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Depth (0 for the background) and object numbers, both (H, W), at the pixel centres."""
    cycles = scene.cycles
    kept = cycles.pixel_filter_type, cycles.filter_width
    # Cycles' box filter is a pixel wide whatever its setting says.
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    try:
        picture = render_passes(scene, path, samples=1, seed=0)
    finally:
        cycles.pixel_filter_type, cycles.filter_width = kept
    depth, objects = pass_of(picture, "Depth.Z"), pass_of(picture, "Object Index.X")
    # Cycles writes 1e10 where a camera ray meets nothing.
    return np.where(depth < 1e9, depth, 0.0).astype(np.float32), objects


def pixel_size(camera: Any) -> tuple[float, bool]:
    """A pixel's width in metres, at distance 1 m with perspective; and whether there is any."""
    import bpy

    view = read_view(bpy.context.evaluated_depsgraph_get(), camera)
    return float(2.0 / (view.clip_from_camera[0, 0] * view.width)), view.perspective
