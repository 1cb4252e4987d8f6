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
from .tile_layout import TileLayout, lay_out_tiles


@dataclass(frozen=True)
class TilePages:
    """The GPU's copy of a cache.

    Attributes:
        layout: where the tiles lie.
        depth: R32F array texture; 0 where a caching camera hit nothing.
        packed: one array texture for each of `packing.textures`.
        means: RGBA32F, (materials + 2) x textures: the mean of every packed component over
            each material's texels, for surfaces that no camera saw. The first and the last
            column, for materials that the cache does not know, are over all.
        packing: what lies where.
    """

    layout: TileLayout
    depth: Texture
    packed: tuple[Texture, ...]
    means: Texture
    packing: Packing

    @property
    def samplers(self) -> Samplers:
        """Sampler declarations for passes that read the tiles."""
        packed: Samplers = tuple((f"cache_{i}", "FLOAT_2D_ARRAY") for i in range(len(self.packed)))
        return (("cache_depth", "FLOAT_2D_ARRAY"), ("cache_means", "FLOAT_2D"), *packed)

    def textures(self) -> dict[str, Texture]:
        """The textures by the names in `samplers`."""
        packed = {f"cache_{i}": texture for i, texture in enumerate(self.packed)}
        return {"cache_depth": self.depth, "cache_means": self.means, **packed}

    def glsl(self) -> str:
        """`CachedSurface`, `read_packed`, `read_identity` and `read_material_mean`."""
        packed = range(len(self.packed))
        # What tells whose surface a texel is; textures without any of it are not read.
        identity = [
            index
            for index, texture in enumerate(self.packing.textures)
            if any(name in ("material_id", "normal") for name, _ in texture.components)
        ]
        lines = [
            self.packing.glsl(),
            "vec4 read_packed(int index, ivec3 texel)",
            "{",
            *(f"  if (index == {i}) {{ return texelFetch(cache_{i}, texel, 0); }}" for i in packed),
            "  return vec4(0.0);",
            "}",
            "",
            "/* Only material_id and normal are set. */",
            "CachedSurface read_identity(ivec3 texel)",
            "{",
            "  vec4 texels[PACKED_COUNT];",
            "  for (int i = 0; i < PACKED_COUNT; i++) { texels[i] = vec4(0.0); }",
            *(f"  texels[{i}] = texelFetch(cache_{i}, texel, 0);" for i in identity),
            "  return unpack_surface(texels);",
            "}",
            "",
            "CachedSurface read_material_mean(int column)",
            "{",
            "  vec4 texels[PACKED_COUNT];",
            "  for (int i = 0; i < PACKED_COUNT; i++) {",
            "    texels[i] = texelFetch(cache_means, ivec2(column, i), 0);",
            "  }",
            "  return unpack_surface(texels);",
            "}",
            "",
        ]
        return "\n".join(lines)


def upload_tiles(
    framebuffers: Sequence[DeepFramebuffer], packing: Packing, material_count: int
) -> TilePages:
    """Copy deep framebuffers to the GPU, and average each material.

    Args:
        framebuffers: in the order in which the correspondence map will number them.
        packing: of the cache's plan.
        material_count: materials in the plan; `material_id` runs from 1 to it.

    Raises:
        InputError: the tiles need more pages than the GPU's array textures have, or there are
            more materials than it has texels in a row.
    """
    layout = lay_out_tiles([framebuffer.camera.resolution for framebuffer in framebuffers])
    if layout.page_count > max_texture_layers():
        raise InputError(
            f"{len(framebuffers)} caching cameras do not fit this GPU's textures; "
            "place fewer cameras or bake at a lower preset"
        )
    columns = material_count + 2
    if columns > max_texture_width():
        raise InputError(
            f"{material_count} materials do not fit this GPU's textures; use fewer than "
            f"{max_texture_width() - 1}"
        )
    shape = (layout.page_count, layout.page_size, layout.page_size)
    pages = np.zeros((*shape, 1), dtype=np.float32)
    for index, framebuffer in enumerate(framebuffers):
        _tile(pages, layout, index, framebuffer.camera.resolution)[...] = framebuffer.channels[
            "depth"
        ]
    depth = texture_from_array(pages, "R32F")
    sums = np.zeros((len(packing.textures) or 1, columns, 4))
    counts = np.zeros(columns)
    for framebuffer in framebuffers:
        ids = _material_ids(framebuffer, packing, material_count)
        counts += np.bincount(ids, minlength=columns)
    packed = []
    for number, texture in enumerate(packing.textures):
        pages = np.zeros((*shape, 4), dtype=np.float32)
        for index, framebuffer in enumerate(framebuffers):
            pixels = packing.pack(framebuffer.channels, texture)
            _tile(pages, layout, index, framebuffer.camera.resolution)[...] = pixels
            ids = _material_ids(framebuffer, packing, material_count)
            for component in range(4):
                sums[number, :, component] += np.bincount(
                    ids,
                    weights=pixels[..., component].ravel()[_hit(framebuffer)],
                    minlength=columns,
                )
        packed.append(texture_from_array(pages, texture.texture_format))
    overall = sums.sum(axis=1, keepdims=True) / max(counts.sum(), 1.0)
    known = counts[None, :, None] > 0.0
    means = np.where(known, sums / np.maximum(counts, 1.0)[None, :, None], overall)
    means[:, [0, -1]] = overall
    return TilePages(
        layout,
        depth,
        tuple(packed),
        texture_from_array(means.astype(np.float32), "RGBA32F"),
        packing,
    )


def _tile(
    pages: NDArray[np.float32], layout: TileLayout, index: int, resolution: int
) -> NDArray[np.float32]:
    x, y = layout.corner[index]
    return pages[layout.page[index], y : y + resolution, x : x + resolution]


def _hit(framebuffer: DeepFramebuffer) -> NDArray[np.bool_]:
    return np.asarray(framebuffer.channels["depth"].ravel() > 0.0)


def _material_ids(
    framebuffer: DeepFramebuffer, packing: Packing, material_count: int
) -> NDArray[np.int64]:
    """The material column of every texel that hit something."""
    hit = _hit(framebuffer)
    if "material_id" not in packing.stored:
        constant = int(packing.constants.get("material_id", (0.0,))[0])
        return np.full(int(hit.sum()), min(constant, material_count))
    ids = np.rint(framebuffer.channels["material_id"].ravel()[hit]).astype(np.int64)
    return np.where((ids < 0) | (ids > material_count), 0, ids)
