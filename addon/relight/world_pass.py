# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: seen directly behind the scene, and as an ambient light on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..corrmap.surface_buffer import SurfaceBuffer
from ..corrmap.surface_layout import SurfaceLayout
from ..glsl.shader import PassShader, SamplerType, ShaderProgram, texture_from_array
from ..glsl.uniforms import Field, UniformBlock
from ..scene.view import View
from ..scene.world import World
from .albedo_pass import AlbedoTextures, table_library, table_samplers
from .blend_pass import add_fullscreen
from .surface_pass import SURFACE_LIBRARY, VIEW_BLOCK, view_uniforms
from .world_light import LOBE_ROUGHNESS, prepare_world

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
        Field("vec4", "harmonics", 9),
        Field("vec4", "roughness", 2),
        Field("float", "diffuse_factor"),
        Field("float", "specular_factor"),
    ),
)

_PICTURE_LIBRARY = ("equirect", "world_picture")

# Constants of the harmonics in the order of `harmonics()`, taken out of the shader.
_HARMONIC_FACTORS = np.sqrt(
    np.array([1.0, 3.0, 3.0, 3.0, 15.0, 15.0, 1.25, 15.0, 3.75]) / (4.0 * np.pi)
)


@dataclass(frozen=True)
class WorldTextures:
    """A world on the GPU.

    Attributes:
        world: the world.
        picture: RGBA32F equirect, or None for a constant world.
        lobes: RGBA32F, convolved pictures above each other, or None.
        harmonics: (9, 4) float64, the diffuse harmonics with their constants.
    """

    world: World
    picture: Any
    lobes: Any
    harmonics: Any

    @classmethod
    def upload(cls, world: World) -> WorldTextures:
        """Prepare and upload; a picture of 512 rows takes about a second.

        Raises:
            ValueError: the world varies with direction and has no picture yet.
        """
        if world.needs_baking:
            raise ValueError("the world's picture must be baked first")
        if world.equirect is None:
            return cls(world, None, None, np.zeros((9, 4)))
        prepared = prepare_world(world.equirect)
        harmonics = np.zeros((9, 4))
        harmonics[:, :3] = prepared.irradiance * _HARMONIC_FACTORS[:, None]
        return cls(world, _rgba(world.equirect), _rgba(prepared.lobes), harmonics)


def _rgba(rgb: Any) -> Any:
    return texture_from_array(np.pad(rgb, ((0, 0), (0, 0), (0, 1))), "RGBA32F")


class BackgroundPass:
    """Adds the world where no surface is seen, and the whole picture's alpha."""

    def __init__(self) -> None:
        self._programs: dict[bool, ShaderProgram] = {}

    def draw(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures | None,
        view: View,
        target: Any,
        *,
        offset: tuple[float, float] = (0.0, 0.0),
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
            offset: the sample's place in the pixel, from its centre, pixels.
            film_transparent: leave colour and alpha zero where no surface is seen.
            weight: usually 1 / count of the view's samples.
            stride: view pixels along the side of one of the target's.
        """
        has_picture = world is not None and world.picture is not None
        if has_picture not in self._programs:
            self._programs[has_picture] = _background(has_picture).build()
        visible = world is not None and world.world.camera_visible
        radiance = world.world.radiance if world is not None else None
        color = np.append(np.zeros(3) if radiance is None else radiance, float(visible))
        # gl_FragCoord is a pixel's centre already; directions are linear in it when they
        # reach one metre along the view axis.
        pixels = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) + np.array(offset)
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
        add_fullscreen(self._programs[has_picture], target, textures, {"background": uniforms})


def _background(has_picture: bool) -> PassShader:
    samplers: tuple[tuple[str, SamplerType], ...] = (("surface_position", "FLOAT_2D"),)
    if has_picture:
        samplers = (*samplers, ("world_picture", "FLOAT_2D"))
    return PassShader(
        name="background",
        fragment="background",
        library=_PICTURE_LIBRARY if has_picture else (),
        blocks=(_BACKGROUND_BLOCK,),
        samplers=samplers,
        outputs=(("VEC4", "radiance"),),
        defines=(("HAS_PICTURE", "1"),) if has_picture else (),
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
        self._programs: dict[bool, ShaderProgram] = {}

    def draw(
        self,
        surface: SurfaceBuffer,
        world: WorldTextures,
        target: Any,
        weight: float = 1.0,
        stride: int = 1,
    ) -> None:
        """Add `weight` times the radiance that the world causes; alpha is left as it is."""
        has_picture = world.picture is not None
        if has_picture not in self._programs:
            self._programs[has_picture] = _ambient(has_picture, self._layout).build()
        textures = surface.textures() | self._tables.textures(self._layout, ambient=True)
        if has_picture:
            textures |= {"world_picture": world.picture, "world_lobes": world.lobes}
        radiance = world.world.radiance
        ambient = {
            "color": np.append(np.zeros(3) if radiance is None else radiance, 0.0),
            "harmonics": world.harmonics,
            "roughness": np.resize(np.array(LOBE_ROUGHNESS), 8).reshape(2, 4),
            "diffuse_factor": weight * float(world.world.diffuse_visible),
            "specular_factor": weight * float(world.world.glossy_visible),
        }
        uniforms = {"view": view_uniforms(surface, stride), "ambient": ambient}
        add_fullscreen(self._programs[has_picture], target, textures, uniforms)


def _ambient(has_picture: bool, layout: SurfaceLayout) -> PassShader:
    samplers = (*layout.samplers, *table_samplers(layout, ambient=True))
    if has_picture:
        samplers = (*samplers, ("world_picture", "FLOAT_2D"), ("world_lobes", "FLOAT_2D"))
    return PassShader(
        name="ambient",
        fragment="ambient",
        library=(
            *SURFACE_LIBRARY,
            *table_library(layout, ambient=True),
            *(_PICTURE_LIBRARY if has_picture else ()),
        ),
        generated=layout.read_glsl(),
        blocks=(VIEW_BLOCK, _AMBIENT_BLOCK),
        samplers=samplers,
        outputs=(("VEC4", "radiance"),),
        defines=(
            ("LOBE_COUNT", str(len(LOBE_ROUGHNESS))),
            *layout.defines,
            *((("HAS_PICTURE", "1"),) if has_picture else ()),
        ),
    )
