# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading samples of a view, step by step: their lists, then their surfaces.

An *atlas* holds them: the picture's own samples, one for each pixel, and above them rows with the
further ones that `pixel_lists` asks for. Passes shade it as they shade a picture.

A sample's parameters are the mean of what the cache says at several hits in its cell, so that
textures finer than a pixel are as smooth as with a lookup for each visibility sample. Where it is
shaded is another place for each sample of the lights: the hit of that visibility sample, if it is
on the same surface, else of one beside it; of further samples the hits that they were made for, by
turns; with the normal that the mesh has there unless the material bends it. So the
edges of shadows and highlights are filtered as the pixels are.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ..glsl.shader import (
    PassShader,
    Texture,
    framebuffer,
    max_texture_width,
    read_texture,
    texture_2d,
    texture_from_array,
)
from ..glsl.uniforms import Field, UniformBlock
from .bent_surfaces import BentSurfaces
from .correspondence import CorrespondencePass, GatherPass
from .geometry_buffer import GeometryBuffer
from .mean_surface import MeanPass
from .own_hits import OWN_HIT_DEFINES, OWN_HIT_LIBRARY, OWN_HIT_SAMPLERS
from .pixel_list_pass import PAIR_SAMPLERS, PixelListPass, PixelListTextures, pair_textures
from .pixel_lists import ListBuilder, PixelLists, SeenPicture
from .same_surface import SAME_SURFACE_DEFINES
from .seen_triangle import seen_textures, with_seen_triangle
from .surface_buffer import SurfaceBuffer
from .tile_pages import TilePages
from .view_looks import ViewLooks
from .visible_surface import VisibleSurface

# Visibility samples whose hits the parameters of a shading sample are the mean of. A wallpaper with
# a pattern a few pixels wide is off by a mean square of 3.5 levels of 255 with 32, 2.5 with 64 and
# 2.4 with 256, beside Cycles; what has no texture does not care.
GATHERED = 64

# A surface that a visibility sample misses is shaded where another hits it, of a group of so many
# numbers: they lie in each eighth of the pixel. Which one is drawn by lot, for each number anew, so
# that all of what is seen of the surface is shaded alike. At its own place, the pixel's middle, it
# would be shaded far too often: where a shadow's edge runs along a ledge's, a third of the light is
# lost.
_LOOKS_TOGETHER = 8

# With more visibility samples than these each pixel has shading samples of its own of all that it
# sees. A shared one is shaded all over the pixel that its surface fills; a neighbour that sees an
# edge of it gets too much light where a shadow lies along that edge. With fewer, noise hides that,
# and shared ones are a sixth less.
_SHARED = 64

# Position, normal and triangle.
_BYTES_OF_LOOK = 40

# Numbers of samples and of list entries are kept in float32.
_MOST = 1 << 24

# A position, two normals and a triangle.
_BYTES_OF_PLACES = 56

# Where normals turn.
_BYTES_OF_BEND = 16

# Of a texture of values, where normals are the mesh's there.
_BYTES_OF_VALUES = 16

# Entries of all lists: a quarter of a gigabyte.
_MOST_ENTRIES = 1 << 25


def _hits_block(*more: Field) -> UniformBlock:
    fields = (Field("vec2", "offset"), Field("int", "height"), Field("int", "number"))
    return UniformBlock("hits", (*fields, *more))


_HITS = PassShader(
    name="sample_hits",
    fragment="sample_hits",
    library=("same_surface",),
    defines=SAME_SURFACE_DEFINES,
    blocks=(_hits_block(),),
    samplers=(
        *PAIR_SAMPLERS,
        ("sample_triangle", "FLOAT_2D"),
        ("visible_triangle", "FLOAT_2D"),
        ("sample_cell", "FLOAT_2D"),
    ),
    outputs=(
        ("VEC4", "surface_position"),
        ("VEC4", "surface_geometric_normal"),
        ("VEC2", "surface_triangle"),
    ),
)
_OWN_HITS = replace(
    _HITS,
    name="sample_own_hits",
    library=(*OWN_HIT_LIBRARY, *_HITS.library),
    defines=(*_HITS.defines, *OWN_HIT_DEFINES),
    blocks=(_hits_block(Field("int", "looks")),),
    samplers=(*_HITS.samplers, *OWN_HIT_SAMPLERS),
)


def _over(description: PassShader, *, is_layer: bool) -> PassShader:
    """The pass for further hits, or for those of a sheer layer, which leaves all but the samples on
    their surfaces as they are."""
    return replace(
        description,
        name=f"{description.name}_{'layer' if is_layer else 'over'}",
        defines=(*description.defines, ("OVER", "1"), *((("OF_LAYER", "1"),) * is_layer)),
    )


_OBJECTS = PassShader(
    name="sample_objects",
    fragment="sample_objects",
    samplers=(("surface_triangle", "FLOAT_2D"),),
    outputs=(("FLOAT", "surface_object"),),
)


def _others_in_group(k: int) -> list[int]:
    """The other visibility samples of sample k's group, in an order of its own."""
    turns = np.random.default_rng(k).permutation(np.arange(1, _LOOKS_TOGETHER))
    return [k ^ int(turn) for turn in turns]


