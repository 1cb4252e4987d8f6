# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels' lists on the GPU: which hits they are made of is found there, and there they are read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import (
    PassShader,
    Samplers,
    Texture,
    framebuffer,
    read_texture,
    texture_2d,
    texture_from_array,
)
from ..glsl.uniforms import Field, UniformBlock
from .bent_surfaces import BentSurfaces
from .pixel_lists import ListBuilder, PixelLists
from .same_surface import SAME_SURFACE_DEFINES, same_surface
from .view_looks import ViewLooks
from .visible_surface import VisibleSurface, clip_from_local

# Texels in a row of what is uploaded as a plain row of values.
_ROW = 4096

# Of shading samples, and of the hits that are held against them.
PAIR_SAMPLERS: Samplers = (
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
    samplers=PAIR_SAMPLERS,
    outputs=(("FLOAT", "stray"),),
)
# Some pixels' hits are asked for wherever they are.
_STRAY_BENT = replace(
    _STRAY,
    name="stray_bent",
    samplers=(*PAIR_SAMPLERS, ("asked_pixels", "FLOAT_2D")),
    defines=(*SAME_SURFACE_DEFINES, ("HAS_ASKED", "1")),
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


class PixelListPass:
    """Tells which hits are strays, for a `ListBuilder`."""

    def __init__(self, looks: ViewLooks, bent: BentSurfaces | None = None) -> None:
        self._looks = looks
        # Through a lens or a shutter a pixel's hits lie in other pixels.
        self._bent = None if looks.is_blurred else bent
        blurred = _STRAY_BLURRED if looks.is_blurred else _STRAY
        self._stray = (blurred if self._bent is None else _STRAY_BENT).build()
        self._asked: Texture | None = None
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
        textures = pair_textures(own, hits)
        if self._bent is not None:
            self._asked = self._asked or _asked_pixels(self._bent, own)
            textures["asked_pixels"] = self._asked
        self._stray.draw_fullscreen(framebuffer([mask]), textures, self._film(k))
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
        alone = None if self._bent is None else self._bent.at(hits, position, triangle)
        builder.add(pixel, position, normal[:, :3], triangle, film, moved=moved, alone=alone)

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


def _asked_pixels(bent: BentSurfaces, own: VisibleSurface) -> Texture:
    """R8, 1 where a pixel's own sample is shaded for that pixel alone, and is not all that it sees:
    where highlights are narrow and a neighbour is on another surface."""
    position, normal = read_texture(own.position), read_texture(own.normal)[..., :3]
    height, width, _ = position.shape
    is_bent = bent.at(own, position.reshape(-1, 4), read_texture(own.triangles).reshape(-1, 2))
    beside = np.zeros((height, width), dtype=bool)
    for one, other in (
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[1:], np.s_[:-1]),
        (np.s_[1:, 1:], np.s_[:-1, :-1]),
        (np.s_[1:, :-1], np.s_[:-1, 1:]),
    ):
        apart = ~same_surface(position[one], normal[one], position[other], normal[other])
        beside[one] |= apart
        beside[other] |= apart
    asked = beside & is_bent.reshape(height, width)
    return texture_from_array(asked[..., None].astype(np.float32), "R8")


def pair_textures(own: VisibleSurface, hits: VisibleSurface) -> dict[str, Texture]:
    """The textures of `PAIR_SAMPLERS`."""
    return {
        "sample_position": own.position,
        "sample_normal": own.normal,
        "visible_position": hits.position,
        "visible_normal": hits.normal,
    }


def _rows(values: NDArray[np.float32]) -> Texture:
    """(N, 2) float32 as RG32F texels, row by row; the last row is filled up with zeros."""
    rows = max(-(-len(values) // _ROW), 1)
    filled = np.zeros((rows * _ROW, 2), dtype=np.float32)
    filled[: len(values)] = values
    return texture_from_array(filled.reshape(rows, _ROW, 2), "RG32F")
