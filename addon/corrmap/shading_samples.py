# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading samples of a view, step by step: their lists, then their surfaces.

An *atlas* holds them: the picture's own samples, one for each pixel, and above them rows with the
further ones that `pixel_lists` asks for. Passes shade it as they shade a picture.

A sample's parameters are the mean of what the cache says at several hits in its cell, so that
textures finer than a pixel are as smooth as with a lookup for each visibility sample. Where it is
shaded is another place for each sample of the lights: the hit of that visibility sample, if it is
on the same surface, with the normal that the mesh has there unless the material bends it. So the
edges of shadows and highlights are filtered as the pixels are.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import (
    MAX_COLOR_SLOTS,
    PassShader,
    ShaderProgram,
    Texture,
    framebuffer,
    max_texture_width,
    read_texture,
    texture_2d,
    texture_from_array,
)
from ..glsl.uniforms import Field, UniformBlock
from .correspondence import CorrespondencePass, GatherPass
from .geometry_buffer import GeometryBuffer
from .pixel_lists import ListBuilder, PixelLists
from .same_surface import SAME_SURFACE_DEFINES
from .surface_buffer import SurfaceBuffer
from .surface_layout import SurfaceLayout
from .tile_pages import TilePages
from .view_looks import ViewLooks
from .visible_surface import VisibleSurface, clip_from_local

# Visibility samples whose hits the parameters of a shading sample are the mean of.
GATHERED = 16

# Numbers of samples and of list entries are kept in float32.
_MOST = 1 << 24

# A position, a normal and a triangle.
_BYTES_OF_PLACES = 40

# Of a texture of values, where normals are the mesh's there.
_BYTES_OF_VALUES = 16

# Entries of all lists: a quarter of a gigabyte.
_MOST_ENTRIES = 1 << 25

# Texels in a row of what is uploaded as a plain row of values.
_ROW = 4096

