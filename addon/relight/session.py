# SPDX-License-Identifier: GPL-3.0-or-later
"""The one object behind the viewport, F12, the command line and the tests.

A `RelightSession` owns a scene's geometry, its cache, its lights, its world and the view. It is
told what changed and redoes only what depends on it:

    geometry  ->  the triangles on the GPU, the view's surfaces, every layer
    view      ->  the view's surfaces, every layer
    a light   ->  that light's layer
    world     ->  the world's layer

A picture is the mean of samples. Sample k has its own place in the pixel (by Cycles' filter)
and its own point of every light, so that edges and soft shadows converge together. The first
picture of an interactive view is a single sample from the pixels' and the lights' centres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..caching.stored_framebuffers import StoredFramebuffers
from ..corrmap.correspondence import Coverage
from ..corrmap.geometry_buffer import GeometryBuffer
from ..corrmap.pixel_filter import pixel_offsets
from ..corrmap.surface_buffer import SurfaceBuffer
from ..corrmap.surface_sampler import SurfaceSampler
from ..corrmap.tile_pages import CACHE_BUDGET
from ..errors import InputError
from ..glsl.shader import Texture, framebuffer, read_texture, texture_2d
from ..progress import Progress, silent
from ..scene.geometry import SceneGeometry
from ..scene.light import Light
from ..scene.same import is_same
from ..scene.view import View
from ..scene.world import World
from .albedo_pass import AlbedoTextures
from .blend_pass import SumPass
from .layer_stack import LayerStack, LightLayer
from .light_contact import touches_surface
from .light_pass import LightPass
from .light_sample import LightSample, light_sample
from .shadow_frustum import ShadowSettings
from .shadow_pass import ShadowMap, ShadowPass
from .surface_pass import EmissionPass
from .world_pass import AmbientPass, BackgroundPass, WorldTextures

if TYPE_CHECKING:
    from ..caching.store import CacheStore

WORLD_LAYER = "World"
EMISSION_LAYER = "Emission"

# Inside, a light's layer goes by its name behind this, so that a light called "World" is a light.
_LIGHT_KEY = "light "

# A running mean replaces the centred preview once it has this many samples: fewer would jump
# between single hard shadows.
_STEADY_SAMPLES = 4

# Every n-th pixel's surface along each axis is looked at to fit a sun's shadow map.
_RECEIVER_STRIDE = 4


@dataclass(frozen=True)
class Picture:
    """A relit view, scene-linear Rec.709, row 0 at the bottom.

    Attributes:
        combined: (H, W, 4) float32, alpha 0 where a transparent film shows through.
        layers: (H, W, 3) float32 by light name; WORLD_LAYER and EMISSION_LAYER beside them, with
            " (scene)" behind where a light has that name.
        correspondence: (H, W, 4) float32: camera number or -1, u, v, score.
        coverage: what the cache did not show.
        samples: samples in the mean.
    """

    combined: NDArray[np.float32]
    layers: Mapping[str, NDArray[np.float32]]
    correspondence: NDArray[np.float32]
    coverage: Coverage
    samples: int


class RelightSession:
    """Relights one scene from one cache. Needs a GPU context for its whole life.

    Args:
        geometry: the scene's triangles.
        store: its cache, with at least one finished camera.
        samples: samples in a finished picture.
        shadows: resolution of the shadow maps.
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
        self._lights: dict[str, Light] = {}
        self._touching: dict[str, bool] = {}
        self._world: World | None = None
        self._world_textures: WorldTextures | None = None
        self._view: View | None = None
        self._shadow_settings = shadows or ShadowSettings()
        self._shadow_pass: ShadowPass | None = None
        self._shadow_geometry: GeometryBuffer | None = None
        self._preview_shadows: dict[str, ShadowMap] = {}
        self._receivers: NDArray[np.float64] | None = None
        tables = AlbedoTextures()
        layout = self._sampler.layout
        self._light_pass = LightPass(tables, layout)
        self._ambient_pass = AmbientPass(tables, layout)
        self._background_pass = BackgroundPass()
        self._emission_pass = EmissionPass(layout) if store.plan.uses("emission") else None
        self._sum_pass = SumPass()
        self._preview = LayerStack(1)
        self._refined = LayerStack(samples)

    # What changed -------------------------------------------------------------------------

    def set_geometry(self, geometry: SceneGeometry) -> None:
        """Objects moved or changed their shape; the cache stays."""
        self._sampler.set_geometry(geometry)
        self._touching.clear()
        if self._view is not None:
            view, self._view = self._view, None
            self.set_view(view)

    def set_view(self, view: View) -> None:
        """The camera moved, or the picture has another size."""
        if not self._sampler.set_view(view):
            return
        self._view = view
        self._receivers = None
        self._preview.clear()
        self._refined.clear()
        for name in [n for n, light in self._lights.items() if light.type == "SUN"]:
            self._preview_shadows.pop(name, None)
        geometry = self._sampler.geometry_buffer
        if geometry is not self._shadow_geometry:
            self._shadow_pass = ShadowPass(geometry, self._shadow_settings)
            self._shadow_geometry = geometry
            self._preview_shadows.clear()

    def set_lights(self, lights: Sequence[Light]) -> None:
        """Lights were edited, added or removed; only their own layers are redone."""
        new = {light.name: light for light in lights}
        for name in {**self._lights, **new}:
            if not is_same(self._lights.get(name), new.get(name)):
                self._preview.drop(_LIGHT_KEY + name)
                self._refined.drop(_LIGHT_KEY + name)
                self._preview_shadows.pop(name, None)
                self._touching.pop(name, None)
        self._lights = new

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
        self._preview.drop(WORLD_LAYER)
        self._refined.drop(WORLD_LAYER)

    def set_samples(self, samples: int) -> None:
        """Samples of a finished picture; what was drawn for another number is dropped."""
        if samples != self._refined.count:
            self._refined = LayerStack(samples)

    # Pictures -----------------------------------------------------------------------------

    @property
    def samples_done(self) -> int:
        """Samples of the refined picture that every layer has."""
        self._require_layers()
        done = self._refined.next_sample
        return self._refined.count if done is None else done

    def step(self) -> bool:
        """Do the next bit of work toward a finished picture; False when there is none.

        The preview comes first, whole; then one sample after another.
        """
        self._require_layers()
        if self._preview.next_sample is not None and self.samples_done < self._steady_samples:
            self._preview.advance(self._draw_preview)
            return True
        if self._refined.next_sample is not None:
            self._refined.advance(self._draw_refined)
            return True
        return False

    def render(self, progress: Progress = silent) -> Picture:
        """All samples of the current view.

        Raises:
            RuntimeError: no view was set.
            Cancelled: raised by `progress`; what was drawn is kept.
        """
        self._require_layers()
        count = self._refined.count
        while (k := self._refined.next_sample) is not None:
            progress(k / count, f"Sample {k + 1} of {count}")
            self._refined.advance(self._draw_refined)
        progress(1.0, f"{count} samples")
        return Picture(
            combined=read_texture(self.draw_combined()),
            layers={self._shown_name(key): self._read_layer(key) for key in self._layer_names()},
            correspondence=self._sampler.correspondence().read(),
            coverage=self._sampler.coverage(),
            samples=count,
        )

    def draw_combined(self) -> Texture:
        """The sum of all layers as they stand, RGBA32F scene-linear.

        A layer without a steady mean is shown as its preview.
        """
        view = self._required_view()
        texture = texture_2d(view.width, view.height)
        target = framebuffer([texture])
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0))
        for name in self._layer_names():
            layer = self._shown(name)
            if layer is not None:
                self._sum_pass.add(layer.texture, target, 1.0 / layer.samples)
        return texture

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each thing about the cache that the picture suffers from."""
        excess = self._sampler.warnings
        if self._world_textures is None or "ambient_occlusion" in self._store.plan.stored:
            return excess
        missing = (
            "the cache was baked without the world's light, which now reaches everywhere; bake "
            "it again for its occlusion"
        )
        return (*excess, missing)

    @property
    def cache_bytes(self) -> int:
        """Bytes of the GPU's memory that the cache takes."""
        return self._sampler.pages.gpu_bytes

    @property
    def coverage(self) -> Coverage:
        """What the cache does not show of the current view."""
        return self._sampler.coverage()

    # Inside -------------------------------------------------------------------------------

    def _required_view(self) -> View:
        if self._view is None:
            raise RuntimeError("set a view before drawing")
        return self._view

    @property
    def _steady_samples(self) -> int:
        """From how many samples on a layer's mean is shown instead of its preview."""
        return min(_STEADY_SAMPLES, self._refined.count)

    def _layer_names(self) -> list[str]:
        # The world's layer is always there: it holds the picture's alpha.
        names = [*(_LIGHT_KEY + name for name in self._lights), WORLD_LAYER]
        if self._emission_pass is not None:
            names.append(EMISSION_LAYER)
        return names

    def _require_layers(self) -> None:
        view = self._required_view()
        for stack in (self._preview, self._refined):
            stack.require(self._layer_names(), view.width, view.height)

    def _shown(self, name: str) -> LightLayer | None:
        refined = self._refined.get(name)
        preview = self._preview.get(name)
        if refined is not None and refined.samples >= self._steady_samples:
            return refined
        for layer in (preview, refined):
            if layer is not None and layer.samples:
                return layer
        return None

    def _light_of(self, key: str) -> Light | None:
        """The light whose layer goes by this key; None for the world's and the emission's."""
        if not key.startswith(_LIGHT_KEY):
            return None
        return self._lights.get(key.removeprefix(_LIGHT_KEY))

    def _shown_name(self, key: str) -> str:
        if key.startswith(_LIGHT_KEY):
            return key.removeprefix(_LIGHT_KEY)
        return f"{key} (scene)" if key in self._lights else key

    def _read_layer(self, name: str) -> NDArray[np.float32]:
        layer = self._refined[name]
        return read_texture(layer.texture)[..., :3] / np.float32(layer.samples)

    def _draw_preview(self, name: str, layer: LightLayer, _k: int) -> None:
        light = self._light_of(name)
        shadow = None
        if light is not None and light.use_shadow:
            shadow = self._preview_shadows.get(light.name)
            if shadow is None:
                shadow = self._preview_shadows[light.name] = self._shadow(light, 0, 1)
        self._draw(name, layer, 0, 1, shadow)

    def _draw_refined(self, name: str, layer: LightLayer, k: int) -> None:
        light = self._light_of(name)
        shadow = None
        if light is not None and light.use_shadow:
            shadow = self._shadow(light, k, self._refined.count)
        self._draw(name, layer, k, self._refined.count, shadow)

    def _draw(
        self, name: str, layer: LightLayer, k: int, count: int, shadow: ShadowMap | None
    ) -> None:
        surface = self._sampler.sample(k)
        light = self._light_of(name)
        if light is not None:
            point = self._light_sample(light, k, count)
            self._light_pass.draw(surface, light, point, layer.target, shadow=shadow)
        elif name == EMISSION_LAYER and self._emission_pass is not None:
            self._emission_pass.draw(surface, layer.target)
        else:
            self._draw_world(surface, layer, k)

    def _draw_world(self, surface: SurfaceBuffer, layer: LightLayer, k: int) -> None:
        view = self._required_view()
        x, y = pixel_offsets(view.pixel_filter, 1, first=k)[0]
        self._background_pass.draw(
            surface,
            self._world_textures,
            view,
            layer.target,
            offset=(float(x), float(y)),
            film_transparent=self._world is not None and self._world.film_transparent,
        )
        if self._world_textures is not None:
            self._ambient_pass.draw(surface, self._world_textures, layer.target)

    def _shadow(self, light: Light, k: int, count: int) -> ShadowMap:
        if self._shadow_pass is None:
            raise RuntimeError("set a view before drawing shadows")
        return self._shadow_pass.draw(
            light,
            self._light_sample(light, k, count),
            self._sampler.geometry.bounds,
            self._visible_receivers(),
        )

    def _light_sample(self, light: Light, k: int, count: int) -> LightSample:
        if light.name not in self._touching:
            self._touching[light.name] = touches_surface(light, self._sampler.geometry)
        return light_sample(light, k, count, touching=self._touching[light.name])

    def _visible_receivers(self) -> NDArray[np.float64]:
        """(N, 3) world-space points that the view sees, for fitting sun shadow maps."""
        if self._receivers is None:
            surface = self._sampler.sample(0)
            stride = _RECEIVER_STRIDE
            position = read_texture(surface.position)[::stride, ::stride].reshape(-1, 4)
            visible = position[position[:, 3] > 0.0, :3].astype(np.float64)
            self._receivers = visible + surface.origin
        return self._receivers
