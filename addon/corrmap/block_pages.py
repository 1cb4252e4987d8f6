# SPDX-License-Identifier: GPL-3.0-or-later
"""Array textures of one shape whose blocks can be written one by one.

Blender's `gpu` module makes a texture from an array, and cannot change a part of it afterwards. So
blocks are staged in a texture of their own, and drawn from there to where they belong.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..caching.packing import TexelFormat
from ..glsl.shader import (
    PassShader,
    Texture,
    Varying,
    layer_framebuffer,
    max_texture_width,
    texture_array,
    texture_from_array,
)
from ..glsl.triangles import triangle_batch
from ..glsl.uniforms import Field, UniformBlock
from .tile_layout import BLOCK, PageShape

_PASS = PassShader(
    name="place_blocks",
    fragment="place_blocks",
    vertex="place_blocks_vert",
    samplers=(("staged", "FLOAT_2D"),),
    vertex_in=(("VEC2", "corner"), ("VEC2", "apart")),
    varyings=(Varying("flat", "VEC2", "staged_from"),),
    outputs=(("VEC4", "placed"),),
)

_COPY = PassShader(
    name="copy_page",
    fragment="copy_page",
    blocks=(UniformBlock("page", (Field("int", "number"),)),),
    samplers=(("pages", "FLOAT_2D_ARRAY"),),
    outputs=(("VEC4", "copied"),),
)

# Blocks staged at once: 16 MiB of the widest texels, as float32 on both sides.
_STAGED = 1 << 12

_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]])


class BlockPages:
    """Pages on the GPU, one array texture for each format.

    Attributes:
        shape: of the pages.
        textures: in the order of the formats. What was never written is undefined.
    """

    def __init__(self, shape: PageShape, formats: Sequence[TexelFormat]) -> None:
        """Make the textures.

        Raises:
            InputError: the GPU has no room for them.
        """
        self.shape = shape
        self._formats = tuple(formats)
        self._program = _PASS.build()
        self.textures: tuple[Texture, ...] = tuple(
            texture_array(shape.side, shape.count, texel_format) for texel_format in formats
        )

    def grown(self, shape: PageShape) -> BlockPages:
        """The same blocks in the same places, in more pages of the same side.

        Raises:
            InputError: the GPU has no room for them.
        """
        more = BlockPages(shape, self._formats)
        program = _COPY.build()
        for source, target in zip(self.textures, more.textures, strict=True):
            for page in range(self.shape.count):
                program.draw_fullscreen(
                    layer_framebuffer(target, page), {"pages": source}, {"page": {"number": page}}
                )
        return more

    def write(self, places: NDArray[np.int64], blocks: Sequence[NDArray[np.float32]]) -> None:
        """Write blocks.

        Args:
            places: (N,) where to, each place once.
            blocks: for each format (N, BLOCK, BLOCK, components) float32.
        """
        order = np.argsort(places, kind="stable")
        for start in range(0, len(order), _STAGED):
            some = order[start : start + _STAGED]
            corners = self.shape.corners(places[some])
            for texture, texel_format, pixels in zip(
                self.textures, self._formats, blocks, strict=True
            ):
                self._write(texture, texel_format, corners, pixels[some])

    def _write(
        self,
        texture: Texture,
        texel_format: TexelFormat,
        corners: NDArray[np.int64],
        pixels: NDArray[np.float32],
    ) -> None:
        across = min(len(pixels), max_texture_width() // BLOCK, 1 << 6)
        down = -(-len(pixels) // across)
        staged = np.zeros((down * across, *pixels.shape[1:]), dtype=np.float32)
        staged[: len(pixels)] = pixels
        staged = staged.reshape(down, across, *pixels.shape[1:]).swapaxes(1, 2)
        picture = staged.reshape(down * BLOCK, across * BLOCK, -1)
        source = texture_from_array(picture, texel_format)
        row, column = np.divmod(np.arange(len(pixels)), across)
        origin = np.stack([column, row], axis=-1) * BLOCK
        for page in np.unique(corners[:, 0]):
            mine = corners[:, 0] == page
            self._draw(texture, int(page), corners[mine, 1:], origin[mine], source)

    def _draw(
        self,
        texture: Texture,
        page: int,
        corners: NDArray[np.int64],
        origin: NDArray[np.int64],
        source: Texture,
    ) -> None:
        at = corners[:, None] + BLOCK * _CORNERS
        apart = np.broadcast_to((origin - corners)[:, None], at.shape)
        # Corners of blocks are multiples of the page's side by powers of two: exact.
        clip = at * (2.0 / self.shape.side) - 1.0
        batch = triangle_batch(
            {
                "corner": clip.reshape(-1, 2).astype(np.float32),
                "apart": apart.reshape(-1, 2).astype(np.float32),
            }
        )
        target = layer_framebuffer(texture, page)
        self._program.draw_batch(batch, target, {"staged": source}, {})