_SAMPLE_SAMPLERS: Any = (
    ("sample_position", "FLOAT_2D"),
    ("sample_normal", "FLOAT_2D"),
    ("visible_position", "FLOAT_2D"),
    ("visible_normal", "FLOAT_2D"),
)
_STRAY = PassShader(
    name="stray",
    fragment="stray",
    library=("same_surface",),
    defines=SAME_SURFACE_DEFINES,
    samplers=_SAMPLE_SAMPLERS,
    outputs=(("FLOAT", "stray"),),
)
# Through a lens or a shutter a pixel's own surface may be hit anywhere.
_STRAY_BLURRED = replace(
    _STRAY,
    name="stray_blurred",
    blocks=(
        UniformBlock(
            "film",
            (Field("mat4", "clip_from_local"), Field("vec2", "size"), Field("vec2", "offset")),
        ),
    ),
    defines=(*SAME_SURFACE_DEFINES, ("IS_BLURRED", "1")),
)
_PICK = PassShader(
    name="pick_hits",
    fragment="pick_hits",
    samplers=(
        ("picked_pixel", "FLOAT_2D"),
        ("visible_position", "FLOAT_2D"),
        ("visible_normal", "FLOAT_2D"),
        ("visible_triangle", "FLOAT_2D"),
    ),
    outputs=(
        ("VEC4", "picked_position"),
        ("VEC4", "picked_normal"),
        ("VEC2", "picked_triangle"),
    ),
)
_HITS = PassShader(
    name="sample_hits",
    fragment="sample_hits",
    library=("same_surface",),
    defines=SAME_SURFACE_DEFINES,
    blocks=(UniformBlock("hits", (Field("vec2", "offset"), Field("int", "height"))),),
    samplers=(
        *_SAMPLE_SAMPLERS,
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
_OBJECTS = PassShader(
    name="sample_objects",
    fragment="sample_objects",
    samplers=(("surface_triangle", "FLOAT_2D"), ("triangle_ids", "FLOAT_2D")),
    outputs=(("FLOAT", "surface_object"),),
)
_MEAN_BLOCK = UniformBlock("mean", (Field("float", "share"),))


class PixelListPass:
    """Tells which hits are strays, for a `ListBuilder`."""

    def __init__(self, looks: ViewLooks) -> None:
        self._looks = looks
        self._stray = (_STRAY_BLURRED if looks.is_blurred else _STRAY).build()
        self._pick = _PICK.build()

    def add(self, builder: ListBuilder, own: VisibleSurface, k: int) -> None:
        """Count visibility sample k.

        Args:
            builder: of the lists.
            own: what the pixels' centres see.
            k: which sample.
        """
        hits = self._looks.visible(k)
        mask = texture_2d(own.position.width, own.position.height, "R8")
        self._stray.draw_fullscreen(framebuffer([mask]), _pair_textures(own, hits), self._film(k))
        pixel = np.flatnonzero(read_texture(mask).ravel() > 0.5)
        if not len(pixel):
            builder.add_none()
            return
        place = np.stack([pixel % mask.width, pixel // mask.width], axis=1)
        rows = _rows(place.astype(np.float32))
        size = (rows.width, rows.height)
        picked = [texture_2d(*size), texture_2d(*size), texture_2d(*size, "RG32F")]
        self._pick.draw_fullscreen(
            framebuffer(picked),
            {
                "picked_pixel": rows,
                "visible_position": hits.position,
                "visible_normal": hits.normal,
                "visible_triangle": hits.triangles,
            },
            {},
        )
        position, normal, triangle = (
            read_texture(t).reshape(-1, components)[: len(pixel)]
            for t, components in zip(picked, (4, 4, 2), strict=True)
        )
        film = self._looks.film(k, pixel, position)
        # Where the pixel itself has been moved to, by the lens or by motion.
        moved = film - np.array(self._looks.offset(k)) if self._looks.is_blurred else None
        builder.add(pixel, position, normal[:, :3], triangle, film, moved=moved)

    def _film(self, k: int) -> dict[str, dict[str, Any]]:
        """Where the reference has its pixels."""
        if not self._looks.is_blurred:
            return {}
        view = self._looks.view
        return {
            "film": {
                "clip_from_local": clip_from_local(view, self._looks.surfaces.origin),
                "size": (view.width, view.height),
                "offset": self._looks.offset(k),
            }
        }


class PixelListTextures:
    """Lists on the GPU.

    Attributes:
        lists: the same as arrays.
        place: RG32F, for each pixel the row of the entries where its list begins, and its length
            times the width of a row and the column.
        entries: RG32F, sample numbers and weights.
    """

    def __init__(self, lists: PixelLists) -> None:
        self.lists = lists
        row, column = np.divmod(lists.first, _ROW)
        place = np.stack([row, column + _ROW * lists.count], axis=1).astype(np.float32)
        self.place = texture_from_array(place.reshape(lists.height, lists.width, 2), "RG32F")
        entries = np.stack([lists.sample.astype(np.float32), lists.weight], axis=1)
        self.entries = _rows(entries)

    @property
    def nbytes(self) -> int:
        """Bytes of the GPU's memory."""
        return sum(8 * int(t.width) * int(t.height) for t in (self.place, self.entries))

    def textures(self) -> dict[str, Texture]:
        """By the names of resolve.glsl."""
        return {"list_place": self.place, "list_entries": self.entries}


class ShadingSamples:
    """The atlas of a view. Call `step` until it says that there is nothing left.

    Args:
        looks: the view's samples.
        passes: find the texels, and read them.
        pages: the cache on the GPU.
        geometry: whose triangles are seen.
        visibility: how many visibility samples the lists are made of.
        memory_budget: bytes of the GPU's memory for the places where samples are shaded.
    """

    def __init__(
        self,
        looks: ViewLooks,
        passes: tuple[CorrespondencePass, GatherPass],
        pages: TilePages,
        geometry: GeometryBuffer,
        *,
        visibility: int,
        memory_budget: int,
    ) -> None:
        self._looks = looks
        self._correspondence, self._gather = passes
        self._pages = pages
        self._geometry = geometry
        self._visibility = visibility
        self._memory_budget = memory_budget
        self._own: VisibleSurface | None = None
        self._builder: ListBuilder | None = None
        self._lists: PixelListTextures | None = None
        self._cells: Texture | None = None
        self._sum: SurfaceBuffer | None = None
        self._gathered = 0
        self._mean: SurfaceBuffer | None = None
        self._kept: dict[int, tuple[SurfaceBuffer, Texture]] = {}

    @property
    def lists(self) -> PixelListTextures | None:
        """The pixels' lists, once the samples can be shaded."""
        return self._lists if self._mean is not None else None

    @property
    def progress(self) -> float:
        """What share of the steps is done."""
        done = (self._builder.visibility if self._builder is not None else 0) + self._gathered
        return done / (self._visibility + self._gather_count)

    def step(self) -> bool:
        """Do the next bit; False when there is nothing left."""
        if self._mean is not None:
            return False
        if self._own is None or self._builder is None:
            self._own = self._looks.pinhole(0)
            normal = read_texture(self._own.normal)[..., :3]
            position = read_texture(self._own.position)
            most = min(_MOST, position.shape[1] * max_texture_width())
            self._builder = ListBuilder(position, normal, most)
            # The centres hit their own samples.
            self._builder.add_none()
        elif self._lists is None:
            k, full = self._builder.visibility, self._builder.entries > _MOST_ENTRIES
            if k < self._visibility and not full:
                self._pass.add(self._builder, self._own, k)
            else:
                self._lists = PixelListTextures(self._builder.finish())
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
            surface = replace(self._gather.at(hits, self._mean), picture_height=height)
            known = surface, hits.triangles
        surface, triangles = known
        if with_objects and surface.objects is None:
            surface = replace(surface, objects=self._objects_of(triangles))
        own_values = len(surface.layout.textures_with_mesh_normals)
        texel_bytes = _BYTES_OF_PLACES + own_values * _BYTES_OF_VALUES
        size = texel_bytes * surface.width * surface.height
        if k in self._kept or size * (len(self._kept) + 1) < self._memory_budget:
            self._kept[k] = (surface, triangles)
        return surface

    # Inside -------------------------------------------------------------------------------

    @cached_property
    def _pass(self) -> PixelListPass:
        return PixelListPass(self._looks)

    @cached_property
    def _hits_program(self) -> ShaderProgram:
        return _HITS.build()

    def _objects_of(self, triangles: Texture) -> Texture:
        """R32F, as `SurfaceBuffer.objects`."""
        objects = texture_2d(triangles.width, triangles.height, "R32F")
        _OBJECTS.build().draw_fullscreen(
            framebuffer([objects]),
            {"surface_triangle": triangles, "triangle_ids": self._geometry.table.ids},
            {},
        )
        return objects

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
        return VisibleSurface(whole[0], whole[1], own.eye, whole[2])

    def _hits(self, k: int) -> VisibleSurface:
        """Where the atlas' samples are shaded for sample k."""
        if self._own is None or self._lists is None or self._cells is None:
            raise RuntimeError("the lists are not complete")
        own, hits = self._own, self._looks.pinhole(k)
        size = (own.position.width, own.position.height)
        targets = [texture_2d(*size), texture_2d(*size), texture_2d(*size, "RG32F")]
        self._hits_program.draw_fullscreen(
            framebuffer(targets),
            {
                **_pair_textures(own, hits),
                "sample_triangle": own.triangles,
                "visible_triangle": hits.triangles,
                "sample_cell": self._cells,
            },
            {"hits": {"offset": self._looks.offset(k), "height": self._lists.lists.height}},
        )
        return VisibleSurface(targets[0], targets[1], own.eye, targets[2])

    def _gather_next(self) -> None:
        hits = self._hits(self._gathered)
        correspondence = self._correspondence.draw(hits)
        if self._pages.is_paged:
            self._pages.bring(correspondence.read())
        surface = self._gather.draw(hits, correspondence, onto=self._sum)
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


class MeanPass:
    """Turns sums of gathered surfaces into means."""

    def __init__(self, layout: SurfaceLayout) -> None:
        self._layout = layout

    def draw(self, total: SurfaceBuffer, share: float) -> SurfaceBuffer:
        """The surfaces with their values multiplied by `share`, directions unit."""
        names = self._layout.value_names
        values = tuple(texture_2d(total.width, total.height) for _ in names)
        textures = {f"sum_{name}": t for name, t in zip(names, total.values, strict=True)}
        textures["surface_geometric_normal"] = total.geometric_normal
        for start in range(0, len(names), MAX_COLOR_SLOTS):
            some = slice(start, start + MAX_COLOR_SLOTS)
            target = framebuffer(values[some])
            self._program(names[some]).draw_fullscreen(target, textures, {"mean": {"share": share}})
        return replace(total, values=values)

    def _program(self, outputs: tuple[str, ...]) -> ShaderProgram:
        names = self._layout.value_names
        unread = "".join(f"vec4 {name};\n" for name in names if name not in outputs)
        return PassShader(
            name="mean_surface",
            fragment="mean_surface",
            generated=unread + self._layout.mean_glsl(),
            blocks=(_MEAN_BLOCK,),
            samplers=(
                ("surface_geometric_normal", "FLOAT_2D"),
                *((f"sum_{name}", "FLOAT_2D") for name in names),
            ),
            outputs=tuple(("VEC4", name) for name in outputs),
        ).build()


def _pair_textures(own: VisibleSurface, hits: VisibleSurface) -> dict[str, Texture]:
    return {
        "sample_position": own.position,
        "sample_normal": own.normal,
        "visible_position": hits.position,
        "visible_normal": hits.normal,
    }


def fits_lists(width: int, height: int) -> bool:
    """Whether the numbers of a picture's samples can be told apart on the GPU."""
    return 2 * width * height < _MOST and 2 * height <= max_texture_width()


def _rows(values: NDArray[np.float32]) -> Texture:
    """(N, 2) float32 as RG32F texels, row by row; the last row is filled up with zeros."""
    rows = max(-(-len(values) // _ROW), 1)
    filled = np.zeros((rows * _ROW, 2), dtype=np.float32)
    filled[: len(values)] = values
    return texture_from_array(filled.reshape(rows, _ROW, 2), "RG32F")
