# SPDX-License-Identifier: GPL-3.0-or-later
"""One light's contribution to the view, in one fragment pass over its surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.normal_bend import BEND_SAMPLER
from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import GlslType, PassShader, ShaderProgram, adding
from ...glsl.uniforms import Field, UniformBlock
from ...scene.frame_across import frame_across
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
from ..filters.slide_picture import LUMINANCE
from ..light_points.light_cells import CORNERS, SPOTS
from ..light_points.light_sample import LightSample
from ..shading.albedo_pass import AlbedoTextures, table_library, table_samplers
from ..shading.blend_pass import add_fullscreen
from ..shading.shadow import Shadow, ShadowKind
from ..shading.surface_pass import SURFACE_LIBRARY, VIEW_BLOCK, view_uniforms
from .light_objects import OBJECT_SAMPLERS, object_textures
from .light_shape import cell, cell_overlap, cell_radiance, has_extent, spot_cone, spread_cone

LIGHT_BLOCK = UniformBlock(
    "light",
    (
        Field("vec4", "place"),
        Field("vec4", "centre"),
        Field("vec4", "axis"),
        Field("vec4", "intensity"),
        Field("vec4", "spot_x"),
        Field("vec4", "spot_y"),
        Field("vec4", "spot_z"),
        Field("vec4", "cone"),
        Field("vec4", "corners", CORNERS),
        Field("vec4", "spots", SPOTS),
        Field("float", "radius_sq"),
        Field("float", "disk"),
        Field("float", "cell"),
        Field("float", "overlap"),
        Field("float", "radiance"),
        Field("float", "diffuse_factor"),
        Field("float", "specular_factor"),
        Field("vec4", "shadow_fill"),
        Field("float", "hide_highlights"),
        Field("float", "ambient"),
    ),
)

_TYPE_CODE = {"POINT": 0, "SPOT": 1, "SUN": 2, "AREA": 3, "MESH": 4}


@dataclass(frozen=True)
class _Variant:
    """What of a light the shader depends on: only what is needed is compiled."""

    light_type: str
    has_spread: bool
    has_extent: bool
    turns: bool
    shadow: ShadowKind | None
    fills_shadow: bool
    has_ambient: bool
    filters: FilterKinds
    by_object: bool
    bends: bool


class LightPass:
    """Adds single samples of lights to their layers. Compiles what it meets, once.

    Args:
        tables: textures of the specular tables.
        layout: of the surfaces.
        filters: of the lights; one for all passes, so that textures are uploaded once.
        split: whether lobes of different kinds go to textures of their own.
    """

    def __init__(
        self,
        tables: AlbedoTextures,
        layout: SurfaceLayout,
        filters: LightFilters | None = None,
        *,
        split: bool = False,
    ) -> None:
        self._tables = tables
        self._layout = layout
        self._split = split
        self._filters = LightFilters() if filters is None else filters
        self._programs: dict[_Variant, ShaderProgram] = {}

    def set_layout(self, layout: SurfaceLayout) -> None:
        """Read surfaces that are laid out otherwise from now on."""
        if layout != self._layout:
            self._layout = layout
            self._programs.clear()

    def draw(
        self,
        surface: SurfaceBuffer,
        light: Light,
        sample: LightSample,
        target: Any,
        *,
        shadow: Shadow | None,
        color: NDArray[np.float64] | None = None,
        weight: float = 1.0,
        stride: int = 1,
        objects: Any = None,
        samples: int = 1,
    ) -> None:
        """Add `weight` times the radiance that this point of the light causes.

        Args:
            surface: what is seen.
            light: the light; one that is not lit adds nothing.
            sample: its point, from `light_sample`.
            target: framebuffer over the light's layer, RGBA32F; of a pass that splits lobes,
                over one for each of `parts`. Alpha is left as it is.
            shadow: that point's shadow; None lights through everything.
            color: (3,) float64, instead of the light's own intensity, in its units.
            weight: usually 1 / count of the view's samples.
            stride: view pixels along the side of one of the target's.
            objects: `ObjectShares.texture`; `surface` must then have its `objects`.
            samples: of how many of a pixel this is one.
        """
        if not light.is_lit:
            return
        intensity = light.intensity if color is None else color
        filters = self._filters.of(light)
        kind = None if shadow is None else shadow.kind
        bend = surface.bend if self._sees_extent(light) else None
        program = self._program(
            light,
            sample,
            kind,
            kinds(filters),
            by_object=objects is not None,
            bends=bend is not None,
        )
        textures = surface.textures() | self._tables.textures(self._layout)
        if bend is not None:
            textures[BEND_SAMPLER[0][0]] = bend.texture(samples)
        uniforms: dict[str, Mapping[str, Any]] = {
            "view": view_uniforms(surface, stride),
            "light": light_uniforms(light, sample, surface.origin, weight * intensity),
            **filter_uniforms(light, filters, surface.origin, sample.count),
        }
        textures |= filter_textures(filters) | object_textures(surface, objects)
        if shadow is not None:
            textures.update(shadow.textures)
            uniforms.update(shadow.uniforms(surface.origin))
        # What lies in shadow gets nothing, unless something fills it.
        fills = _fills_shadow(light) or light.controls.ambient != 0.0
        tiles = None if shadow is None or fills else shadow.lit
        if tiles is None:
            add_fullscreen(program, target, textures, uniforms)
        elif tiles.batch is not None:
            with adding():
                program.draw_batch(tiles.batch, target, textures, uniforms)

    def _sees_extent(self, light: Light) -> bool:
        """Whether lobes see more than a point of a light."""
        shines = light.specular_factor * light.controls.specular != 0.0
        return shines and self._layout.has("HAS_SPECULAR") and has_extent(light)

    def _program(
        self,
        light: Light,
        sample: LightSample,
        shadow: ShadowKind | None,
        filters: FilterKinds,
        *,
        by_object: bool,
        bends: bool,
    ) -> ShaderProgram:
        has_spread = light.type == "AREA" and light.spread < np.pi
        controls = light.controls
        variant = _Variant(
            light.type,
            has_spread,
            self._sees_extent(light),
            sample.per_receiver,
            shadow,
            shadow is not None and _fills_shadow(light),
            controls.ambient != 0.0,
            filters,
            by_object,
            bends,
        )
        if variant not in self._programs:
            self._programs[variant] = _describe(variant, self._layout, self._split).build()
        return self._programs[variant]


def _fills_shadow(light: Light) -> bool:
    """Whether some light of its own comes where its shadow falls."""
    look = light.controls.shadow
    return look.density != 1.0 or any(look.color)


def light_defines(
    light_type: str, *, has_spread: bool, turns: bool, has_filters: bool
) -> tuple[tuple[str, str], ...]:
    """What addon/glsl/lib/light.glsl and the filters are compiled with."""
    flags = {"HAS_SPREAD": has_spread, "HAS_TURNED_DISK": turns, "HAS_FILTERS": has_filters}
    return (
        ("LIGHT_TYPE", str(_TYPE_CODE[light_type])),
        *((name, "1") for name, on in flags.items() if on),
    )


def _describe(variant: _Variant, layout: SurfaceLayout, split: bool) -> PassShader:
    shadow, filters = variant.shadow, variant.filters
    flags = {
        "HAS_EXTENT": variant.has_extent,
        "HAS_BENDS": variant.bends,
        "HAS_SHADOW": shadow is not None,
        "SHADOW_HAS_SPOTS": shadow is not None and shadow.spots > 0 and variant.has_extent,
        "SHADOW_HAS_TINT": shadow is not None and shadow.tinted,
        "HAS_SHADOW_FILL": variant.fills_shadow,
        "HAS_AMBIENT": variant.has_ambient,
        "HAS_OBJECTS": variant.by_object,
        "SPLIT_LOBES": split,
    }
    by_object = OBJECT_SAMPLERS if variant.by_object else ()
    return PassShader(
        name=f"light_{variant.light_type.lower()}",
        fragment="light",
        library=(
            *SURFACE_LIBRARY,
            "diffuse",
            *table_library(layout),
            *(("frame_across",) if variant.has_extent else ()),
            "light",
            *(("ellipse", "bend") if variant.bends else ()),
            *(("highlight",) if variant.has_extent else ()),
            *((shadow.library,) if shadow else ()),
            *filter_library(filters),
            *(("object_share",) if variant.by_object else ()),
        ),
        generated=layout.read_glsl() + filter_glsl(filters),
        blocks=(
            VIEW_BLOCK,
            LIGHT_BLOCK,
            *filter_blocks(filters),
            *(shadow.blocks if shadow else ()),
        ),
        samplers=(
            *layout.samplers,
            *table_samplers(layout),
            *filter_samplers(filters),
            *(shadow.samplers if shadow else ()),
            *(BEND_SAMPLER if variant.bends else ()),
            # Edited surfaces may read one of them already.
            *(each for each in by_object if each not in layout.samplers),
        ),
        outputs=_outputs(layout, split),
        defines=(
            *light_defines(
                variant.light_type,
                has_spread=variant.has_spread,
                turns=variant.turns,
                has_filters=bool(filters),
            ),
            ("CELL_CORNERS", str(CORNERS)),
            ("CELL_SPOTS", str(SPOTS)),
            *layout.defines,
            *((name, "1") for name, on in flags.items() if on),
        ),
    )


def lobe_parts(layout: SurfaceLayout) -> tuple[str, ...]:
    """The kinds of lobes that a scene's surfaces have, as a split layer's textures are ordered."""
    kinds_of = {"HAS_SPECULAR": "specular", "HAS_SHEEN": "sheen", "HAS_TRANSLUCENT": "translucent"}
    return ("diffuse", *(part for define, part in kinds_of.items() if layout.has(define)))


def _outputs(layout: SurfaceLayout, split: bool) -> tuple[tuple[GlslType, str], ...]:
    if not split:
        return (("VEC4", "radiance"),)
    return tuple(("VEC4", f"radiance_{part}") for part in lobe_parts(layout))


def light_uniforms(
    light: Light,
    sample: LightSample,
    local_origin: NDArray[np.float64],
    intensity: NDArray[np.float64],
) -> dict[str, Any]:
    """The values of LIGHT_BLOCK for surfaces in the space around `local_origin`.

    `intensity` is (3,) in the units of `Light.intensity`.
    """
    is_sun = light.type == "SUN"
    place = sample.position if is_sun else sample.position - local_origin
    if sample.per_receiver:
        # From the centre, on the disk across the axis; the shader turns it.
        place = sample.facing(light, light.direction[None])[0] - light.position
    light_from_world = np.zeros((3, 4))
    cone = np.zeros(4)
    if light.type == "SPOT":
        light_from_world[:, :3] = np.linalg.inv(light.world_from_light[:3, :3])
        # Only the direction counts: without the scale float32 holds every light's matrix.
        light_from_world /= np.abs(light_from_world).max()
        cone[:2] = spot_cone(light)
    elif light.type == "AREA":
        cone[:2] = spread_cone(light)
    axis, radius_sq = light.direction, 0.0
    if light.type in ("POINT", "SPOT"):
        radius_sq = light.shadow_soft_size**2
    if sample.emitter is not None:
        axis, intensity = sample.emitter.normal, intensity * sample.emitter.tint
        # Of the disk that the point stands for.
        radius_sq = light.area / (np.pi * sample.count)
    parts = sample.count if sample.is_parted(light) else 1
    # A disk's points shine like its centre wherever they are.
    cone[2] = float(sample.is_flat(light))
    controls = light.controls
    fill = np.array(controls.shadow.color)
    return {
        "place": np.append(place, 0.0),
        "centre": np.append(light.position - local_origin, 0.0) if not is_sun else np.zeros(4),
        "axis": np.append(axis, 0.0),
        "intensity": np.append(intensity, 0.0),
        "spot_x": light_from_world[0],
        "spot_y": light_from_world[1],
        "spot_z": light_from_world[2],
        "cone": cone,
        "radius_sq": radius_sq,
        "disk": float(light.use_soft_falloff),
        "corners": _places(light, sample, sample.corners, local_origin),
        "spots": _spots(light, sample, local_origin),
        "cell": cell(light, parts, sample.count),
        "overlap": cell_overlap(parts),
        "radiance": cell_radiance(light, parts),
        "diffuse_factor": light.diffuse_factor * controls.diffuse,
        "specular_factor": light.specular_factor * controls.specular,
        "shadow_fill": np.append(LUMINANCE @ intensity * fill, controls.shadow.density),
        "hide_highlights": float(controls.shadow.hide_highlights),
        "ambient": controls.ambient,
    }


def _spots(
    light: Light, sample: LightSample, local_origin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(SPOTS, 4) of the sample's cell, in the shader's space; zeros where it has none."""
    if not len(sample.spots):
        return np.zeros((SPOTS, 4))
    return _places(light, sample, sample.spots, local_origin)


def _places(
    light: Light,
    sample: LightSample,
    places: NDArray[np.float64],
    local_origin: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, 4) around or in the sample's cell, in the shader's space: of a lamp whose disk turns
    offsets from the centre, on the disk across its axis."""
    if sample.per_receiver:
        places = places[:, :2] @ frame_across(light.direction)
    elif light.type == "AREA":
        places = places - local_origin
    return np.pad(places, ((0, 0), (0, 1)))
