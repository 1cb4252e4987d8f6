# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws shadow maps: for one point of a light, how far it sees in every direction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import gpu
import numpy as np
from numpy.typing import NDArray

from ...corrmap.geometry_buffer import GeometryBuffer
from ...corrmap.raster_program import build_raster_program
from ...glsl.shader import PassShader, framebuffer, texture_2d
from ...glsl.uniforms import Field, UniformBlock
from ...scene.light import Light
from ..light_points.light_sample import LightSample
from ..shading.shadow import ShadowKind
from .shadow_frustum import (
    MAX_FACES,
    ShadowFrustum,
    ShadowSettings,
    parallel_frustum,
    shadow_frustum,
)

_CASTER_BLOCK = UniformBlock(
    "caster",
    (
        Field("vec4", "origin"),
        Field("vec4", "axis"),
        Field("vec4", "centre"),
        Field("float", "far"),
    ),
)

_PASS = PassShader(
    name="shadow_distance",
    fragment="shadow_distance",
    blocks=(_CASTER_BLOCK,),
    outputs=(("VEC4", "caster_distance"),),
    writes_depth=True,
)

# A map holds one distance: of sheer surfaces so many texels are there as light is stopped.
_DITHERED_PASS = replace(_PASS, name=f"{_PASS.name}_dithered", defines=(("IS_DITHERED", "1"),))

SHADOW_BLOCK = UniformBlock(
    "shadow",
    (
        Field("vec4", "right", MAX_FACES),
        Field("vec4", "up", MAX_FACES),
        Field("vec4", "back", MAX_FACES),
        Field("vec4", "origin", MAX_FACES),
        Field("vec4", "centre"),
        Field("float", "inner_share"),
        Field("float", "resolution"),
        Field("float", "columns"),
        Field("float", "faces"),
        Field("float", "parallel"),
        Field("float", "turned"),
    ),
)

# What a pass declares that reads a shadow map.
_KIND = ShadowKind("shadow", (("shadow_map", "FLOAT_2D"),), (SHADOW_BLOCK,))

# Where nothing is hit: farther than any distance, and finite.
_NOTHING = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class ShadowMap:
    """What one point of a light sees.

    Attributes:
        frustum: where the texels look.
        distance: R32F atlas, metres from the frustum's origin through each texel's centre (a
            sun's: along its rays from the map's plane); the largest float where nothing is.
    """

    frustum: ShadowFrustum
    distance: gpu.types.GPUTexture

    @property
    def kind(self) -> ShadowKind:
        """What a shader that reads it is made of."""
        return _KIND

    @property
    def textures(self) -> Mapping[str, Any]:
        """By the names of `kind.samplers`."""
        return {"shadow_map": self.distance}

    @property
    def lit(self) -> None:
        """Only the shader finds out."""
        return None

    @property
    def nbytes(self) -> int:
        """Bytes of GPU memory that keeping it takes."""
        width, height = self.frustum.size
        return 4 * width * height

    def uniforms(self, local_origin: NDArray[np.float64]) -> Mapping[str, Mapping[str, Any]]:
        """The values of SHADOW_BLOCK for surfaces in the space around `local_origin`."""
        return {"shadow": shadow_uniforms(self.frustum, local_origin)}


def shadow_uniforms(frustum: ShadowFrustum, local_origin: NDArray[np.float64]) -> dict[str, Any]:
    """The values of SHADOW_BLOCK."""
    rows = np.zeros((4, len(frustum.face_from_world), 4))
    rows[:3, :, :3] = frustum.face_from_world.transpose(1, 0, 2)
    rows[3, :, :3] = frustum.origins - local_origin
    rows[3, :, 3] = frustum.half_extents
    return {
        "right": rows[0],
        "up": rows[1],
        "back": rows[2],
        "origin": rows[3],
        "centre": np.append(frustum.centre - local_origin, 0.0),
        "inner_share": frustum.inner_share,
        "resolution": frustum.resolution,
        "columns": frustum.grid[0],
        "faces": len(frustum.face_from_world),
        "parallel": float(frustum.parallel),
        "turned": float(frustum.turned),
    }


