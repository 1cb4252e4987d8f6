# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: seen directly behind the scene, and as an ambient light on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import PassShader, SamplerType, ShaderProgram, texture_from_array
from ...glsl.uniforms import Field, UniformBlock
from ...scene.view import View
from ...scene.world import World
from ..shading.albedo_pass import AlbedoTextures, table_library, table_samplers
from ..shading.blend_pass import add_fullscreen
from ..shading.surface_pass import SURFACE_LIBRARY, VIEW_BLOCK, view_uniforms
from .world_directions import DirectionSource, SunSource
from .world_light import LEVELS, LOBE_ROUGHNESS, prepare_world
from .world_split import split_world

_BACKGROUND_BLOCK = UniformBlock(
    "background",
    (
        Field("vec4", "color"),
        Field("vec4", "corner"),
        Field("vec4", "right"),
        Field("vec4", "up"),
        Field("float", "weight"),
        Field("float", "opacity"),
        Field("int", "stride"),
    ),
)

_AMBIENT_BLOCK = UniformBlock(
    "ambient",
    (
        Field("vec4", "color"),
        Field("vec4", "roughness", 2),
        Field("float", "diffuse_factor"),
        Field("float", "specular_factor"),
    ),
)

PICTURE_LIBRARY = ("equirect", "world_picture")


@dataclass(frozen=True)
class WorldTextures:
    """A world on the GPU.

    Attributes:
        world: the world.
        picture: RGBA32F equirect, or None for a constant world.
        residual: the same without its suns; the same texture where it has none.
        suns: the suns alone, or None.
        levels: RGBA32F, convolved pictures of the residual above each other, or None.
        source: draws directions towards the residual.
        sun_source: the same towards the suns, or None.

    The alpha of `residual` and `suns` tells how many directions of a single draw there are per
    steradian.
    """

    world: World
    picture: Any
    residual: Any
    suns: Any
    levels: Any
    source: DirectionSource
    sun_source: SunSource | None = None

    @classmethod
    def upload(cls, world: World) -> WorldTextures:
        """Prepare and upload; a picture of 512 rows takes about a second.

        Raises:
            ValueError: the world varies with direction and has no picture yet.
        """
        if world.needs_baking:
            raise ValueError("the world's picture must be baked first")
        if world.equirect is None:
            radiance = np.zeros(3) if world.radiance is None else world.radiance
            source = DirectionSource(radiance.reshape(1, 1, 3), even=1.0)
            return cls(world, None, None, None, None, source)
        parts = split_world(world.equirect)
        source = DirectionSource(parts.residual)
        residual = _rgba(parts.residual, source.density)
        picture, suns, sun_source = residual, None, None
        if parts.suns:
            sun_source = SunSource(parts.suns)
            picture = _rgba(world.equirect, source.density)
            suns = _rgba(sun_source.picture, sun_source.density)
        levels = prepare_world(parts.residual).levels
        return cls(
            world, picture, residual, suns, _rgba(levels, np.zeros(levels.shape[:2])),
            source, sun_source,
        )  # fmt: skip


def _rgba(rgb: Any, alpha: Any) -> Any:
    pixels = np.concatenate([rgb, alpha[..., None]], axis=-1).astype(np.float32)
    return texture_from_array(pixels, "RGBA32F")


class BackgroundPass:
    """Adds the world where no surface is seen, and the whole picture's alpha."""

    def __init__(self) -> None:
        self._programs: dict[tuple[bool, bool], ShaderProgram] = {}

    def draw(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures | None,
        view: View,
        target: Any,
        *,
        offset: tuple[float, float] | None = (0.0, 0.0),
        film_transparent: bool = False,
        weight: float = 1.0,
        stride: int = 1,
    ) -> None:
        """Add `weight` times the background; alpha gets `weight` where the picture is opaque.

        Args:
            surface: what is seen.
            world: None for black.
            view: the view, for its rays.
            target: framebuffer, RGBA32F.
            offset: the sample's place in the pixel, from its centre, pixels; None for an atlas of
                shading samples, which knows where each of them lies.
            film_transparent: leave colour and alpha zero where no surface is seen.
            weight: usually 1 / count of the view's samples.
            stride: view pixels along the side of one of the target's.
        """
        has_picture = world is not None and world.picture is not None
        variant = (has_picture, offset is None)
        if variant not in self._programs:
            self._programs[variant] = _background(*variant).build()
        visible = world is not None and world.world.camera_visible
        radiance = world.world.radiance if world is not None else None
        color = np.append(np.zeros(3) if radiance is None else radiance, float(visible))
        # gl_FragCoord is a pixel's centre already; directions are linear in it when they
        # reach one metre along the view axis.
        pixels = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) + np.array(offset or (0.0, 0.0))
        _, rays = view.rays(pixels)
        rays = rays / -(rays @ view.world_from_camera[:3, 2])[:, None]
        textures = {"surface_position": surface.position}
        if world is not None and has_picture:
            textures["world_picture"] = world.picture
        uniforms = {
            "color": color,
            "corner": np.append(rays[0], 0.0),
            "right": np.append(rays[1] - rays[0], 0.0),
            "up": np.append(rays[2] - rays[0], 0.0),
            "weight": weight,
            "opacity": 0.0 if film_transparent else 1.0,
            "stride": stride,
        }
        add_fullscreen(self._programs[variant], target, textures, {"background": uniforms})


