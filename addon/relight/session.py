# SPDX-License-Identifier: GPL-3.0-or-later
"""The one object behind the viewport, F12, the command line and the tests.

A `RelightSession` owns a scene's geometry, its cache, its lights, its world and the view. It is
told what changed; its frame graph (`frame_passes`) knows what depends on that, and only this is
drawn again.

A pixel is a weighted list of shading samples, made once for a view from many visibility samples
(`corrmap.shading_samples`). Each shading sample is the mean of samples of the light: sample k has
its own place in the pixel (by Cycles' filter) and its own point of every light. On the way there,
`step` by step, an interactive view sees a coarse picture where a full one takes its time, then a
single sample from the pixels' and the lights' centres, then the growing mean.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..caching.stored_framebuffers import StoredFramebuffers
from ..corrmap.confidence import Confidence
from ..corrmap.correspondence import Coverage
from ..corrmap.surface_sampler import SurfaceSampler
from ..corrmap.tile_pages import CACHE_BUDGET
from ..errors import InputError
from ..glsl.shader import (
    Texture,
    UncompiledError,
    announced_compilation,
    draws_in_software,
    read_texture,
)
from ..progress import Progress, silent
from ..scene.exposure import Exposure
from ..scene.geometry import SceneGeometry
from ..scene.light import Light
from ..scene.light_linking import LightLinking
from ..scene.surface_edit import SurfaceEdits
from ..scene.view import View
from ..scene.world import World
from .graph.frame_graph import FrameGraph, FramePass
from .graph.frame_passes import (
    CACHE,
    CORRESPONDENCE,
    EMISSION_LAYER,
    GEOMETRY,
    PICTURE,
    SAMPLES,
    SURFACE_EDITS,
    SURFACES,
    VIEW,
    VISIBLE_SURFACE,
    WORLD,
    LightNode,
    frame_passes,
    light_input,
    shadow_pass,
)
from .layers.fence import Begun, Fence
from .layers.layer_drawing import LayerDrawing
from .layers.layer_stack import LayerStack, LightLayer
from .layers.layer_stages import LayerStages
from .layers.light_mix import LightMix, MixPart
from .layers.picture import Picture
from .lights.glowing_objects import GlowingObjects
from .lights.light_set import LightSet
from .shadows.shadow_frustum import ShadowSettings
from .world.world_pass import WorldTextures

if TYPE_CHECKING:
    from ..caching.framebuffer import DeepFramebuffer
    from ..caching.store import CacheStore
    from ..camplace.hole_cameras import HolePoints


# Visibility samples of each pixel at least: as many as Lightspeed's pictures have (figure 10). A
# picture of more samples has as many of these, or what they are off at edges would stay in it.
VISIBILITY_SAMPLES = 64

# Of a whole picture's time, as its progress is told: that of finding its shading samples.
_VISIBILITY_SHARE = 0.2


class RelightSession:
    """Relights one scene from one cache. Needs a GPU context for its whole life.

    Attributes:
        compiling: the name of the shader that the next step compiles first; "" for none.

    Args:
        geometry: the scene's triangles.
        store: its cache, with at least one finished camera.
        samples: samples in a finished picture.
        shadows: how shadows are found, and the resolution of their maps.
        split_lobes: whether lights' layers are kept apart by the kind of lobe, for `Picture.lobes`.
        mesh_lights: whether objects that glow light others.
        visibility: visibility samples of each pixel of a picture with more than one sample; 0 to
            shade each sample as a picture of its own, which is what the lists are held against;
            None for as many as the picture's samples, and no fewer than VISIBILITY_SAMPLES.
        cache_budget: bytes of the GPU's memory for the cache; a view that needs more takes more.
        progress: is told how far loading the cache is.

    Raises:
        InputError: the cache has no finished camera, or does not fit the GPU.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        store: CacheStore,
        samples: int = 16,
        shadows: ShadowSettings | None = None,
        *,
        split_lobes: bool = False,
        mesh_lights: bool = True,
        visibility: int | None = None,
        cache_budget: int = CACHE_BUDGET,
        progress: Progress = silent,
    ) -> None:
        framebuffers = StoredFramebuffers(store)
        if not framebuffers:
            raise InputError(f"the cache {store.folder} has no finished camera; bake it first")
        self._store = store
        self._sampler = SurfaceSampler(
            geometry, framebuffers, store.plan, cache_budget=cache_budget, progress=progress
        )
        self._visibility = visibility
        self._has_emission = store.plan.uses("emission")
        self._shadow_settings = (shadows or ShadowSettings()).settled(
            in_software=draws_in_software()
        )
        self._fence = Fence()
        self._drawing = LayerDrawing(
            self._sampler,
            self._shadow_settings,
            self._fence.begin,
            has_emission=self._has_emission,
            split=split_lobes,
        )
        glows = self._has_emission and mesh_lights
        self._glowing = GlowingObjects(self._sampler) if glows else None
        self._given: tuple[Light, ...] = ()
        self._lights = LightSet(has_emission=self._has_emission)
        self._edited: tuple[str, ...] = ()
        self._world: World | None = None
        self._world_textures: WorldTextures | None = None
        self._view: View | None = None
        self._graph = FrameGraph(frame_passes((), has_emission=self._has_emission))
        self._mix = LightMix()
        self._begun = Begun()
        self._stages = LayerStages(samples, self._textures_of, self._in_cells)
        self.compiling = ""

    # What changed -------------------------------------------------------------------------

    def set_geometry(self, geometry: SceneGeometry) -> None:
        """Objects moved or changed their shape; the cache stays."""
        self._sampler.set_geometry(geometry)
        self._drawing.follow_layout()
        if self._glowing is not None:
            self._glowing.forget()
        view, self._view = self._view, None
        self._touch(GEOMETRY)
        if view is not None:
            self.set_view(view)

    def set_added(self, framebuffers: Sequence[DeepFramebuffer]) -> None:
        """Read these beside the cache, in place of those that were added before.

        Raises:
            InputError: they do not fit the GPU.
        """
        self._sampler.set_added(framebuffers)
        self._drawing.follow_layout()
        self._touch(CACHE)
        self._follow_glow()

    def set_view(self, view: View) -> None:
        """The camera moved, or the picture has another size."""
        if not self._sampler.set_view(view):
            return
        is_move = self._view is not None
        self._view = view
        self._mix.clear()
        self._touch(VIEW)
        self._follow_glow()
        if is_move:
            self._stages.note_move()

    def set_exposure(self, exposure: Exposure | None) -> None:
        """What moves while the shutter is open, as it was read for the geometry; None for nothing.

        Other geometry drops it.
        """
        if self._sampler.set_exposure(exposure):
            self._mix.clear()
            self._touch(VIEW)

    def set_lights(self, lights: Sequence[Light]) -> None:
        """Lights were edited, added or removed; only what depends on that is redone."""
        self._given = tuple(lights)
        if self._glowing is not None and self._view is not None:
            drawing = self._drawing
            places, reached = drawing.visible_places(), drawing.reached
            lights = [*lights, *self._glowing.choose(lights, places, reached)]
        changes = self._lights.replace(lights)
        self._forget(self._graph.replace(self._passes()))
        self._touch(*changes.inputs)
        for name in changes.gone:
            self._drawing.forget_light(name)
        if changes.edited:
            self._edited = changes.edited

    def set_emitter_linking(self, linking: Mapping[str, LightLinking]) -> None:
        """Objects that glow light, and are shadowed by, others than before; by their names."""
        if self._glowing is not None and self._glowing.set_linking(linking):
            self._follow_glow()

    def set_glow_mix(self, solo: Collection[str], mute: Collection[str]) -> None:
        """Show only the light of some objects that glow, or leave that of some out.

        Args:
            solo: names of objects.
            mute: names of objects.

        Raises:
            InputError: one of them does not glow, as far as the cache tells.
        """
        if self._glowing is not None:
            self._glowing.set_mix(solo, mute)
            self._follow_glow()
        elif solo or mute:
            raise InputError(f"object '{[*solo, *mute][0]}' does not glow; nothing here does")

    def set_muted(self, *, world: bool, emission: bool) -> None:
        """Leave the world's light out, or what glows and its light; lights say it of themselves.

        What is muted is kept, and refined only when it is back.
        """
        self._lights.mute(world=world, emission=emission)

    def set_world(self, world: World | None) -> None:
        """The world was edited; None for a black one.

        Raises:
            InputError: it varies with direction, and the cache has no picture of it, or one of
                another world.
        """
        if world is not None and world.needs_baking:
            world = replace(world, equirect=self._store.read_world(world.fingerprint))
        lit = world is not None and (world.equirect is not None or np.any(world.radiance))
        self._world = world
        self._world_textures = WorldTextures.upload(world) if world is not None and lit else None
        self._touch(WORLD)

    def set_surface_edits(self, edits: SurfaceEdits) -> None:
        """Surfaces were edited: every layer is redone; the view's samples are kept."""
        if self._glowing is not None:
            self._glowing.set_edits(edits)
        if self._sampler.set_edits(edits):
            self._drawing.follow_layout()
            self._touch(SURFACE_EDITS)
            self._follow_glow()

    def set_samples(self, samples: int) -> None:
        """Samples of a finished picture; what was drawn for another number is dropped."""
        if samples == self._stages.count:
            return
        before = self._wanted_visibility
        self._stages.set_count(samples)
        self._graph.touch(SAMPLES)
        if self._wanted_visibility != before:
            self._sampler.forget_shading_samples()
            self._touch(VIEW)

    def set_shadows(self, shadows: ShadowSettings) -> None:
        """Find shadows another way, or with finer maps."""
        shadows = shadows.settled(in_software=draws_in_software())
        if shadows == self._shadow_settings:
            return
        self._shadow_settings = shadows
        self._drawing.set_shadows(shadows)
        self._forget(self._graph.replace(self._passes()))
        self._touch(*(light_input(x.name, "shadow casting") for x in self._lights if x.use_shadow))

    # Pictures -----------------------------------------------------------------------------

    @property
    def samples_done(self) -> int:
        """Samples of the refined picture that every layer has."""
        self._require_layers()
        done = self._stages.next_sample(self._lights.wanted)
        return self._stages.count if done is None else done

    @property
    def shown_stride(self) -> int:
        """View pixels along the side of a pixel of the coarsest layer that is shown; 0 while some
        layer has nothing to show yet."""
        self._require_layers()
        shown = [self._stages.shown(name) for name in self._lights.wanted]
        return 0 if None in shown else max(s.stack.stride for s in shown if s is not None)

    def step(self, *, announce: bool = False) -> bool:
        """Do the next bit of work toward a finished picture; False when there is none.

        A bit is one sample of one layer, the edited light's first, so that a new edit waits for
        no more than that.

        Args:
            announce: where a shader has to be compiled, which may take a second, do nothing but
                set `compiling`, once; the next step compiles it.
        """
        self.compiling = ""
        with announced_compilation() if announce else nullcontext():
            try:
                return self._step()
            except UncompiledError as uncompiled:
                self.compiling = uncompiled.name
                return True

    def _step(self) -> bool:
        self._require_layers()
        if self._stages.has_previews(self._lights.wanted) and self._find_shading_samples():
            return True
        start = time.perf_counter()
        drawn = self._stages.advance(self._lights.wanted, self._drawer, self._edited)
        if drawn is None:
            return False
        name, staged = drawn
        begun = self._begun
        begun.names.append(name)
        begun.start = min(begun.start, start)
        texture = staged.layer.textures[0]
        is_first = self._stages.is_first_of_move(staged.stack)
        if is_first and not self._stages.has_previews(self._lights.wanted):
            # The next light's rays are traced while this one is shaded.
            self._fence.begin()
        else:
            self._fence.wait(texture)
            self._finish_begun(is_preview=self._stages.is_preview(staged))
        self._clean(name)
        return True

    def _finish_begun(self, *, is_preview: bool) -> None:
        """All that was begun is drawn: note how long each took, of those that overlapped the
        mean."""
        names, took = self._begun.names, self._begun.mean(time.perf_counter())
        # A pass's first time is that of its shader's compilation.
        if is_preview and all(self._graph.seconds(name) is not None for name in names):
            self._stages.preview_s = took
        for name in names:
            self._graph.ran(name, took, last=self._stages.finished(name))
        self._begun = Begun()

    def render(self, progress: Progress = silent) -> Picture:
        """All samples of the current view.

        Raises:
            RuntimeError: no view was set.
            Cancelled: raised by `progress`; what was drawn is kept.
        """
        steps = self.rendering()
        while True:
            try:
                progress(*next(steps))
            except StopIteration as end:
                return cast("Picture", end.value)

    def rendering(self) -> Generator[tuple[float, str], None, Picture]:
        """The same bit by bit: yields how far it is, (share, message), and returns the picture."""
        self._require_layers()
        names, count = self._lights.wanted, self._stages.count
        start = 0.0
        if self._stages.next_sample(names) is not None:
            while self._find_shading_samples():
                start = _VISIBILITY_SHARE * self._sampler.shading_progress
                yield start, "Visibility"
        while (k := self._stages.next_sample(names)) is not None:
            done = sum(self._stages.samples(name) for name in names) / (count * len(names))
            yield start + (1.0 - start) * done, f"Sample {k + 1} of {count}"
            drawn = self._stages.refine(names, self._drawer)
            if drawn is not None:
                self._clean(drawn)
        yield 1.0, f"{count} samples"
        layers = {name: self._read_layer(name) for name in self._lights.audible}
        return Picture(
            combined=read_texture(self._draw_mix(keep=False)),
            layers={
                self._lights.shown_name(n): np.sum([*parts.values()], 0)
                for n, parts in layers.items()
            },
            correspondence=self._sampler.correspondence().read(),
            coverage=self._sampler.coverage(),
            samples=count,
            glowing=tuple(light.name for light in self._lights if light.type == "MESH"),
            lobes={
                light.name: parts
                for name, parts in layers.items()
                if self._drawing.parts and (light := self._lights.of_layer(name)) is not None
            },
        )

    def draw_combined(self) -> Texture:
        """The sum of all layers as they stand, RGBA32F scene-linear.

        A layer without a steady mean is shown as its preview, one without that as its coarse one.
        """
        return self._draw_mix(keep=True)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each thing about the cache that the picture suffers from."""
        excess = self._sampler.warnings
        if self._glowing is not None:
            excess = (*excess, *self._glowing.warnings)
        excess = (*excess, *self._grey_shadows())
        if self._world_textures is None or "ambient_occlusion" in self._store.plan.stored:
            return excess
        missing = (
            "the cache was baked without the world's light, which reaches everywhere in the first "
            "picture; bake it again for its occlusion"
        )
        return (*excess, missing)

    def _grey_shadows(self) -> tuple[str, ...]:
        """Says which materials' coloured shadows are shown without colour."""
        maps = any(x.use_shadow and not self._shadow_settings.traces(x) for x in self._lights)
        geometry = self._sampler.geometry
        tinted = [geometry.material_names[x.material_id] for x in geometry.sheers if x.is_tinted]
        if not (maps and tinted):
            return ()
        names = ", ".join(f"'{name}'" for name in tinted)
        said = f"shadow maps show the shadows of tinted materials ({names}) grey"
        return (f"{said}; choose traced shadows for their colour",)

    @property
    def cache_bytes(self) -> int:
        """Bytes of the GPU's memory that the cache takes."""
        return self._sampler.pages.gpu_bytes

    @property
    def coverage(self) -> Coverage:
        """What the cache does not show of the current view."""
        return self._sampler.coverage()

    def confidence(self) -> Confidence:
        """How far the current view's pixels may be trusted."""
        return self._sampler.confidence()

    def hole_points(self, *, and_soft: bool = False) -> HolePoints:
        """What the current view sees, and where the cache does not show it; and where only
        coarsely, if that is asked."""
        return self._sampler.hole_points(and_soft=and_soft)

    @property
    def graph(self) -> FrameGraph:
        """The passes behind the picture, for showing them."""
        return self._graph

    # Inside -------------------------------------------------------------------------------

    def _passes(self) -> tuple[FramePass, ...]:
        traces = self._shadow_settings.traces
        nodes = [
            LightNode(light.name, light.use_shadow, traces(light) or light.type == "SUN")
            for light in self._lights
        ]
        return frame_passes(nodes, has_emission=self._has_emission)

    def _follow_glow(self) -> None:
        """The view sees other places, or what glows changed."""
        if self._glowing is not None and self._view is not None:
            self.set_lights(self._given)

    def _find_shading_samples(self) -> bool:
        """Do the next bit of work towards the pixels' lists; False when there is none."""
        if self._stages.count <= 1:
            return False
        return self._sampler.find_shading_samples(self._wanted_visibility, self._stages.count)

    @property
    def _wanted_visibility(self) -> int:
        """Visibility samples of the pixels' lists."""
        if self._visibility is not None:
            return self._visibility
        return max(VISIBILITY_SAMPLES, self._stages.count)

    def _touch(self, *inputs: str) -> None:
        self._forget(self._graph.touch(*inputs))

    def _forget(self, dirty: Collection[str]) -> None:
        """Drop what dirty passes made."""
        self._begun = Begun()
        if SURFACES in dirty and self._view is not None:
            self._drawing.forget_surfaces()
        for light in self._lights:
            if shadow_pass(light.name) in dirty:
                self._drawing.forget_shadows(light.name)
        self._stages.drop(dirty)

    def _clean(self, layer: str) -> None:
        """Tell the graph that a sample was added to a layer."""
        # Which needed the view's surfaces.
        self._graph.clean(VISIBLE_SURFACE, CORRESPONDENCE, SURFACES)
        if self._stages.finished(layer):
            light = self._lights.of_layer(layer)
            self._graph.clean(layer, *(() if light is None else (shadow_pass(light.name),)))
        if self._stages.next_sample(self._lights.wanted) is None:
            self._graph.clean(PICTURE)

    def _textures_of(self, layer: str) -> int:
        """How many textures a layer has."""
        return max(len(self._drawing.parts), 1) if self._lights.of_layer(layer) else 1

    def _in_cells(self, layer: str) -> bool:
        """Whether a layer is that of a light whose highlights come cell by cell."""
        light = self._lights.of_layer(layer)
        return light is not None and self._drawing.in_cells(light)

    def _required_view(self) -> View:
        if self._view is None:
            raise RuntimeError("set a view before drawing")
        return self._view

    def _require_layers(self) -> None:
        view = self._required_view()
        self._stages.require(self._lights.layers, view.width, view.height)

    def _draw_mix(self, *, keep: bool) -> Texture:
        view = self._required_view()
        parts = {}
        audible = self._lights.audible
        for name in self._lights.wanted:
            shown = self._stages.shown(name)
            if shown is not None:
                layer = shown.layer
                scale = self._lights.scale(name) if name in audible else np.zeros(3)
                red, green, blue = (float(v) for v in scale / layer.samples)
                parts[name] = MixPart(
                    layer.textures,
                    (red, green, blue, 1.0 / layer.samples),
                    shown.stack.stride,
                    (layer.serial, layer.samples),
                )
        return self._mix.draw(parts, view.width, view.height, keep=keep)

    def _read_layer(self, name: str) -> dict[str, NDArray[np.float32]]:
        """A layer's parts, (H, W, 3) each."""
        layer = self._stages.mean(name)
        factor = (self._lights.scale(name) / layer.samples).astype(np.float32)
        parts = self._drawing.parts if self._lights.of_layer(name) else ()
        return {
            part: read_texture(texture)[..., :3] * factor
            for part, texture in zip(parts or ("",), layer.textures, strict=True)
        }

    def _drawer(self, stack: LayerStack) -> Callable[[str, LightLayer, int], None]:
        """What draws the samples of a stack's layers."""

        def draw(name: str, layer: LightLayer, k: int) -> None:
            try:
                add_sample(name, layer, k)
            except UncompiledError:
                # Some of the sample may be in it.
                stack.drop(name)
                raise

        def add_sample(name: str, layer: LightLayer, k: int) -> None:
            light = self._lights.of_layer(name)
            if light is not None:
                sparse = self._stages.is_first_of_move(stack)
                self._drawing.light(light, layer, k, stack.count, stack.stride, sparse=sparse)
            elif name == EMISSION_LAYER:
                self._drawing.emission(layer, k, stack.stride)
            else:
                self._drawing.world(
                    self._world_textures,
                    self._required_view(),
                    layer,
                    k,
                    count=stack.count,
                    stride=stack.stride,
                    film_transparent=self._world is not None and self._world.film_transparent,
                )

        return draw