def objects_of(geometry: GeometryBuffer, triangles: Texture) -> Texture:
    """`SurfaceBuffer.objects`, by `VisibleSurface.triangles` of the same."""
    objects = texture_2d(triangles.width, triangles.height, "R32F")
    with_seen_triangle(_OBJECTS, geometry.copies is not None, ids=True).build().draw_fullscreen(
        framebuffer([objects]),
        {"surface_triangle": triangles, **seen_textures(geometry, ids=True)},
        {},
    )
    return objects


class ShadingSamples:
    """The atlas of a view. Call `step` until it says that there is nothing left.

    Args:
        looks: the view's samples.
        passes: find the texels, and read them.
        pages: the cache on the GPU.
        geometry: whose triangles are seen.
        visibility: how many visibility samples the lists are made of.
        least: of how many at least, or else there are none: as many as without lists the samples of
            the lights are.
        memory_budget: bytes of the GPU's memory for the places where samples are shaded.
        bent: where highlights are narrower than a pixel, if anywhere.
    """

    def __init__(
        self,
        looks: ViewLooks,
        passes: tuple[CorrespondencePass, GatherPass],
        pages: TilePages,
        geometry: GeometryBuffer,
        *,
        visibility: int,
        least: int = 1,
        memory_budget: int,
        bent: BentSurfaces | None = None,
    ) -> None:
        self._looks = looks
        self._correspondence, self._gather = passes
        self._pages = pages
        self._geometry = geometry
        self._visibility = visibility
        self._least = min(least, visibility)
        self._has_given_up = False
        self._memory_budget = memory_budget
        self._bent = bent
        self._hit_textures: dict[str, Texture] = {}
        self._own: VisibleSurface | None = None
        self._builder: ListBuilder | None = None
        self._lists: PixelListTextures | None = None
        self._cells: Texture | None = None
        self._sum: SurfaceBuffer | None = None
        self._gathered = 0
        self._mean: SurfaceBuffer | None = None
        self._seen: dict[int, VisibleSurface] = {}
        self._kept: dict[int, tuple[SurfaceBuffer, Texture]] = {}

    @property
    def lists(self) -> PixelListTextures | None:
        """The pixels' lists, once the samples can be shaded."""
        return self._lists if self._mean is not None else None

    @property
    def has_given_up(self) -> bool:
        """Whether the lists would take more room than they may: there are none then."""
        return self._has_given_up

    @property
    def progress(self) -> float:
        """What share of the steps is done."""
        done = (self._builder.visibility if self._builder is not None else 0) + self._gathered
        return done / (self._visibility + self._gather_count)

    def step(self) -> bool:
        """Do the next bit; False when there is nothing left."""
        if self._mean is not None or self._has_given_up:
            return False
        if self._own is None or self._builder is None:
            self._own = self._looks.pinhole(0)
            normal = read_texture(self._own.normal)[..., :3]
            position = read_texture(self._own.position)
            most = min(_MOST, position.shape[1] * max_texture_width())
            self._builder = ListBuilder(position, normal, most, self._layers(self._own))
            if self._is_layered:
                self._pass.add_layered(self._builder, self._own, 0)
            else:
                # The centres hit their own samples.
                self._builder.add_none()
        elif self._lists is None:
            k, full = self._builder.visibility, self._builder.entries > _MOST_ENTRIES
            full = full or self._builder.lacks_room
            if k < self._visibility and not full:
                add = self._pass.add_layered if self._is_layered else self._pass.add
                add(self._builder, self._own, k)
            elif k < self._least:
                self._builder = self._own = None
                self._seen.clear()
                self._has_given_up = True
            else:
                kept = self._pass.kept if self._is_layered else ()
                self._lists = PixelListTextures(self._builder.finish(kept))
                self._own = self._with_further(self._own, self._lists.lists)
        elif self._gathered < self._gather_count:
            self._gather_next()
        else:
            self._take_mean()
        return True

    def sample(self, k: int, *, with_objects: bool = False) -> SurfaceBuffer:
        """The atlas, with the places where sample k of the lights is shaded.

        Args:
            k: which; any number.
            with_objects: whether it must have its `objects`.

        Raises:
            RuntimeError: there are steps left.
        """
        if self._mean is None:
            raise RuntimeError("the shading samples are not complete")
        known = self._kept.get(k)
        if known is None:
            hits = self._hits(k)
            height = self._lists.lists.height if self._lists is not None else None
            surface = replace(
                self._gather.at(hits, self._mean),
                picture_height=height,
                around=self._looks.around(k),
            )
            known = surface, hits.triangles
        surface, triangles = known
        if with_objects and surface.objects is None:
            surface = replace(surface, objects=objects_of(self._geometry, triangles))
        own_values = len(surface.layout.textures_with_mesh_normals)
        texel_bytes = _BYTES_OF_PLACES + own_values * _BYTES_OF_VALUES
        texel_bytes += _BYTES_OF_BEND * (surface.bend is not None)
        size = texel_bytes * surface.width * surface.height
        if k in self._kept or size * (len(self._kept) + 1) < self._memory_budget:
            self._kept[k] = (surface, triangles)
        return surface

    # Inside -------------------------------------------------------------------------------

    @property
    def _is_layered(self) -> bool:
        """Whether the scene has anything sheer."""
        return self._geometry.has_sheer

    def _layers(self, own: VisibleSurface) -> list[SeenPicture] | None:
        """What the pixels' middles see of sheer layers, for the lists."""
        if not self._is_layered:
            return None
        return [
            (
                read_texture(layer.position),
                read_texture(layer.normal)[..., :3],
                read_texture(layer.triangles),
            )
            for layer in own.before
        ]

    @cached_property
    def _pass(self) -> PixelListPass:
        return PixelListPass(self._looks, self._bent, shares=self._visibility <= _SHARED)

    @property
    def _gather_count(self) -> int:
        return min(GATHERED, self._visibility)

    def _with_further(self, own: VisibleSurface, lists: PixelLists) -> VisibleSurface:
        """The atlas' own hits."""
        width, number = lists.width, len(lists.cell)
        rows = -(-number // width)
        cells = np.zeros((max(rows, 1) * width, 2), dtype=np.float32)
        cells[:number] = np.stack([lists.cell % width, lists.cell // width], axis=1)
        self._cells = texture_from_array(cells.reshape(-1, width, 2), "RG32F")
        if len(lists.own_hits):
            self._hit_textures = lists.own_hits.textures(width, lists.height + rows)
        if not rows:
            return own
        whole = []
        for texture, values, components in (
            (own.position, lists.position, 4),
            (own.normal, lists.normal, 4),
            (own.triangles, lists.triangle, 2),
        ):
            further = np.zeros((rows * width, components), dtype=np.float32)
            further[:number, : values.shape[1]] = values
            picture = [read_texture(texture), further.reshape(rows, width, components)]
            whole.append(
                texture_from_array(
                    np.concatenate(picture), "RGBA32F" if components == 4 else "RG32F"
                )
            )
        position, normal, triangles = whole
        return replace(own, position=position, normal=normal, triangles=triangles)

    def _hits(self, k: int) -> VisibleSurface:
        """Where the atlas' samples are shaded for sample k."""
        if self._own is None or self._lists is None or self._cells is None:
            raise RuntimeError("the lists are not complete")
        own, height = self._own, self._lists.lists.height
        size = (own.position.width, own.position.height)
        targets = [texture_2d(*size), texture_2d(*size), texture_2d(*size, "RG32F")]
        described = _OWN_HITS if self._hit_textures else _HITS
        uniforms: dict[str, Any] = {"height": height, "number": k}
        if self._hit_textures:
            uniforms["looks"] = self._lists.lists.own_hits.looks
        # The last that hits a surface stays.
        for order, look in enumerate((*_others_in_group(k), k)):
            hits = self._pinhole(look)
            for number, hit in enumerate((hits, *hits.before)):
                is_first = order + number == 0
                shader = described if is_first else _over(described, is_layer=number > 0)
                shader.build().draw_fullscreen(
                    framebuffer(targets),
                    {
                        **pair_textures(own, hit),
                        "sample_triangle": own.triangles,
                        "visible_triangle": hit.triangles,
                        "sample_cell": self._cells,
                        **self._hit_textures,
                    },
                    {"hits": {"offset": self._looks.offset(look), **uniforms}},
                )
        position, normal, triangles = targets
        return replace(own, position=position, normal=normal, triangles=triangles)

    def _pinhole(self, k: int) -> VisibleSurface:
        """What the view sees at sample k's place in the pixels. Those that are looked at together
        are kept until others are, where there is room."""
        if any(other // _LOOKS_TOGETHER != k // _LOOKS_TOGETHER for other in self._seen):
            self._seen.clear()
        known = self._seen.get(k)
        if known is None:
            known = self._looks.pinhole(k)
            texels = known.position.width * known.position.height * (1 + len(known.before))
            if _LOOKS_TOGETHER * _BYTES_OF_LOOK * texels < self._memory_budget:
                self._seen[k] = known
        return known

    def _gather_next(self) -> None:
        hits = self._hits(self._gathered)
        has_further = self._lists is not None and len(self._lists.lists.cell) > 0
        cells = self._cells if has_further else None
        correspondence = self._correspondence.draw(hits)
        if self._pages.is_paged:
            self._pages.bring(correspondence.read())
        surface = self._gather.draw(hits, correspondence, onto=self._sum, cells=cells)
        self._sum = self._sum or surface
        self._gathered += 1

    def _take_mean(self) -> None:
        total = self._sum
        if total is None or self._own is None:
            raise RuntimeError("nothing was gathered")
        mean = MeanPass(total.layout).draw(total, 1.0 / self._gathered)
        # The scores go with the normals.
        self._own = replace(self._own, normal=total.geometric_normal)
        self._mean, self._sum = mean, None


def fits_lists(width: int, height: int) -> bool:
    """Whether the numbers of a picture's samples can be told apart on the GPU."""
    return 2 * width * height < _MOST and 2 * height <= max_texture_width()
