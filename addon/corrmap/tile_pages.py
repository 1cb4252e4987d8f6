# SPDX-License-Identifier: GPL-3.0-or-later
"""All deep framebuffers on the GPU, as square tiles in the pages of array textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..caching.framebuffer import DeepFramebuffer
from ..caching.packing import Packing
from ..errors import InputError
from ..glsl.shader import (
    Samplers,
    Texture,
    max_texture_layers,
    max_texture_width,
    texture_from_array,
)
from .material_table import gather_table
from .surface_layout import MAX_VALUE_TEXTURES, SurfaceLayout
from .tile_layout import TileLayout, lay_out_tiles


@dataclass(frozen=True)
class TilePages:
    """The GPU's copy of a cache.

    Attributes:
        layout: where the tiles lie.
        depth: R32F array texture; 0 where a caching camera hit nothing.
        packed: one array texture for each of `packing.textures`.
        material_table: RGBA32F, see `MaterialTable`.
        packing: what lies where.
        surface_layout: how the surfaces are to hold it.
        scale_rows: see `MaterialTable`.
    """

    layout: TileLayout
    depth: Texture
    packed: tuple[Texture, ...]
    material_table: Texture
    packing: Packing
    surface_layout: SurfaceLayout
    scale_rows: dict[str, tuple[int, int]]

    @property
    def samplers(self) -> Samplers:
        """Sampler declarations for passes that read the tiles."""
        packed: Samplers = tuple((f"cache_{i}", "FLOAT_2D_ARRAY") for i in range(len(self.packed)))
        return (("cache_depth", "FLOAT_2D_ARRAY"), ("material_table", "FLOAT_2D"), *packed)

    def textures(self) -> dict[str, Texture]:
        """The textures by the names in `samplers`."""
        packed = {f"cache_{i}": texture for i, texture in enumerate(self.packed)}
        return {"cache_depth": self.depth, "material_table": self.material_table, **packed}

    def glsl(self) -> str:
        """The packing's functions, and those that write the surfaces."""
        return self.packing.glsl(self.scale_rows) + self.surface_layout.write_glsl()


def upload_tiles(framebuffers: Sequence[DeepFramebuffer], packing: Packing) -> TilePages:
    """Copy deep framebuffers to the GPU, and average each material.

    Args:
        framebuffers: in the order in which the correspondence map will number them.
        packing: of the cache's plan.

    Raises:
        InputError: the tiles need more pages than the GPU's array textures have, there are more
            materials than it has texels in a row, or more channels vary than it can draw at once.
    """
    layout = lay_out_tiles([framebuffer.camera.resolution for framebuffer in framebuffers])
    if layout.page_count > max_texture_layers():
        raise InputError(
            f"{len(framebuffers)} caching cameras do not fit this GPU's textures; "
            "place fewer cameras or bake at a lower preset"
        )
    surface_layout = SurfaceLayout(packing.plan)
    if surface_layout.texture_count > MAX_VALUE_TEXTURES:
        raise InputError(
            f"the materials have {len(surface_layout.values)} values that vary over their "
            f"surfaces, and {4 * MAX_VALUE_TEXTURES} can be drawn at once; make some of them "
            "constant over their material"
        )
    materials = len(packing.plan.material_names)
    if materials + 2 > max_texture_width():
        raise InputError(
            f"{materials} materials do not fit this GPU's textures; use fewer than "
            f"{max_texture_width() - 1}"
        )
    table = gather_table(framebuffers, packing, surface_layout)
    shape = (layout.page_count, layout.page_size, layout.page_size)
    pages = np.zeros((*shape, 1), dtype=np.float32)
    for index, framebuffer in enumerate(framebuffers):
        _tile(pages, layout, index, framebuffer.camera.resolution)[...] = framebuffer.channels[
            "depth"
        ]
    depth = texture_from_array(pages, "R32F")
    scales = [table.scale(framebuffer) for framebuffer in framebuffers]
    packed = []
    for texture in packing.textures:
        pages = np.zeros((*shape, texture.width), dtype=np.float32)
        for index, framebuffer in enumerate(framebuffers):
            tile = _tile(pages, layout, index, framebuffer.camera.resolution)
            tile[...] = packing.pack(framebuffer.channels, texture, scales[index])
        packed.append(texture_from_array(pages, texture.texture_format))
    return TilePages(
        layout,
        depth,
        tuple(packed),
        texture_from_array(table.rows(), "RGBA32F"),
        packing,
        surface_layout,
        table.scale_rows,
    )


def _tile(
    pages: NDArray[np.float32], layout: TileLayout, index: int, resolution: int
) -> NDArray[np.float32]:
    x, y = layout.corner[index]
    return pages[layout.page[index], y : y + resolution, x : x + resolution]
