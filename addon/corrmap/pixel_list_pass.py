# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels' lists on the GPU: which hits they are made of is found there, and there they are read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_WIDTH, row_texture
from ..glsl.shader import (
    PassShader,
    Samplers,
    Texture,
    TextureFormat,
    adding,
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
# With sheer layers, what of the light is kept for pixels' own samples is told too.
_LAYER_BLOCK = UniformBlock("layer", (Field("int", "is_sheer"),))


def _layered(description: PassShader) -> PassShader:
    return replace(
        description,
        name=f"{description.name}_layers",
        blocks=(*description.blocks, _LAYER_BLOCK),
        samplers=(*description.samplers, ("seen_through", "FLOAT_2D")),
        outputs=(*description.outputs, ("VEC4", "kept")),
        defines=(*description.defines, ("HAS_LAYERS", "1")),
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
    """Tells which hits are strays, for a `ListBuilder`.

    Args:
        looks: the view's.
        bent: what has highlights that are narrower than a pixel.
        shares: whether pixels share the samples of what both see, as they always do through a lens
            or a shutter.
    """

    def __init__(
        self, looks: ViewLooks, bent: BentSurfaces | None = None, *, shares: bool = True
    ) -> None:
        self._looks = looks
        self._shares = shares or looks.is_blurred
        # Through a lens or a shutter a pixel's hits lie in other pixels.
        self._bent = None if looks.is_blurred else bent
        blurred = _STRAY_BLURRED if looks.is_blurred else _STRAY
        self._blurred = blurred
        self._stray = (blurred if self._bent is None else _STRAY_BENT).build()
        self._asked: Texture | None = None
        # What reached the viewer from pixels' own samples: of what is opaque, and of the layers.
        self._kept: list[Texture] = []
        self._all = texture_from_array(np.ones((1, 1, 4), np.float32), "RGBA32F")
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
        if len(pixel):
            self._add_strays(builder, hits, k, pixel)
        else:
            builder.add_none()

    def add_layered(self, builder: ListBuilder, own: VisibleSurface, k: int) -> None:
        """Count visibility sample k of a view with sheer layers: what is opaque, and each layer.

        Args:
            builder: of the lists.
            own: what the pixels' centres see, with its layers.
            k: which sample.
        """
        hits = self._looks.visible(k)
        size = (own.position.width, own.position.height)
        slots = [own, *own.before]
        while len(self._kept) < len(slots):
            self._kept.append(_cleared(*size))
        for number, hit in enumerate((hits, *hits.before)):
            has_own = number < len(slots)
            mask = _cleared(*size, "R8")
            kept = self._kept[number] if has_own else _cleared(*size)
            sample = slots[number] if has_own else _nothing(own)
            textures = pair_textures(sample, hit)
            stray = self._blurred
            if number == 0 and self._bent is not None:
                stray = _STRAY_BENT
                self._asked = self._asked or _asked_pixels(self._bent, own)
                textures["asked_pixels"] = self._asked
            textures["seen_through"] = hit.through or self._all
            uniforms = {**self._film(k), "layer": {"is_sheer": int(number > 0)}}
            with adding():
                program = _layered(stray).build()
                program.draw_fullscreen(framebuffer([mask, kept]), textures, uniforms)
            pixel = np.flatnonzero(read_texture(mask).ravel() > 0.5)
            if not len(pixel):
                continue
            weight = np.ones((len(pixel), 3), dtype=np.float32)
            if hit.through is not None:
                weight = read_texture(hit.through).reshape(-1, 4)[pixel, :3]
            seen = weight.any(axis=1)
            if seen.any():
                self._add_strays(
                    builder, hit, k, pixel[seen], weight=weight[seen], is_sheer=number > 0
                )
        builder.add_none()

    @property
    def kept(self) -> list[NDArray[np.float32]]:
        """(H, W, 3) each, see `ListBuilder.finish`."""
        return [read_texture(texture)[..., :3] for texture in self._kept]

    def _add_strays(
        self,
        builder: ListBuilder,
        hits: VisibleSurface,
        k: int,
        pixel: NDArray[np.int64],
        *,
        weight: NDArray[np.float32] | None = None,
        is_sheer: bool = False,
    ) -> None:
        """Count some pixels' hits of visibility sample k."""
        width = hits.position.width
        place = np.stack([pixel % width, pixel // width], axis=1)
        rows = row_texture(place, "RG32F", "pixels that have lists")
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
        alone = None
        if not self._shares:
            alone = np.ones(len(pixel), dtype=np.bool_)
        elif self._bent is not None and not is_sheer:
            alone = self._bent.at(hits, position, triangle)
        builder.add(
            pixel, position, normal[:, :3], triangle, film, moved=moved, alone=alone, weight=weight
        )

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
        place: RGBA32F, for each pixel the row and column of the entries where its list begins, and
            its length.
        entries: RG32F, sample numbers and weights; RGBA32F of weights in colours.
    """

    def __init__(self, lists: PixelLists) -> None:
        self.lists = lists
        row, column = np.divmod(lists.first, ROW_WIDTH)
        place = np.stack([row, column, lists.count, np.zeros_like(row)], axis=1)
        shape = (lists.height, lists.width, 4)
        self.place = texture_from_array(place.astype(np.float32).reshape(shape), "RGBA32F")
        numbers = lists.sample.astype(np.float32)[:, None]
        weight = lists.weight if lists.is_tinted else lists.weight[:, None]
        self.entries = row_texture(
            np.concatenate([numbers, weight], axis=1),
            "RGBA32F" if lists.is_tinted else "RG32F",
            "entries of pixels' lists",
        )

    @property
    def nbytes(self) -> int:
        """Bytes of the GPU's memory."""
        entry = 16 if self.lists.is_tinted else 8
        sizes = (int(t.width) * int(t.height) for t in (self.place, self.entries))
        return sum(size * each for size, each in zip(sizes, (16, entry), strict=True))

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


def _cleared(width: int, height: int, texture_format: TextureFormat = "RGBA32F") -> Texture:
    """A texture of zeros."""
    texture = texture_2d(width, height, texture_format)
    target = framebuffer([texture])
    with target.bind():
        target.clear(color=(0.0, 0.0, 0.0, 0.0))
    return texture


def _nothing(like: VisibleSurface) -> VisibleSurface:
    """Pixels that see nothing."""
    size = (like.position.width, like.position.height)
    return replace(like, position=_cleared(*size), normal=_cleared(*size), before=(), through=None)
