# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of the world's light: from directions that all pixels share, and along rays that
each pixel has of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import (
    PassShader,
    Samplers,
    ShaderProgram,
    framebuffer,
    texture_2d,
    texture_from_array,
)
from ...glsl.uniforms import Field, UniformBlock
from ..light_points.light_cells import SPOTS
from ..shading.albedo_pass import AlbedoTextures, table_library, table_samplers
from ..shading.blend_pass import add_fullscreen
from ..shading.shadow import Shadow, ShadowKind
from ..shading.surface_pass import SURFACE_LIBRARY, VIEW_BLOCK, view_uniforms
from ..shadows.shadow_frustum import MAX_FACES
from .world_directions import Directions
from .world_pass import PICTURE_LIBRARY, WorldTextures

_DIRECTIONS_BLOCK = UniformBlock(
    "environment",
    (
        Field("vec4", "toward", MAX_FACES),
        Field("vec4", "radiance", MAX_FACES),
        Field("int", "count"),
        Field("float", "rays"),
        Field("float", "control"),
        Field("float", "lambert"),
        Field("float", "diffuse_factor"),
        Field("float", "specular_factor"),
    ),
)

_RAYS_BLOCK = UniformBlock(
    "rays_block",
    (
        Field("vec4", "color"),
        Field("vec4", "point"),
        Field("float", "number"),
        Field("float", "directions"),
    ),
)

_ARRIVES = PassShader(
    name="environment_arrives",
    fragment="environment_arrives",
    samplers=(("ray_open", "FLOAT_2D"), ("ray_arriving", "FLOAT_2D")),
    outputs=(("VEC4", "radiance"),),
)
_TINTED_ARRIVES = replace(
    _ARRIVES, name="environment_arrives_tinted", defines=(("IS_TINTED", "1"),)
)


class DirectionPass:
    """Adds the world's light from a few directions, each with its shadow.

    Args:
        tables: textures of the specular tables.
        layout: of the surfaces.
    """

    def __init__(self, tables: AlbedoTextures, layout: SurfaceLayout) -> None:
        self._tables = tables
        self._layout = layout
        self._programs: dict[tuple[ShadowKind, bool], ShaderProgram] = {}

    def draw(
        self,
        surface: SurfaceBuffer,
        directions: Directions,
        shadow: Shadow,
        target: Any,
        *,
        rays: int,
        control: bool,
        lambert: bool,
        diffuse: bool,
        specular: bool,
        stride: int = 1,
    ) -> None:
        """Add the sum over at most MAX_FACES directions of their light.

        Args:
            surface: what is seen.
            directions: with densities of all that one sample draws.
            shadow: of a single direction its own shadow; of more a map with a face for each.
            target: framebuffer, RGBA32F; alpha is left as it is.
            rays: rays of their own that pixels have in the sample.
            control: whether Lambert bases have the share of ambient occlusion already.
            lambert: whether they are lit at all.
            diffuse: whether diffuse lobes see the world.
            specular: whether glossy ones do.
            stride: a pixel of the target covers stride x stride of the surfaces'.
        """
        variant = (shadow.kind, len(directions.toward) == 1)
        if variant not in self._programs:
            self._programs[variant] = _directions_pass(*variant, self._layout).build()
        radiance = directions.radiance / directions.density[:, None]
        cells = np.full((len(radiance), 1), directions.cell_sq)
        uniforms = {
            "view": view_uniforms(surface, stride),
            **shadow.uniforms(surface.origin),
            "environment": {
                "toward": np.column_stack([directions.toward, directions.density]),
                "radiance": np.column_stack([radiance, cells]),
                "count": len(radiance),
                "rays": float(rays),
                "control": float(control),
                "lambert": float(lambert),
                "diffuse_factor": float(diffuse),
                "specular_factor": float(specular),
            },
        }
        textures = {
            **surface.textures(),
            **self._tables.textures(self._layout),
            **shadow.textures,
        }
        add_fullscreen(self._programs[variant], target, textures, uniforms)


