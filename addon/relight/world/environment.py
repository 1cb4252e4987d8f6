# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as a light, sample by sample.

The first picture is instant: the world without its suns, dimmed by ambient occlusion, and the suns
as lights with one shadow map each. A refined picture's samples converge to Cycles' direct light of
the world. Sample k has

- of each sun, a direction of its own within it, with a shadow map;
- a few directions towards the rest of the world, spread by its light, with a shadow map each.
  Lambert bases take from these only how far the shadows differ from their ambient occlusion;
- for microfacet lobes, rays of each pixel's own along mirrored directions, traced with embree;
  lobes and directions share the work by the balance heuristic.

What a scene does not need is left out: under a world of one colour Lambert bases have all their
light from the occlusion, and microfacet lobes theirs from rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.local_scene import LocalScene
from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import read_texture
from ...scene.geometry import SceneGeometry
from ..shading.albedo_pass import AlbedoTextures
from ..shading.shadow import Shadow
from ..shadows.shadow_pass import ShadowPass
from .environment_pass import DirectionPass, RayPass
from .environment_rays import EnvironmentRays
from .world_directions import Directions, sobol_points
from .world_pass import AmbientPass, WorldTextures

# Directions towards the world that all samples of a finished picture have together; and how many
# each has at least and at most, and in one pass.
_DIRECTIONS = 256
_LEAST_DIRECTIONS = 4
_MOST_DIRECTIONS = 16
_IN_ONE_PASS = 8

# The same of the rays of each pixel, which cost a third of what directions do. With 128 these,
# which all pixels share, had so much to say that an Ashikhmin-Shirley lobe's mean was off by 1.2 %,
# at 48 dB in place of 55.
_RAYS = 512
_MOST_RAYS = 8

# Lobes that a ray can't stand for.
_WIDE_LOBES = ("HAS_ROUGH_DIFFUSE", "HAS_DIFFUSE_MODEL", "HAS_TRANSLUCENT", "HAS_SHEEN")

# The golden ratio, by whose multiples rays choose among lobes.
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class EnvironmentScene:
    """What hides the world.

    Attributes:
        geometry: the scene's triangles.
        maps: draws shadow maps of many directions at once.
        receivers: (N, 3) float64 world space: points that are lit, to fit these maps to.
        shadow: gives the finest shadow of the (3,) unit direction towards a sun; looking about
            it, at (SPOTS, 3) other directions if there are, and how thoroughly: where more than a
            share of the pixels sees it in parts, at four of them.
        local_scene: gives the triangles for rays, in the space of the surfaces.
        one_by_one: whether every direction has such a shadow.
    """

    geometry: SceneGeometry
    maps: ShadowPass
    receivers: NDArray[np.float64]
    shadow: Callable[[NDArray[np.float64], NDArray[np.float64], float], Shadow]
    local_scene: Callable[[], LocalScene]
    one_by_one: bool = False


