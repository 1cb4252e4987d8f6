# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws single samples of layers: the surfaces, a light's shadow, and the pass that shades."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.geometry_buffer import GeometryBuffer
from ...corrmap.pixel_list_pass import PixelListTextures
from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...corrmap.surface_sampler import SurfaceSampler
from ...glsl.shader import read_texture
from ...scene.frame_across import frame_across
from ...scene.light import Light
from ...scene.view import View
from ..filters.light_filters import LightFilters
from ..light_points.light_contact import touches_surface
from ..light_points.light_sample import LightSample, light_sample
from ..lights.light_edit import changed_parts, layer_tint
from ..lights.light_objects import LightObjects
from ..lights.light_pass import LightPass, lobe_parts
from ..lights.light_reach import ReachPass
from ..lights.mesh_lights import POINTS
from ..shading.albedo_pass import AlbedoTextures
from ..shading.shadow import Shadow
from ..shading.surface_pass import EmissionPass
from ..shadows.reached_places import ReachedPlaces
from ..shadows.shadow_cache import ShadowCache
from ..shadows.shadow_frustum import ShadowSettings
from ..shadows.shadow_light import shadow_light, shining_everywhere
from ..shadows.shadow_pass import ShadowMap, ShadowPass
from ..shadows.traced_shadow import TracedShadowPass
from ..world.environment import EnvironmentLight, EnvironmentScene
from ..world.world_pass import BackgroundPass, WorldTextures
from .layer_stack import LightLayer
from .resolve_pass import ResolvePass
from .sheer_blend import SheerBlend

# Every n-th pixel's surface along each axis is looked at to fit a sun's shadow map.
_RECEIVER_STRIDE = 4