class RayPass:
    """Draws a mirrored direction of each pixel, and adds what arrives along those that are open.

    Args:
        tables: textures of the specular tables.
        layout: of the surfaces.
    """

    def __init__(self, tables: AlbedoTextures, layout: SurfaceLayout) -> None:
        self._tables = tables
        self._layout = layout
        self._programs: dict[tuple[bool, bool], ShaderProgram] = {}

    def send(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures,
        point: NDArray[np.float64],
        *,
        number: int,
        directions: int,
    ) -> tuple[Any, Any]:
        """Choose directions.

        Args:
            surface: what is seen.
            world: the world.
            point: (3,) in [0, 1), shared by all pixels and turned by each.
            number: of rays that each pixel sends in the sample.
            directions: that the sample draws of the world without its suns.

        Returns:
            Textures, RGBA32F: the unit direction with w = 1, or zeros where no ray is sent; and
            the radiance that the viewer sees of what arrives along it.
        """
        variant = (world.picture is not None, world.suns is not None)
        if variant not in self._programs:
            self._programs[variant] = _rays_pass(*variant, self._layout).build()
        textures = surface.textures() | self._tables.textures(self._layout)
        color = np.zeros(4)
        if world.picture is not None:
            textures["world_picture"] = world.residual
            if world.suns is not None:
                textures["world_suns"] = world.suns
        elif world.world.radiance is not None:
            color[:3] = world.world.radiance
            color[3] = directions / (4.0 * np.pi)
        uniforms = {
            "view": view_uniforms(surface, 1),
            "rays_block": {
                "color": color,
                "point": np.append(point, 0.0),
                "number": float(number),
                "directions": float(directions),
            },
        }
        ray = texture_2d(surface.width, surface.height)
        arriving = texture_2d(surface.width, surface.height)
        self._programs[variant].draw_fullscreen(framebuffer([ray, arriving]), textures, uniforms)
        return ray, arriving

    def arrive(self, arriving: Any, is_open: NDArray[np.float32], target: Any) -> None:
        """Add `arriving` times the share (H, W), or (H, W, 3) in colours, of each ray that is
        open."""
        if is_open.ndim == 3:
            program = _TINTED_ARRIVES.build()
            pixels = np.concatenate([is_open, np.ones_like(is_open[..., :1])], axis=-1)
            share = texture_from_array(pixels, "RGBA32F")
        else:
            program = _ARRIVES.build()
            share = texture_from_array(is_open[..., None], "R32F")
        add_fullscreen(program, target, {"ray_open": share, "ray_arriving": arriving}, {})


def _directions_pass(shadow: ShadowKind, single: bool, layout: SurfaceLayout) -> PassShader:
    return PassShader(
        name="environment",
        fragment="environment",
        library=(
            *SURFACE_LIBRARY,
            "diffuse",
            *table_library(layout),
            shadow.library,
            *(("facet_sampling",) if layout.has("HAS_SPECULAR") else ()),
        ),
        generated=layout.read_glsl(),
        blocks=(VIEW_BLOCK, *shadow.blocks, _DIRECTIONS_BLOCK),
        samplers=(*layout.samplers, *table_samplers(layout), *shadow.samplers),
        outputs=(("VEC4", "radiance"),),
        defines=(
            ("MOST_DIRECTIONS", str(MAX_FACES)),
            ("CELL_SPOTS", str(SPOTS)),
            *layout.defines,
            *((("ONE_DIRECTION", "1"),) if single else ()),
            *((("SHADOW_HAS_TINT", "1"),) if shadow.tinted else ()),
        ),
    )


def _rays_pass(has_picture: bool, has_suns: bool, layout: SurfaceLayout) -> PassShader:
    pictures: Samplers = (("world_picture", "FLOAT_2D"),) if has_picture else ()
    suns: Samplers = (("world_suns", "FLOAT_2D"),) if has_suns else ()
    flags = {"HAS_PICTURE": has_picture, "HAS_SUNS": has_suns}
    return PassShader(
        name="environment_ray",
        fragment="environment_ray",
        library=(
            *SURFACE_LIBRARY,
            *table_library(layout),
            "facet_sampling",
            *(PICTURE_LIBRARY if has_picture else ()),
        ),
        generated=layout.read_glsl(),
        blocks=(VIEW_BLOCK, _RAYS_BLOCK),
        samplers=(*layout.samplers, *table_samplers(layout), *pictures, *suns),
        outputs=(("VEC4", "ray"), ("VEC4", "arriving")),
        defines=(*layout.defines, *((name, "1") for name, on in flags.items() if on)),
    )