class EnvironmentLight:
    """Adds samples of the world's light on surfaces.

    Args:
        tables: textures of the specular tables.
        layout: of the surfaces.
    """

    def __init__(self, tables: AlbedoTextures, layout: SurfaceLayout) -> None:
        self._layout = layout
        self._ambient = AmbientPass(tables, layout)
        self._direction_pass = DirectionPass(tables, layout)
        self._ray_pass = RayPass(tables, layout)
        self._rays: EnvironmentRays | None = None

    def draw_first(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures,
        scene: EnvironmentScene,
        target: Any,
        stride: int = 1,
    ) -> None:
        """Add the whole light, approximately.

        Args:
            surface: what is seen.
            world: the world.
            scene: the scene.
            target: framebuffer, RGBA32F; alpha is left as it is.
            stride: a pixel of the target covers stride x stride of the surfaces'.
        """
        self._ambient.draw(surface, world, target, stride=stride)
        lighting = _Lighting(surface, world, scene, target, stride=stride)
        if world.sun_source is not None:
            self._light(lighting, world.sun_source.middles)

    def draw(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures,
        scene: EnvironmentScene,
        target: Any,
        sample: tuple[int, int],
    ) -> None:
        """Add one sample of the light.

        Args:
            surface: what is seen.
            world: the world.
            scene: the scene.
            target: framebuffer, RGBA32F; alpha is left as it is.
            sample: its number k, and of how many.
        """
        k, count = sample
        even = world.picture is None
        by_occlusion = even and "ambient_occlusion" in self._layout.plan.stored
        has_wide = any(self._layout.has(name) for name in _WIDE_LOBES)
        directions = _share(_DIRECTIONS, count, _LEAST_DIRECTIONS, _MOST_DIRECTIONS)
        if by_occlusion and not has_wide:
            directions = 0
        rays = _share(_RAYS, count, 1, _MOST_RAYS)
        if not (self._layout.has("HAS_SPECULAR") and world.world.glossy_visible):
            rays = 0
        self._ambient.draw(surface, world, target, only_lambert=True)
        lighting = _Lighting(surface, world, scene, target, rays)
        for first in range(k * directions, (k + 1) * directions, _IN_ONE_PASS):
            points = sobol_points(first, min(_IN_ONE_PASS, (k + 1) * directions - first))
            residual = replace(lighting, control=True, lambert=not by_occlusion)
            drawn = world.source.draw(points, directions)
            if scene.one_by_one:
                spots = world.source.spots(points, directions * count, first)
                drawn = replace(drawn, spots=spots)
            self._light_together(residual, drawn)
        if world.sun_source is not None:
            self._light(lighting, world.sun_source.draw(k, count))
        for ray in range(k * rays, (k + 1) * rays):
            self._trace(lighting, ray, directions)

    def _light(self, lighting: _Lighting, directions: Directions, thorough: float = 0.5) -> None:
        """Light from directions that each have a shadow of their own."""
        for one in directions.each():
            spots = one.spots.reshape(-1, 3)
            self._shade(lighting, one, lighting.scene.shadow(one.toward[0], spots, thorough))

    def _light_together(self, lighting: _Lighting, directions: Directions) -> None:
        """Light from directions of which each is a small part of the light."""
        scene = lighting.scene
        if scene.one_by_one or len(directions.toward) == 1:
            self._light(lighting, directions, thorough=0.0)
            return
        shadow = scene.maps.draw_parallel(
            directions.toward,
            scene.geometry.bounds,
            scene.receivers,
            scene.maps.settings.cube_resolution,
        )
        self._shade(lighting, directions, shadow)

    def _shade(self, lighting: _Lighting, directions: Directions, shadow: Shadow) -> None:
        visible = lighting.world.world
        self._direction_pass.draw(
            lighting.surface,
            directions,
            shadow,
            lighting.target,
            rays=lighting.rays,
            control=lighting.control,
            lambert=lighting.lambert,
            diffuse=visible.diffuse_visible,
            specular=visible.glossy_visible,
            stride=lighting.stride,
        )

    def _trace(self, lighting: _Lighting, ray: int, directions: int) -> None:
        surface, scene = lighting.surface, lighting.scene
        local = scene.local_scene()
        if self._rays is None or self._rays.scene is not local:
            self._rays = EnvironmentRays(local)
        point = np.append(sobol_points(ray, 1), ray * _GOLDEN % 1.0)
        toward, arriving = self._ray_pass.send(
            surface, lighting.world, point, number=lighting.rays, directions=directions
        )
        is_open = self._rays.open_share(surface, read_texture(toward))
        self._ray_pass.arrive(arriving, is_open, lighting.target)


@dataclass(frozen=True)
class _Lighting:
    """What one pass of directions has in common; see `DirectionPass.draw`."""

    surface: SurfaceBuffer
    world: WorldTextures
    scene: EnvironmentScene
    target: Any
    rays: int = 0
    control: bool = False
    lambert: bool = True
    stride: int = 1


def _share(total: int, count: int, least: int, most: int) -> int:
    """Of a number that `count` samples have together, that of each."""
    return min(max(-(-total // count), least), most)