class ShadowPass:
    """Draws the shadow maps of one scene's geometry."""

    def __init__(self, geometry: GeometryBuffer, settings: ShadowSettings | None = None) -> None:
        self.settings = settings or ShadowSettings()
        self._geometry = geometry
        self._program = build_raster_program(
            _DITHERED_PASS if geometry.has_sheer else _PASS,
            geometry.has_cutouts,
            with_copies=geometry.copies is not None,
            with_sheer=geometry.has_sheer,
        )
        self._depth: dict[tuple[int, int], Any] = {}

    def draw(
        self,
        light: Light,
        sample: LightSample,
        caster_bounds: NDArray[np.float64],
        receivers: NDArray[np.float64],
        *,
        objects: NDArray[np.bool_] | None = None,
        eye: NDArray[np.float64] | None = None,
    ) -> ShadowMap:
        """The shadow map of one point of a light.

        Args:
            light: the light.
            sample: its point, from `light_sample`.
            caster_bounds: (2, 3) float64 world space: `SceneGeometry.bounds`.
            receivers: (N, 3) float64 world space: points or box corners around what is lit;
                a sun's map is fitted to them. Outside of it all is as at its border.
            objects: which of `SceneGeometry.object_names` cast its shadows; None for all.
            eye: (3,) float64 world space: near it a sun's shadows are finer.
        """
        frustum = shadow_frustum(light, sample, caster_bounds, receivers, self.settings, eye)
        is_lamp = light.type in ("POINT", "SPOT")
        centre = light.position - self._geometry.origin if is_lamp else np.zeros(3)
        # Sample points lie in this ball; see the shader.
        has_ball = is_lamp and not sample.is_flat(light) and sample.count > 1
        radius_sq = light.shadow_soft_size**2 if has_ball else 0.0
        return self._draw(frustum, np.append(centre, radius_sq), objects)

    def draw_parallel(
        self,
        toward: NDArray[np.float64],
        caster_bounds: NDArray[np.float64],
        receivers: NDArray[np.float64],
        resolution: int,
    ) -> ShadowMap:
        """One map of (F, 3) unit directions, at most MAX_FACES, that light comes from in parallel.

        Args:
            toward: towards the light.
            caster_bounds: as for `draw`.
            receivers: likewise.
            resolution: texels along the side of each direction's face.
        """
        frustum = parallel_frustum(toward, caster_bounds, receivers, resolution)
        return self._draw(frustum, np.zeros(4), None)

    def _draw(
        self,
        frustum: ShadowFrustum,
        centre: NDArray[np.float64],
        objects: NDArray[np.bool_] | None,
    ) -> ShadowMap:
        """`centre` is (4,): a lamp's in local space, and the squared radius of its ball."""
        distance = texture_2d(*frustum.size, "R32F")
        size = frustum.resolution
        target = framebuffer([distance], self._depth_texture(frustum.size))
        caster: dict[str, Any] = {"axis": np.zeros(4), "centre": centre, "far": frustum.far}
        with target.bind():
            gpu.state.blend_set("NONE")
            target.clear(color=(_NOTHING, 0.0, 0.0, 0.0), depth=1.0)
            for face in range(len(frustum.face_from_world)):
                target.viewport_set(*frustum.cell(face), size, size)
                if frustum.parallel:
                    caster["axis"] = np.append(-frustum.face_from_world[face, 2], 1.0)
                caster["origin"] = np.append(frustum.origins[face] - self._geometry.origin, 0.0)
                self._geometry.draw(
                    self._program,
                    frustum.clip_from_local(face, self._geometry.origin),
                    "shadow",
                    uniforms={"caster": caster},
                    objects=objects,
                )
            target.viewport_set(0, 0, *frustum.size)
        return ShadowMap(frustum, distance)

    def _depth_texture(self, size: tuple[int, int]) -> Any:
        """One depth buffer for each atlas size; it is only needed while a map is drawn."""
        if size not in self._depth:
            self._depth[size] = texture_2d(*size, "DEPTH_COMPONENT32F")
        return self._depth[size]