class LayerDrawing:
    """The passes behind the layers, and what they keep between samples.

    Args:
        sampler: gives the surfaces of the view.
        shadows: how shadows are found, and how fine their maps are.
        begin: lets the GPU begin with what was drawn, see `Fence.begin`.
        has_emission: whether surfaces may glow.
        split: whether lights' layers are split by the kinds of lobes.
    """

    def __init__(
        self,
        sampler: SurfaceSampler,
        shadows: ShadowSettings,
        begin: Callable[[], None],
        *,
        has_emission: bool,
        split: bool,
    ) -> None:
        self._sampler = sampler
        self._settings = shadows
        self._begin = begin
        self._touching: dict[tuple[str, bool], bool] = {}
        self._objects = LightObjects(sampler.geometry)
        self._pass: ShadowPass | None = None
        self._geometry: GeometryBuffer | None = None
        self._shadows = ShadowCache()
        self._traced: TracedShadowPass | None = None
        self._receivers: tuple[NDArray[np.float64], NDArray[np.float64] | None] | None = None
        self._places: ReachedPlaces | None = None
        self._reached: dict[str, tuple[Light, NDArray[np.float64]]] = {}
        self._tables = AlbedoTextures()
        layout = sampler.layout
        self._has_emission = has_emission
        self._filters = LightFilters()
        self._reach = ReachPass(self._filters)
        self._light_pass = LightPass(self._tables, layout, self._filters, split=split)
        self._background_pass = BackgroundPass()
        self._resolve = ResolvePass()
        self._sheer_blend = SheerBlend()
        self._layout: SurfaceLayout | None = None
        self.follow_layout()
        self.parts = lobe_parts(layout) if split else ()

    # What changed -------------------------------------------------------------------------

    def follow_layout(self) -> None:
        """The surfaces may be laid out otherwise: shade them so."""
        layout = self._sampler.layout
        if layout == self._layout:
            return
        self._layout = layout
        self._light_pass.set_layout(layout)
        self._environment = EnvironmentLight(self._tables, layout)
        self._emission_pass = EmissionPass(layout) if self._has_emission else None

    def forget_shadows(self, light: str) -> None:
        """A light moved, changed its extent, or what it shines on moved."""
        self._shadows.drop(light)
        for moved in (False, True):
            self._touching.pop((light, moved), None)

    def forget_light(self, light: str) -> None:
        """A light is gone."""
        self.forget_shadows(light)
        self._filters.forget(light)

    def set_shadows(self, shadows: ShadowSettings) -> None:
        """Find shadows another way, or draw finer maps."""
        self._settings = shadows
        self._shadows.clear()
        if self._geometry is not None:
            self._pass = ShadowPass(self._geometry, shadows)

    def forget_surfaces(self) -> None:
        """The view sees other surfaces."""
        self._receivers = self._places = None
        self._reached.clear()
        if self._sampler.geometry_buffer is not self._geometry:
            self._geometry = self._sampler.geometry_buffer
            self._pass = ShadowPass(self._geometry, self._settings)
            self._traced = None
            self._objects = LightObjects(self._sampler.geometry)
            self._shadows.clear()

    @property
    def shadow_bytes(self) -> int:
        """Bytes of the GPU's memory that shadow maps take."""
        return self._shadows.nbytes

    # Samples ------------------------------------------------------------------------------

    def light(
        self,
        light: Light,
        layer: LightLayer,
        k: int,
        count: int,
        stride: int,
        *,
        sparse: bool = False,
    ) -> None:
        """Add sample k of `count` of a light to its layer, with an intensity of `layer_tint`; see
        `TracedShadowPass.draw` for `sparse`."""
        objects = self._objects.of(light).texture
        self._shade(
            layer,
            k,
            stride,
            lambda surface, target: self._add_light(
                light, surface, target, (k, count), stride, sparse=sparse
            ),
            with_objects=objects is not None,
        )

    def _shade(
        self,
        layer: LightLayer,
        k: int,
        stride: int,
        draw: Callable[[SurfaceBuffer, Any], None],
        *,
        with_objects: bool = False,
        cover: float = 0.0,
    ) -> None:
        """Let `draw` shade sample k of the view, and add the pixels that come of it to a layer,
        whose alpha says what is covered if `cover` is 1."""
        lists = self._lists(stride)
        if lists is None:
            seen = self._sampler.sample(k, with_objects=with_objects)
            self._sheer_blend.draw(layer, seen, draw, stride=stride, cover=cover)
            return
        surface = self._sampler.shading_sample(k, with_objects=with_objects)
        self._resolve.draw(
            layer, lists, surface.height, lambda target: draw(surface, target), cover=cover
        )

    def _lists(self, stride: int) -> PixelListTextures | None:
        """The pixels' lists, if there are any for a layer's resolution."""
        return self._sampler.lists if stride == 1 else None

    def _add_light(
        self,
        light: Light,
        surface: SurfaceBuffer,
        target: Any,
        sample_of: tuple[int, int],
        stride: int,
        *,
        sparse: bool,
    ) -> None:
        """Add what sample k of `count` of a light makes of surfaces to a framebuffer."""
        k, count = sample_of
        objects = self._objects.of(light).texture
        points = POINTS if light.type == "MESH" else 1
        for j in range(k * points, (k + 1) * points):
            sample = self._light_sample(light, j, count * points)
            shadow: Shadow | None = None
            if light.use_shadow:
                caster = shadow_light(light)
                point = sample
                if caster is not light:
                    point = self._light_sample(caster, j, count * points, moved=True)
                    if self._settings.traces(light):
                        caster = shining_everywhere(caster)
                shadow = self._shadow(surface, caster, point, stride, sparse=sparse)
            self._light_pass.draw(
                surface,
                light,
                sample,
                target,
                shadow=shadow,
                color=layer_tint(light),
                weight=1.0 / points,
                stride=stride,
                objects=objects,
                samples=count,
            )

    def emission(self, layer: LightLayer, k: int, stride: int) -> None:
        """Add what surfaces send out by themselves."""
        emission = self._emission_pass
        if emission is not None:
            self._shade(layer, k, stride, lambda s, target: emission.draw(s, target, stride=stride))

    def world(
        self,
        world: WorldTextures | None,
        view: View,
        layer: LightLayer,
        k: int,
        *,
        count: int,
        stride: int,
        film_transparent: bool,
    ) -> None:
        """Add sample k of `count` of the world behind the scene, the picture's alpha, and the
        world's light."""

        def draw(surface: SurfaceBuffer, target: Any) -> None:
            # Without lists a sample is a picture of its own, through its point of the lens.
            sample = self._sampler.looks.sample(k) if self._lists(stride) is None else None
            if not surface.is_layer:
                self._background_pass.draw(
                    surface,
                    world,
                    view if sample is None else sample.view,
                    target,
                    offset=None if sample is None else sample.offset,
                    film_transparent=film_transparent,
                    stride=stride,
                )
            if world is not None:
                self._add_world(world, surface, target, (k, count), stride)

        self._shade(layer, k, stride, draw, cover=1.0)

    def _add_world(
        self,
        world: WorldTextures,
        surface: SurfaceBuffer,
        target: Any,
        sample_of: tuple[int, int],
        stride: int,
    ) -> None:
        """Add what sample k of `count` of the world makes of surfaces to a framebuffer."""
        if self._pass is None:
            raise RuntimeError("set a view before drawing the world's light")
        scene = EnvironmentScene(
            self._sampler.geometry,
            self._pass,
            self._visible_receivers()[0],
            lambda *asked: self._sun_shadow(surface, *asked, stride=stride),
            lambda: self._sampler.local_scene,
            one_by_one=self._settings.method == "traced",
        )
        if sample_of[1] == 1:
            self._environment.draw_first(surface, world, scene, target, stride)
        else:
            self._environment.draw(surface, world, scene, target, sample_of)

    def in_cells(self, light: Light) -> bool:
        """Whether a light's highlights come cell by cell, one for each sample."""
        parted = light.has_cells or (light.has_disk and self._settings.traces(light))
        return parted and self._sampler.layout.has("HAS_SPECULAR")

    def visible_places(self) -> NDArray[np.float64]:
        """(N, 3) world space: some of what the view sees."""
        return self._judged().places

    def reached(self, light: Light) -> NDArray[np.float64]:
        """(N,) the share of a light's points that reach each of `visible_places`."""
        known = self._reached.get(light.name)
        if known is None or not {*changed_parts(known[0], light)} <= {"color"}:
            look, table = light.controls.shadow, self._objects.of(light).texture
            casts = light.use_shadow and look.density == 1.0 and not any(look.color)
            places = self._judged()
            share = places.share(
                light,
                self._reach,
                self._tracing().local_scene(places.origin) if casts else None,
                self._objects.caster_triangles(light),
                None if table is None else (self._sampler.sample(0, with_objects=True), table),
            )
            self._reached[light.name] = known = (light, share)
        return known[1]

    # Inside -------------------------------------------------------------------------------

    def _shadow(
        self,
        surface: SurfaceBuffer,
        light: Light,
        sample: LightSample,
        stride: int,
        *,
        sparse: bool,
    ) -> Shadow:
        if self._settings.traces(light):
            # The view's surfaces are drawn while rays are traced.
            self._begin()
            return self._tracing().draw(
                surface,
                light,
                sample,
                stride=stride,
                casters=self._objects.caster_triangles(light),
                objects=self._objects.of(light).texture,
                sparse=sparse,
            )
        return self._shadows.get(light.name, sample, lambda: self._shadow_map(light, sample))

    def _judged(self) -> ReachedPlaces:
        if self._places is None:
            self._places = ReachedPlaces(self._sampler.sample(0))
        return self._places

    def _tracing(self) -> TracedShadowPass:
        if self._traced is None:
            sampler = self._sampler
            self._traced = TracedShadowPass(sampler.geometry, self._reach, sampler.local_scene)
        return self._traced

    def _shadow_map(self, light: Light, sample: LightSample) -> ShadowMap:
        if self._pass is None:
            raise RuntimeError("set a view before drawing shadows")
        bounds = self._sampler.geometry.bounds
        casters = self._objects.of(light).casters
        receivers, eye = self._visible_receivers()
        return self._pass.draw(light, sample, bounds, receivers, objects=casters, eye=eye)

    def _sun_shadow(
        self,
        surface: SurfaceBuffer,
        toward: NDArray[np.float64],
        spots: NDArray[np.float64],
        thorough: float,
        *,
        stride: int,
    ) -> Shadow:
        """The shadow of what shines from a direction (3,) of the world; see `EnvironmentScene`."""
        if self._pass is None:
            raise RuntimeError("set a view before drawing shadows")
        world_from_light = np.eye(4)
        world_from_light[:3, :3] = np.stack([*frame_across(toward), toward], axis=1)
        sun, sample = Light("", "SUN", world_from_light, 1.0, np.ones(3)), LightSample(toward, 1)
        if self._settings.method == "traced":
            sample = replace(sample, spots=spots)
            return self._tracing().draw(surface, sun, sample, stride=stride, thorough=thorough)
        receivers, eye = self._visible_receivers()
        bounds = self._sampler.geometry.bounds
        return self._pass.draw(sun, sample, bounds, receivers, eye=eye)

    def _light_sample(
        self, light: Light, k: int, count: int, *, moved: bool = False
    ) -> LightSample:
        """A light's point; `moved` of a light as its shadows see it."""
        if self._settings.traces(light):
            return light_sample(light, k, count, per_receiver=True)
        key = (light.name, moved)
        if key not in self._touching:
            casters = self._objects.of(light).casters
            self._touching[key] = touches_surface(light, self._sampler.geometry, casters)
        return light_sample(light, k, count, touching=self._touching[key])

    def _visible_receivers(self) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """(N, 3) world-space points that the view sees, for fitting sun shadow maps; and where
        from, (3,), or None for a parallel projection, which has them all equally large."""
        if self._receivers is None:
            surface: SurfaceBuffer = self._sampler.sample(0)
            stride = _RECEIVER_STRIDE
            position = read_texture(surface.position)[::stride, ::stride].reshape(-1, 4)
            visible = position[position[:, 3] > 0.0, :3].astype(np.float64)
            eye = surface.eye + surface.origin if surface.perspective else None
            self._receivers = (visible + surface.origin, eye)
        return self._receivers
