# SPDX-License-Identifier: GPL-3.0-or-later
"""What the GPU holds of a cache: blocks of texels, in the pages of array textures.

Of the deep framebuffers' blocks only those are held that a view may choose from (`kept_blocks`).
That is found out when a cache is loaded, and not written to it: which texels are beaten depends on
all the cameras that are finished, at the frame that is shown, and any of them may be baked again,
edited or deleted by itself.

The depth of the kept blocks always is on the GPU, since every search reads it. Their other channels
are there as far as a budget allows; beyond that, `bring` fetches what a view reads.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..caching.framebuffer import DeepFramebuffer
from ..caching.packing import Packing, make_packing
from ..caching.plan import ChannelPlan
from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..glsl.shader import (
    Samplers,
    Texture,
    max_texture_layers,
    max_texture_width,
    max_textures,
    texture_from_array,
)
from ..progress import Progress, part_of, silent
from .block_pages import BlockPages
from .depth_ranges import DepthRanges, range_places
from .kept_blocks import SeenSurface, kept_blocks
from .material_table import MaterialTable
from .packed_blocks import PackedBlocks
from .resident_blocks import ResidentBlocks
from .surface_layout import OTHER_TEXTURES, SurfaceLayout
from .texel_codes import from_texel_codes, to_texel_codes
from .tile_layout import (
    BLOCK,
    BLOCK_BITS,
    TABLE_BITS,
    BlockNumbers,
    PageShape,
    block_numbers,
    block_table,
    page_shape,
)

# Bytes of the GPU's memory that a cache may take.
CACHE_BUDGET = 1 << 30

# Framebuffers are read twice: once for what depends on all of them, once to be packed. Up to this
# many bytes of them wait in memory in between.
_WAITING = 256 << 20

_DEPTH_BYTES = 4
_TABLE_BYTES = 8


class TilePages:
    """The GPU's copy of a cache.

    Attributes:
        cameras: whose framebuffers it is of, as the correspondence map numbers them.
        numbers: of their blocks.
        kept: (blocks,) which of them are held at all.
        packing: what lies where in a texel.
        surface_layout: how the surfaces are to hold it.
        material_table: RGBA32F, see `MaterialTable`.
        scale_rows: see `MaterialTable`.
        warnings: a sentence for each thing that goes beyond what it may take.
    """

    def __init__(
        self,
        cameras: Sequence[CachingCamera],
        kept: NDArray[np.bool_],
        packing: Packing,
        table: MaterialTable,
        *,
        budget: int,
    ) -> None:
        """Make the textures, without anything in them.

        Raises:
            InputError: they do not fit the GPU.
        """
        self.cameras = tuple(cameras)
        self.numbers = _numbers_of(self.cameras)
        self.kept = kept
        self.packing = packing
        self.surface_layout = table.layout
        self.scale_rows = table.scale_rows(packing)
        self.material_table = texture_from_array(table.rows(packing), "RGBA32F")
        self._scale_shift = 0
        self.warnings: tuple[str, ...] = ()
        self._budget = budget
        self._table = table
        self._own = self.numbers.count, len(self.cameras)
        blocks = max(int(kept.sum()), 1)
        shape = page_shape(blocks, max_texture_width(), max_texture_layers())
        self._depth_place = np.where(kept, np.cumsum(kept) - 1, -1)
        self._depth = BlockPages(shape, ("R32F",))
        self._ranges = DepthRanges()
        room = budget - shape.texels * _DEPTH_BYTES - self.numbers.count * _TABLE_BYTES
        fits = shape.texels * packing.texel_bytes <= room
        self._store = None if fits else PackedBlocks(packing.textures)
        if not fits:
            pages = room // max(shape.side**2 * packing.texel_bytes, 1)
            shape = PageShape(shape.bits, max(pages, 1))
        self._allowed = shape
        self._make_packed(shape)

    def _make_packed(self, shape: PageShape) -> None:
        formats = [texture.texture_format for texture in self.packing.textures]
        self._packed = BlockPages(shape, formats)
        self._resident = ResidentBlocks(self.numbers.count, shape.places)
        self._update_table()

    def _update_table(self) -> None:
        table = block_table(self._depth_place, self._resident.place)
        self._blocks = texture_from_array(table, "RG32F")

    @property
    def defines(self) -> tuple[tuple[str, str], ...]:
        """What caching_camera.glsl needs of the blocks, the pages and the table."""
        return (
            ("BLOCK_BITS", str(BLOCK_BITS)),
            ("PAGE_BITS", str(self._depth.shape.bits)),
            ("TABLE_BITS", str(TABLE_BITS)),
        )

    @property
    def shifts_scales(self) -> bool:
        """Whether some cameras' shares are of scales of their own."""
        return self._scale_shift > 0

    @property
    def scale_shifts(self) -> NDArray[np.int64]:
        """(N,) for each camera, how many rows behind `scale_rows` its scales lie."""
        return np.where(np.arange(len(self.cameras)) < self._own[1], 0, self._scale_shift)

    @property
    def is_paged(self) -> bool:
        """Whether blocks come and go."""
        return self._store is not None

    @property
    def gpu_bytes(self) -> int:
        """What the texels and the table of their blocks take on the GPU."""
        packed = self._packed.shape.texels * self.packing.texel_bytes
        table = self.numbers.count * _TABLE_BYTES
        return self._depth.shape.texels * _DEPTH_BYTES + packed + table + self._ranges.bytes

    @property
    def host_bytes(self) -> int:
        """What waits in memory to be fetched."""
        return 0 if self._store is None else self._store.bytes

    @property
    def depth_samplers(self) -> Samplers:
        """Sampler declarations for passes that search the tiles."""
        return (("cache_blocks", "FLOAT_2D"), ("cache_depth", "FLOAT_2D_ARRAY"))

    @property
    def samplers(self) -> Samplers:
        """Sampler declarations for passes that read the tiles."""
        count = len(self.packing.textures)
        packed: Samplers = tuple((f"cache_{i}", "FLOAT_2D_ARRAY") for i in range(count))
        return (*self.depth_samplers, ("material_table", "FLOAT_2D"), *packed)

    def depth_textures(self) -> dict[str, Texture]:
        """The textures by the names in `depth_samplers`."""
        return {"cache_blocks": self._blocks, "cache_depth": self._depth.textures[0]}

    def depth_ranges(self) -> Texture:
        """See `DepthRanges`."""
        return self._ranges.texture()

    def textures(self) -> dict[str, Texture]:
        """The textures by the names in `samplers`."""
        packed = {f"cache_{i}": texture for i, texture in enumerate(self._packed.textures)}
        return {**self.depth_textures(), "material_table": self.material_table, **packed}

    def glsl(self) -> str:
        """The packing's functions, and those that write the surfaces."""
        texels = self.packing.glsl(self.scale_rows, shifts=self.shifts_scales)
        return texels + self.surface_layout.write_glsl()

    def write_depth(self, index: int, depth: NDArray[np.float32]) -> None:
        """Put the depth (R, R) of a framebuffer's kept blocks into the pages."""
        numbers, which = self._kept_of(index)
        self._depth.write(self._depth_place[numbers], [_cut(depth[..., None], which)])
        self._ranges.put(index, depth, which)

    def write_packed(
        self, index: int, framebuffer: DeepFramebuffer, scale: dict[str, NDArray[np.float32]]
    ) -> None:
        """Put the other channels of a framebuffer's kept blocks into the pages, or aside."""
        numbers, which = self._kept_of(index)
        codes = []
        for texture in self.packing.textures:
            pixels = self.packing.pack(framebuffer.channels, texture, scale)
            codes.append(to_texel_codes(_cut(pixels, which), texture.texture_format))
        if self._store is not None:
            self._store.add(numbers, codes)
            return
        self._resident.ask(numbers)
        self._packed.write(self._resident.place[numbers], [from_texel_codes(c) for c in codes])

    def finish(self) -> None:
        """Call when all framebuffers were written."""
        self._update_table()

    def holds(self, index: int) -> bool:
        """Whether any block of a framebuffer is kept."""
        return bool(self.kept[self.numbers.of(index)].any())

    def set_added(self, framebuffers: Sequence[DeepFramebuffer]) -> bool:
        """Hold these beside the cache's own, in place of those that were added before.

        All of them that hits a surface is kept. Their cameras come behind the cache's own, and
        their shares are of scales of their own: nothing that is there is written anew.

        Returns:
            False, and nothing is done, where they hold a channel with more precision than the
            texels here have: then all has to be loaded anew.

        Raises:
            InputError: they do not fit the GPU.
        """
        wide = frozenset().union(*(framebuffer.wide for framebuffer in framebuffers))
        if not (wide & set(self.packing.stored)) <= self.packing.wide:
            return False
        table = MaterialTable(make_packing(self.packing.plan), self.surface_layout)
        seen = []
        for framebuffer in framebuffers:
            table.add(framebuffer)
            depth = framebuffer.channels["depth"][..., 0]
            seen.append(SeenSurface(framebuffer.camera, depth, table.ids(framebuffer)))
        self._make_room(seen)
        rows = self._table.rows(self.packing, table if framebuffers else None)
        self.material_table = texture_from_array(rows, "RGBA32F")
        own_rows = len(self._table.rows(self.packing))
        self._scale_shift = own_rows - self.surface_layout.scale_row if framebuffers else 0
        for index, framebuffer in enumerate(framebuffers, start=self._own[1]):
            self.write_depth(index, framebuffer.channels["depth"][..., 0])
            self.write_packed(index, framebuffer, table.scale(framebuffer))
        self.finish()
        return True

    def _make_room(self, seen: Sequence[SeenSurface]) -> None:
        """Have places for the blocks of these behind the cache's own.

        Raises:
            InputError: they do not fit the GPU.
        """
        blocks, cameras = self._own
        every = (*self.cameras[:cameras], *(picture.camera for picture in seen))
        self.numbers = _numbers_of(every)
        self.cameras = every
        self._ranges.keep(cameras)
        more = [which.ravel() for which in kept_blocks(seen, drop=False)]
        self.kept = np.concatenate([self.kept[:blocks], *more])
        self._depth_place = np.where(self.kept, np.cumsum(self.kept) - 1, -1)
        wanted = int(self.kept.sum())
        if wanted > self._depth.shape.places:
            self._depth = self._depth.grown(self._depth.shape.with_places(wanted))
        shape = self._packed.shape
        if self._store is not None:
            self._store.drop(blocks)
        elif wanted > shape.places:
            self._packed = self._packed.grown(shape.with_places(wanted))
        self._resident.resize(blocks, self.numbers.count, self._packed.shape.places)

    def _kept_of(self, index: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Numbers of a framebuffer's kept blocks, and (B, B) which they are."""
        span = self.numbers.of(index)
        which = self.kept[span]
        across = int(self.numbers.across[index])
        return span.start + np.flatnonzero(which), which.reshape(across, across)

    def bring(self, found: NDArray[np.float32]) -> None:
        """Have what a correspondence map (H, W, 4) reads on the GPU.

        What is not held in the pages takes the places of blocks that were not read for the longest.
        A map that reads more than the budget allows gets its blocks all the same, and `warnings`
        says so.
        """
        if self._store is None:
            return
        wanted = np.flatnonzero(self.numbers.shown(found) & self.kept)
        if len(wanted) > self._resident.places:
            self._make_packed(self._allowed.with_places(len(wanted)))
        elif len(wanted) <= self._allowed.places < self._resident.places:
            self._make_packed(self._allowed)
        self.warnings = self._excess()
        missing = self._resident.ask(wanted)
        if not len(missing):
            return
        places = self._resident.place[missing]
        self._packed.write(places, [from_texel_codes(c) for c in self._store.take(missing)])
        self._update_table()

    def _excess(self) -> tuple[str, ...]:
        if self.gpu_bytes <= self._budget:
            return ()
        sentence = (
            f"the cache takes {self.gpu_bytes / 2**20:.0f} MiB of the GPU's memory for this view, "
            f"more than the {self._budget / 2**20:.0f} MiB that it may; a smaller picture, fewer "
            "caching cameras or a lower preset take less"
        )
        return (sentence,)


def upload_tiles(
    framebuffers: Sequence[DeepFramebuffer],
    plan: ChannelPlan,
    budget: int = CACHE_BUDGET,
    *,
    drop: bool = True,
    progress: Progress = silent,
) -> TilePages:
    """Copy deep framebuffers to the GPU, and average each material.

    Args:
        framebuffers: in the order in which the correspondence map will number them. Each is asked
            for twice at most, one after another, so that they may be read when they are.
        plan: of the cache.
        budget: bytes of the GPU's memory that they may take.
        drop: leave out what no view would choose; else only what hits nothing.
        progress: is told how far it is.

    Raises:
        InputError: the blocks need more pages than the GPU's array textures have, there are more
            materials than it has texels in a row, or more channels vary than it can draw at once.
    """
    surface_layout = SurfaceLayout(plan)
    most_textures = max_textures() - OTHER_TEXTURES
    if surface_layout.texture_count > most_textures:
        raise InputError(
            f"the materials have {len(surface_layout.values)} values that vary over their "
            f"surfaces, and this GPU can draw {4 * most_textures} at once; make some of them "
            "constant over their material"
        )
    materials = len(plan.material_names)
    if materials + 2 > max_texture_width():
        raise InputError(
            f"{materials} materials do not fit this GPU's textures; use fewer than "
            f"{max_texture_width() - 1}"
        )
    table = MaterialTable(make_packing(plan), surface_layout)
    waiting: dict[int, DeepFramebuffer] = {}
    seen: list[SeenSurface] = []
    wide: list[frozenset[str]] = []
    held = 0
    for index, framebuffer in enumerate(_read(framebuffers, part_of(progress, 0.0, 0.5))):
        table.add(framebuffer)
        wide.append(framebuffer.wide)
        depth = framebuffer.channels["depth"][..., 0].copy()
        ids = table.ids(framebuffer).astype(np.uint16)
        seen.append(SeenSurface(framebuffer.camera, depth, ids))
        held += sum(values.nbytes for values in framebuffer.channels.values())
        if held <= _WAITING:
            waiting[index] = framebuffer
    kept = kept_blocks(seen, part_of(progress, 0.5, 0.6), drop=drop)
    cameras = [picture.camera for picture in seen]
    flat = np.concatenate([blocks.ravel() for blocks in kept])
    packing = make_packing(plan, wide)
    pages = TilePages(cameras, flat, packing, table, budget=budget)
    for index, picture in enumerate(seen):
        pages.write_depth(index, picture.depth)
    seen.clear()
    for index in range(len(cameras)):
        progress(0.6 + 0.4 * index / len(cameras), f"Packing camera {index + 1}")
        if pages.holds(index):
            # Popped, so that its memory goes once it is packed.
            framebuffer = waiting.pop(index) if index in waiting else framebuffers[index]
            pages.write_packed(index, framebuffer, table.scale(framebuffer))
    pages.finish()
    return pages


def _numbers_of(cameras: Sequence[CachingCamera]) -> BlockNumbers:
    """Of the blocks of their pictures.

    Raises:
        InputError: they are more than this GPU can search.
    """
    numbers = block_numbers([camera.resolution for camera in cameras])
    range_places(numbers)
    return numbers


def _read(framebuffers: Sequence[DeepFramebuffer], progress: Progress) -> Iterator[DeepFramebuffer]:
    for index in range(len(framebuffers)):
        progress(index / len(framebuffers), f"Reading picture {index + 1} of {len(framebuffers)}")
        yield framebuffers[index]


def _cut(pixels: NDArray[Any], which: NDArray[np.bool_]) -> NDArray[Any]:
    """(N, BLOCK, BLOCK, C) of the blocks (B, B) of a picture (R, R, C); 0 beyond its edge."""
    blocks, side = len(which), len(pixels)
    missing = blocks * BLOCK - side
    if missing:
        pixels = np.pad(pixels, ((0, missing), (0, missing), (0, 0)))
    grid = pixels.reshape(blocks, BLOCK, blocks, BLOCK, -1).swapaxes(1, 2)
    return grid[which]