def _background(has_picture: bool, is_atlas: bool) -> PassShader:
    samplers: tuple[tuple[str, SamplerType], ...] = (("surface_position", "FLOAT_2D"),)
    if has_picture:
        samplers = (*samplers, ("world_picture", "FLOAT_2D"))
    return PassShader(
        name="background",
        fragment="background",
        library=PICTURE_LIBRARY if has_picture else (),
        blocks=(_BACKGROUND_BLOCK,),
        samplers=samplers,
        outputs=(("VEC4", "radiance"),),
        defines=(
            *((("HAS_PICTURE", "1"),) if has_picture else ()),
            *((("HAS_ATLAS", "1"),) if has_picture and is_atlas else ()),
        ),
    )


class AmbientPass:
    """Adds the world's light on the surfaces.

    Args:
        tables: textures of the specular tables.
        layout: of the surfaces.
    """

    def __init__(self, tables: AlbedoTextures, layout: SurfaceLayout) -> None:
        self._tables = tables
        self._layout = layout
        self._programs: dict[tuple[bool, bool], ShaderProgram] = {}

    def draw(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures,
        target: Any,
        weight: float = 1.0,
        stride: int = 1,
        *,
        only_lambert: bool = False,
    ) -> None:
        """Add `weight` times the radiance that the world without its suns causes, as far as the
        surfaces' ambient occlusion tells; alpha is left as it is.

        Args:
            surface: what is seen.
            world: the world.
            target: framebuffer, RGBA32F.
            weight: usually 1 / count of the view's samples.
            stride: view pixels along the side of one of the target's.
            only_lambert: leave out all but the diffuse bases without roughness.
        """
        has_picture = world.picture is not None
        variant = (has_picture, only_lambert)
        if variant not in self._programs:
            self._programs[variant] = _ambient(has_picture, only_lambert, self._layout).build()
        textures = surface.textures() | self._tables.textures(self._layout, ambient=True)
        if has_picture:
            textures |= {"world_picture": world.residual, "world_levels": world.levels}
        radiance = world.world.radiance
        ambient = {
            "color": np.append(np.zeros(3) if radiance is None else radiance, 0.0),
            "roughness": np.resize(np.array(LOBE_ROUGHNESS), 8).reshape(2, 4),
            "diffuse_factor": weight * float(world.world.diffuse_visible),
            "specular_factor": weight * float(world.world.glossy_visible),
        }
        uniforms = {"view": view_uniforms(surface, stride), "ambient": ambient}
        add_fullscreen(self._programs[variant], target, textures, uniforms)


def _ambient(has_picture: bool, only_lambert: bool, layout: SurfaceLayout) -> PassShader:
    samplers = (*layout.samplers, *table_samplers(layout, ambient=True))
    if has_picture:
        samplers = (*samplers, ("world_picture", "FLOAT_2D"), ("world_levels", "FLOAT_2D"))
    return PassShader(
        name="ambient",
        fragment="ambient",
        library=(
            *SURFACE_LIBRARY,
            "diffuse",
            *table_library(layout, ambient=True),
            *(PICTURE_LIBRARY if has_picture else ()),
        ),
        generated=layout.read_glsl(),
        blocks=(VIEW_BLOCK, _AMBIENT_BLOCK),
        samplers=samplers,
        outputs=(("VEC4", "radiance"),),
        defines=(
            ("LEVEL_COUNT", str(LEVELS)),
            *layout.defines,
            *((("HAS_PICTURE", "1"),) if has_picture else ()),
            *((("ONLY_LAMBERT", "1"),) if only_lambert else ()),
        ),
    )
