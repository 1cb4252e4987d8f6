# SPDX-License-Identifier: GPL-3.0-or-later
"""Which caching cameras a pixel has to try, so that hundreds take hardly longer than a few.

The paper's map tries every camera at every pixel, and asks (section V) how the best is found at run
time. Here each tile of the view gets a short list first. What a tile sees is bounded by a box and a
cone of normals, and with them the score (equation 5) that a camera can have anywhere in it: not
above zero where the tile lies outside of the camera's picture or faces away from it. The list has
the cameras by falling bounds, and a pixel tries them in this order until the bound is below the
best score that it has found. So it finds what trying all of them would find, to the last bit.

Lists that are made when a view is drawn, and not when a cache is baked, fit the view: a close-up's
tiles are small, and their bounds tight. They need no room for what no view sees, and nothing has to
be told of geometry that moved.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..glsl.shader import (
    PassShader,
    Samplers,
    ShaderProgram,
    Texture,
    framebuffer,
    texture_2d,
)
from ..glsl.uniforms import Field, UniformBlock
from .camera_table import CAMERA_SAMPLERS
from .depth_ranges import RANGE_DEFINES, RANGE_SAMPLERS
from .visible_surface import VisibleSurface

# A tile has so many pixels along a side, as a power of two.
TILE_BITS = 3

_TILE_DEFINE = ("TILE_BITS", str(TILE_BITS))

# Each list has eighteen cameras, three to a texel of each of six textures, as many as a pass can
# draw to. What more lists would name is tried only where no camera of these sees the pixel well.
LISTS = 2
_PARTS = 6
LIST_LENGTH = 3 * _PARTS

_VIEWER_BLOCK = UniformBlock("viewer", (Field("vec4", "place"),))
_TILE_NAMES = ("tile_axis", "tile_along", "tile_low", "tile_high")
_RANK_NAMES = tuple(f"ranks_{i}" for i in range(_PARTS))
_LIBRARY = (
    "tolerances",
    "tile_box",
    "caching_camera",
    "camera_score",
    "depth_ranges",
    "tile_bounds",
)


@dataclass(frozen=True)
class CandidateCameras:
    """What each tile of a view has to try.

    Attributes:
        lists: RGBA32F, six texels side by side for each tile: the score's upper bound and three
            cameras' numbers, which are -1 behind the last.
    """

    lists: tuple[Texture, ...]

    def textures(self) -> dict[str, Texture]:
        """By the names in `candidate_samplers`."""
        return {f"candidates_{i}": texture for i, texture in enumerate(self.lists)}


# What a pass declares that includes candidate_cameras.glsl, with so many lists.
def candidate_samplers(lists: int) -> Samplers:
    """Its samplers."""
    return tuple((f"candidates_{i}", "FLOAT_2D") for i in range(lists))


def candidate_defines(lists: int) -> tuple[tuple[str, str], ...]:
    """Its defines."""
    return (
        _TILE_DEFINE,
        ("CANDIDATE_LISTS", str(lists)),
        ("CANDIDATES", str(LIST_LENGTH)),
    )


def list_count(cameras: int) -> int:
    """How many lists so many cameras need."""
    return min(LISTS, -(-cameras // LIST_LENGTH))


class CandidatePass:
    """Makes the lists of views.

    Args:
        defines: `TilePages.defines`.
        depth_samplers: `TilePages.depth_samplers`.
        lists: how many to make, see `list_count`.
    """

    def __init__(
        self,
        defines: tuple[tuple[str, str], ...],
        depth_samplers: Samplers,
        lists: int = LISTS,
    ) -> None:
        self._lists = lists
        self._bounds = PassShader(
            name="tile_bounds",
            fragment="tile_bounds",
            library=("tolerances", "tile_box"),
            defines=(_TILE_DEFINE,),
            blocks=(_VIEWER_BLOCK,),
            samplers=(("visible_position", "FLOAT_2D"), ("visible_normal", "FLOAT_2D")),
            outputs=tuple(("VEC4", name) for name in _TILE_NAMES),
        ).build()
        samplers: Samplers = (
            *((name, "FLOAT_2D") for name in _TILE_NAMES),
            *CAMERA_SAMPLERS,
            *depth_samplers,
            *RANGE_SAMPLERS,
        )
        self._first = _rank_program(defines, samplers)
        earlier: Samplers = (("earlier_last", "FLOAT_2D"),)
        self._later = _rank_program((*defines, ("HAS_EARLIER", "1")), (*samplers, *earlier))
        self._pack = PassShader(
            name="pack_ranks",
            fragment="pack_ranks",
            samplers=tuple((name, "FLOAT_2D") for name in _RANK_NAMES),
            outputs=(("VEC4", "ranks"),),
        ).build()

    def draw(self, visible: VisibleSurface, cameras: dict[str, Texture]) -> CandidateCameras:
        """The lists of one sample of a view.

        Args:
            visible: what it sees.
            cameras: the camera table, the cache's depth and its ranges, by the samplers' names.
        """
        width, height = (
            -(-size >> TILE_BITS) for size in (visible.position.width, visible.position.height)
        )
        bounds = [texture_2d(width, height) for _ in _TILE_NAMES]
        self._bounds.draw_fullscreen(
            framebuffer(bounds),
            {"visible_position": visible.position, "visible_normal": visible.normal},
            {"viewer": {"place": visible.eye}},
        )
        textures = {**dict(zip(_TILE_NAMES, bounds, strict=True)), **cameras}
        lists: list[Texture] = []
        for number in range(self._lists):
            parts = [texture_2d(width, height) for _ in range(_PARTS)]
            program = self._later if number else self._first
            program.draw_fullscreen(framebuffer(parts), textures, {})
            textures["earlier_last"] = parts[-1]
            packed = texture_2d(_PARTS * width, height)
            by_name = dict(zip(_RANK_NAMES, parts, strict=True))
            self._pack.draw_fullscreen(framebuffer([packed]), by_name, {})
            lists.append(packed)
        return CandidateCameras(tuple(lists))


def _rank_program(defines: tuple[tuple[str, str], ...], samplers: Samplers) -> ShaderProgram:
    return PassShader(
        name="rank_cameras",
        fragment="rank_cameras",
        library=_LIBRARY,
        defines=(*defines, *RANGE_DEFINES),
        samplers=samplers,
        outputs=tuple(("VEC4", name) for name in _RANK_NAMES),
    ).build()
