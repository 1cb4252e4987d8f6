# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels a light's point could light, and where it is from there: where rays must go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_buffer import SurfaceBuffer
from ...glsl.shader import PassShader, ShaderProgram, framebuffer, read_texture, texture_2d
from ...glsl.uniforms import Field, UniformBlock
from ...scene.light import Light
from ..filters.light_filter import (
    FilterKinds,
    filter_blocks,
    filter_glsl,
    filter_library,
    filter_samplers,
    filter_textures,
    filter_uniforms,
    kinds,
)
from ..filters.light_filters import LightFilters
from ..light_points.light_sample import LightSample
from .light_objects import OBJECT_SAMPLERS, object_textures
from .light_pass import LIGHT_BLOCK, light_defines, light_uniforms

_REACH_BLOCK = UniformBlock("reached", (Field("int", "stride"),))


class ReachPass:
    """Asks the light's own shader functions, so that rays follow exactly what is shaded.

    Args:
        filters: of the lights; one for all passes, so that textures are uploaded once.
    """

    def __init__(self, filters: LightFilters | None = None) -> None:
        self._filters = LightFilters() if filters is None else filters

    def draw(
        self,
        surface: SurfaceBuffer,
        light: Light,
        sample: LightSample,
        stride: int = 1,
        objects: Any = None,
        *,
        both_sides: bool = False,
    ) -> NDArray[np.float32]:
        """The way from each pixel to the light's point.

        Args:
            surface: what is seen.
            light: the light.
            sample: its point.
            stride: the surface's pixels along the side of one of the picture's.
            objects: `ObjectShares.texture`; `surface` must then have its `objects`.
            both_sides: ask also about pixels of whose facet the light is on the side that nothing
                is seen of.

        Returns:
            (H, W, 4): xyz metres to the light's point in local axes (a sun's: unit direction), w
            the side that it lights: 1 the viewer's, -1 the other, 0 none; twice that where both
            are seen, because the object does not stand in its own light.
        """
        # A light as its shadows see it may lack the filters that are kept under its name.
        has_filters = light.profile is not None or light.controls.shapes_beam
        filters = self._filters.of(light) if has_filters else ()
        program = _program(
            light,
            sample,
            kinds(filters),
            both_sides=both_sides or surface.layout.has("HAS_TRANSLUCENT"),
            by_object=objects is not None,
        )
        textures: dict[str, Any] = {
            "surface_position": surface.position,
            "surface_geometric_normal": surface.geometric_normal,
            **filter_textures(filters),
            **object_textures(surface, objects),
        }
        uniforms: dict[str, Mapping[str, Any]] = {
            "light": light_uniforms(light, sample, surface.origin, np.ones(3)),
            "reached": {"stride": stride},
            **filter_uniforms(light, filters, surface.origin, sample.count),
        }
        reach = texture_2d(-(-surface.width // stride), -(-surface.height // stride))
        program.draw_fullscreen(framebuffer([reach]), textures, uniforms)
        return read_texture(reach)


def _program(
    light: Light,
    sample: LightSample,
    filters: FilterKinds,
    *,
    both_sides: bool,
    by_object: bool,
) -> ShaderProgram:
    return PassShader(
        name=f"reach_{light.type.lower()}",
        fragment="light_reach",
        library=(
            "surface_texel",
            "light",
            *filter_library(filters),
            *(("object_share",) if by_object else ()),
        ),
        generated=filter_glsl(filters),
        blocks=(LIGHT_BLOCK, _REACH_BLOCK, *filter_blocks(filters)),
        samplers=(
            ("surface_position", "FLOAT_2D"),
            ("surface_geometric_normal", "FLOAT_2D"),
            *filter_samplers(filters),
            *(OBJECT_SAMPLERS if by_object else ()),
        ),
        outputs=(("VEC4", "reach"),),
        defines=(
            *light_defines(
                light.type,
                has_spread=light.type == "AREA" and light.spread < np.pi,
                turns=sample.per_receiver,
                has_filters=bool(filters),
            ),
            *((("BOTH_SIDES", "1"),) if both_sides else ()),
            *((("HAS_OBJECTS", "1"),) if by_object else ()),
        ),
    ).build()
