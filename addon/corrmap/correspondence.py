# SPDX-License-Identifier: GPL-3.0-or-later
"""The correspondence map: for every pixel of the view, the cached texel to read.

Kim, Kyung, Lee 2009, section III.3. Two passes over the view: `CorrespondencePass` finds the
best caching camera of each pixel (equation 5); `GatherPass` reads the deep framebuffers there,
and fills one- and two-pixel holes from neighbours of the same material. What stays open after that
is shaded with its material's mean values on the triangle's own normal, and counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import (
    MAX_COLOR_SLOTS,
    PassShader,
    Samplers,
    ShaderProgram,
    Texture,
    adding,
    framebuffer,
    read_texture,
    texture_2d,
)
from .camera_table import CAMERA_SAMPLERS, camera_table
from .candidate_cameras import (
    CandidatePass,
    candidate_defines,
    candidate_samplers,
    list_count,
)
from .normal_bend import NormalBendPass
from .shading_normals import MeshNormalPass, ShadingNormalPass
from .surface_buffer import SurfaceBuffer
from .tile_pages import TilePages
from .visible_surface import VisibleSurface


@dataclass(frozen=True)
class CorrespondenceMap:
    """Which texel each pixel reads.

    Attributes:
        texture: RGBA32F: camera number (an index into the session's cameras) or -1 for a
            hole, u, v in [0, 1] of that camera's picture, score (equation 5).
    """

    texture: Texture

    def read(self) -> NDArray[np.float32]:
        """(H, W, 4) float32, row 0 at the bottom."""
        return read_texture(self.texture)


_VISIBLE_SAMPLERS: Samplers = (
    ("visible_position", "FLOAT_2D"),
    ("visible_normal", "FLOAT_2D"),
)
_LIBRARY = ("tolerances", "caching_camera")

# Up to so many caching cameras are all tried at every pixel: making lists would take longer.
TRIED_ALL = 8


_SHIFTS = ("HAS_SCALE_SHIFTS", "1")


class CorrespondencePass:
    """Finds the best caching camera of every pixel.

    Args:
        pages: the cache.
        origin: (3,) float64, of local space.
        tried_all: up to how many cameras all are tried, without lists of candidates.
    """

    def __init__(
        self, pages: TilePages, origin: NDArray[np.float64], *, tried_all: int = TRIED_ALL
    ) -> None:
        self._pages = pages
        self._cameras = camera_table(pages.cameras, pages.numbers, origin)
        listed = len(pages.cameras) > tried_all
        lists = list_count(len(pages.cameras))
        self._candidates = (
            CandidatePass(pages.defines, pages.depth_samplers, lists) if listed else None
        )
        self._program = PassShader(
            name="correspondence",
            fragment="correspondence",
            library=(*_LIBRARY, "camera_score", *(("candidate_cameras",) if listed else ())),
            defines=(*pages.defines, *(candidate_defines(lists) if listed else ())),
            samplers=(
                *_VISIBLE_SAMPLERS,
                *CAMERA_SAMPLERS,
                *pages.depth_samplers,
                *(candidate_samplers(lists) if listed else ()),
            ),
            outputs=(("VEC4", "correspondence"),),
        ).build()

    def draw(self, visible: VisibleSurface) -> CorrespondenceMap:
        """The correspondence map of one sample of the view."""
        texture = texture_2d(visible.position.width, visible.position.height)
        cameras = {"camera_table": self._cameras, **self._pages.depth_textures()}
        lists = {}
        if self._candidates is not None:
            ranges = {"depth_ranges": self._pages.depth_ranges()}
            lists = self._candidates.draw(visible, {**cameras, **ranges}).textures()
        self._program.draw_fullscreen(
            framebuffer([texture]),
            {
                "visible_position": visible.position,
                "visible_normal": visible.normal,
                **cameras,
                **lists,
            },
            {},
        )
        return CorrespondenceMap(texture)


class GatherPass:
    """Reads the surfaces' parameters through a correspondence map.

    Args:
        pages: the cache on the GPU.
        origin: of local space.
        normals: of the mesh, where some are smooth and some material has them.
        bends: by how much normals turn, where some are smooth and some material has highlights.
    """

    def __init__(
        self,
        pages: TilePages,
        origin: NDArray[np.float64],
        normals: ShadingNormalPass | None = None,
        bends: NormalBendPass | None = None,
    ) -> None:
        self._pages = pages
        self._normals = normals
        self._bends = bends
        self._origin = np.array(origin, dtype=np.float64)
        self._cameras = camera_table(pages.cameras, pages.numbers, origin, pages.scale_shifts)
        # Position is handed through from the visible surface; the rest is written here.
        self._outputs = ("surface_geometric_normal", *pages.surface_layout.value_names)
        self._programs = self._built(has_cells=False)

    @property
    def has_normals(self) -> bool:
        """Whether it needs `VisibleSurface.shading_normal`, or finds it itself."""
        return self._normals is not None

    @property
    def has_bends(self) -> bool:
        """The same of `VisibleSurface.bend`."""
        return self._bends is not None

    @cached_property
    def _atlas_programs(self) -> list[ShaderProgram]:
        """Made when an atlas is first gathered: a moving view has none."""
        return self._built(has_cells=True)

    def _built(self, *, has_cells: bool) -> list[ShaderProgram]:
        """For as many outputs at a time as there may be, in their order."""
        return [
            self._program(self._outputs[start : start + MAX_COLOR_SLOTS], has_cells=has_cells)
            for start in range(0, len(self._outputs), MAX_COLOR_SLOTS)
        ]

    def _program(self, outputs: Sequence[str], *, has_cells: bool) -> ShaderProgram:
        """Writes some of the outputs; the others are variables that nothing reads."""
        pages = self._pages
        unread = "".join(f"vec4 {name};\n" for name in self._outputs if name not in outputs)
        return PassShader(
            name="gather",
            fragment="gather",
            library=("material_table", *_LIBRARY),
            defines=(
                *pages.defines,
                *((_SHIFTS,) if pages.shifts_scales else ()),
                *((("HAS_CORNER_NORMALS", "1"),) if self._normals is not None else ()),
                *((("HAS_CELLS", "1"),) if has_cells else ()),
            ),
            generated=unread + pages.glsl(),
            samplers=(
                *_VISIBLE_SAMPLERS,
                *((("visible_shading_normal", "FLOAT_2D"),) if self._normals is not None else ()),
                ("correspondence", "FLOAT_2D"),
                *((("sample_cell", "FLOAT_2D"),) if has_cells else ()),
                *CAMERA_SAMPLERS,
                *pages.samplers,
            ),
            outputs=tuple(("VEC4", name) for name in outputs),
        ).build()

    def draw(
        self,
        visible: VisibleSurface,
        correspondence: CorrespondenceMap,
        onto: SurfaceBuffer | None = None,
        cells: Texture | None = None,
    ) -> SurfaceBuffer:
        """The view's surfaces, holes filled.

        Args:
            visible: what is seen.
            correspondence: of the same.
            onto: the values are added to those of these, if given, and come back in its textures.
            cells: RG32F, of an atlas of shading samples: the pixels of the picture where those of
                the rows above it lie; None where all is a picture.
        """
        width, height = visible.position.width, visible.position.height
        targets = [texture_2d(width, height) for _ in self._outputs]
        if onto is not None:
            targets[1:] = onto.values
        textures = {
            "visible_position": visible.position,
            "visible_normal": visible.normal,
            "correspondence": correspondence.texture,
            "camera_table": self._cameras,
            **self._pages.textures(),
        }
        if self._normals is not None:
            textures["visible_shading_normal"] = self._normals.draw(visible)
        programs = self._programs
        if cells is not None:
            textures["sample_cell"] = cells
            programs = self._atlas_programs
        with nullcontext() if onto is None else adding():
            for part, program in enumerate(programs):
                start = part * MAX_COLOR_SLOTS
                target = framebuffer(targets[start : start + MAX_COLOR_SLOTS])
                program.draw_fullscreen(target, textures, {})
        return SurfaceBuffer(
            width=width,
            height=height,
            origin=self._origin,
            eye=visible.eye[:3],
            perspective=bool(visible.eye[3] > 0.0),
            position=visible.position,
            geometric_normal=targets[0],
            values=tuple(targets[1:]),
            material_table=self._pages.material_table,
            layout=self._pages.surface_layout,
            objects=visible.objects,
            triangles=visible.seen_triangles,
            bend=None if self._bends is None else self._bends.of(visible),
            shading_normal=textures.get("visible_shading_normal"),
        )

    def at(self, visible: VisibleSurface, surface: SurfaceBuffer) -> SurfaceBuffer:
        """Surfaces that were gathered elsewhere on the same, at the places that are seen: normals
        that the mesh gives are those there."""
        placed = replace(
            surface,
            position=visible.position,
            geometric_normal=visible.normal,
            triangles=visible.seen_triangles,
            bend=None if self._bends is None else self._bends.of(visible),
            shading_normal=None,
        )
        if not surface.layout.mesh_normals:
            return placed
        shaded = None if self._normals is None else self._normals.draw(visible)
        program = MeshNormalPass(surface.layout, surface.material_table)
        normal = visible.normal if shaded is None else shaded
        values = program.draw(visible.position, normal, surface.values)
        return replace(placed, values=values, shading_normal=shaded)


@dataclass(frozen=True)
class Coverage:
    """How much of the view's surface the cache shows.

    Attributes:
        surface_pixels: pixels that see any surface.
        hole_fraction: share of them that no caching camera sees.
        open_fraction: share still open after small holes were filled from neighbours.
    """

    surface_pixels: int
    hole_fraction: float
    open_fraction: float


def measure_coverage(surface: SurfaceBuffer) -> Coverage:
    """Count holes in one sample of the view: a pixel is one if anything is that it sees, behind
    sheer layers or of them."""
    is_surface = np.zeros((surface.height, surface.width), dtype=np.bool_)
    is_hole, is_open = is_surface.copy(), is_surface.copy()
    for each in (surface, *surface.before):
        seen = read_texture(each.position)[..., 3] > 0.0
        origin = read_texture(each.geometric_normal)[..., 3]
        is_surface |= seen
        is_hole |= seen & (origin <= 0.0)
        is_open |= seen & (origin == 0.0)
    pixels, holes, opened = (int(np.count_nonzero(x)) for x in (is_surface, is_hole, is_open))
    return Coverage(pixels, holes / max(pixels, 1), opened / max(pixels, 1))
