# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels as weighted lists of shading samples.

J. Ragan-Kelley, C. Kilpatrick, B. Smith, D. Epps, P. Green, C. Hery and F. Durand, "The Lightspeed
Automatic Interactive Lighting Preview System" (2007), section 4: visibility is sampled often and
shading seldom, and with a view at rest the way from shading samples to pixels is linear and fixed.

Each cell of the picture has a shading sample: what its middle sees. A visibility sample of a pixel
that hits the surface of that pixel's own sample counts for it. Any other is a *stray*: it counts
for a sample of the cell that it falls into, the middle's or a further one, which is made the first
time that a surface is met there. So samples are shared by all pixels that see them, and there are
further ones only where a cell holds more than one surface.

Where a highlight is narrower than a pixel (`bent_surfaces`), the pixels that see one facet see
unlike parts of it: samples of such facets are each pixel's own, and shaded where it hits them. So
are all strays of pictures of many samples (`shading_samples`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .own_hits import OwnHits, OwnHitsBuilder
from .same_surface import same_surface

# Samples that a cell has at most, besides those of sheer layers at its middle; what else is met
# there counts for the nearest one.
MOST_IN_CELL = 16

# The lower of two numbers in one key; there are fewer than 2^31 of either.
_LOW = 0xFFFFFFFF

# Positions, normals and triangles of a picture.
SeenPicture = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]

# Strays that are kept apart before they are counted together.
_COUNT_TOGETHER = 1 << 21


@dataclass(frozen=True)
class PixelLists:
    """The lists of a picture of height x width pixels.

    Sample numbers below height * width are the cells' own, row by row from the bottom; the further
    ones come behind them. A pixel without a list is its own sample.

    Attributes:
        height, width: pixels.
        first: (H * W,) int64: where each pixel's list begins.
        count: (H * W,) int64: its length, 0 for none.
        sample: (L,) int64: the lists' samples.
        weight: (L,) float32: and their weights; those of one list add up to 1. With sheer layers
            (L, 3), in colours: the share of the sample's light that reaches the viewer.
        cell: (E,) int64: of each further sample the cell.
        position: (E, 4) float32: as `VisibleSurface.position`.
        normal: (E, 3) float32: as `VisibleSurface.normal`.
        triangle: (E, 2) float32: as `VisibleSurface.triangles`.
        visibility: visibility samples of each pixel.
        own_hits: of samples that serve one pixel alone, and of further ones.
    """

    height: int
    width: int
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    sample: NDArray[np.int64]
    weight: NDArray[np.float32]
    cell: NDArray[np.int64]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    triangle: NDArray[np.float32]
    visibility: int
    own_hits: OwnHits

    @property
    def is_tinted(self) -> bool:
        """Whether weights are in colours."""
        return self.weight.ndim == 2

    @property
    def samples_per_pixel(self) -> float:
        """Shading samples for each pixel."""
        return 1.0 + len(self.cell) / (self.height * self.width)


class ListBuilder:
    """Makes the lists of a view, one visibility sample after another.

    Args:
        position: (H, W, 4) float32: what the cells' middles see, as `VisibleSurface.position`.
        normal: (H, W, 3) float32: as `VisibleSurface.normal`.
        most: samples that there may be; beyond, hits count for the nearest one of their cell, see
            `lacks_room`.
        layers: what the cells' middles see of sheer layers, nearest first: positions, normals
            and triangles, (H, W, 4), (H, W, 3) and (H, W, 2) float32. Each cell has a sample of
            each layer that is there. None for lists without colours.
    """

    def __init__(
        self,
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        most: int = 1 << 24,
        layers: Sequence[SeenPicture] | None = None,
    ) -> None:
        self._most = most
        self._height, self._width = position.shape[:2]
        self._pixels = self._height * self._width
        self._count = self._pixels
        self._position = position.reshape(-1, 4)
        self._normal = normal.reshape(-1, 3)
        self._cell = np.arange(self._pixels, dtype=np.int64)
        # Only the further samples' are asked for.
        self._triangle = np.zeros((self._pixels, 2), dtype=np.float32)
        # A cell's samples: its own, and from each the number of the next, or -1.
        self._next = np.full(self._pixels, -1, dtype=np.int64)
        self._crowd = np.ones(self._pixels, dtype=np.uint8)
        self._lacks_room = False
        self._visibility = 0
        self._new: list[NDArray[np.int64]] = []
        self._keys = np.zeros(0, dtype=np.int64)
        self._times = np.zeros(0, dtype=np.int64)
        self._hits = OwnHitsBuilder()
        self._is_tinted = layers is not None
        self._new_weights: list[NDArray[np.float64]] = []
        self._weights = np.zeros((0, 3))
        # Of each cell the own samples, -1 for none: of what is opaque, and of the layers.
        self._slots = [np.arange(self._pixels, dtype=np.int64)]
        for layer in layers or ():
            self._add_slot(*layer)

    def _add_slot(
        self,
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        triangle: NDArray[np.float32],
    ) -> None:
        """A sample of one more layer in each cell that sees it; beyond `most`, the last one of the
        cell serves this layer too."""
        slot = np.full(self._pixels, -1, dtype=np.int64)
        cell = np.flatnonzero(position.reshape(-1, 4)[:, 3] > 0.0)
        last = np.max(self._slots, axis=0)[cell]
        slot[cell] = last
        room = max(self._most - self._count, 0)
        self._lacks_room |= len(cell) > room
        cell, last = cell[:room], last[:room]
        slot[cell] = number = self._append(cell, last)
        self._position[number] = position.reshape(-1, 4)[cell]
        self._normal[number] = normal.reshape(-1, 3)[cell]
        self._triangle[number] = triangle.reshape(-1, 2)[cell]
        self._slots.append(slot)

    @property
    def entries(self) -> int:
        """Entries that the lists have at most."""
        return len(self._keys) + sum(len(keys) for keys in self._new)

    @property
    def lacks_room(self) -> bool:
        """Whether there are as many samples as there may be, so that some hits count for samples of
        other surfaces."""
        return self._lacks_room

    @property
    def visibility(self) -> int:
        """Visibility samples so far."""
        return self._visibility

    def add(
        self,
        pixel: NDArray[np.int64],
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        triangle: NDArray[np.float32],
        film: NDArray[np.float64],
        *,
        moved: NDArray[np.float64] | None = None,
        alone: NDArray[np.bool_] | None = None,
        weight: NDArray[np.float32] | None = None,
    ) -> None:
        """Count one visibility sample of every pixel.

        With sheer layers, it is called for each layer's strays: `add_none` counts the sample.

        Args:
            pixel: (N,) the pixels, row by row from the bottom, of which it is a stray.
            position: (N, 4) what it hits there, as `VisibleSurface.position`.
            normal: (N, 3) as `VisibleSurface.normal`.
            triangle: (N, 2) as `VisibleSurface.triangles`.
            film: (N, 2) where in the picture the hits lie, pixels from its corner.
            moved: (N, 2) where in the picture the pixels' middles have come to lie, through a lens
                or a shutter. The sample of the cell there, which is shaded all over that cell's
                filter, serves first; without, that is the pixel's own, of which the hits are
                strays.
            alone: (N,) which of them are to be shaded for their own pixel, by samples of that
                pixel's cell. Some that are on the pixel's own surface may be among them.
            weight: (N, 3) the share of their light that reaches the viewer, with sheer layers.
        """
        look = self._visibility
        self._visibility += weight is None
        sample = np.full(len(pixel), -1, dtype=np.int64)
        if moved is not None:
            near = self._cells(moved)
            place, facing = self._position[near], self._normal[near]
            serves = same_surface(place, facing, position, normal)
            sample[serves] = near[serves]
        rest = np.flatnonzero(sample < 0)
        cell = self._cells(film[rest])
        if alone is not None:
            place, facing = self._position[pixel], self._normal[pixel]
            alone = alone | same_surface(place, facing, position, normal)
            cell = np.where(alone[rest], pixel[rest], cell)
        sample[rest] = self._samples_of(cell, position[rest], normal[rest], triangle[rest])
        if moved is None:
            # Of what is in no cell's middle nothing else is known. The background has no place.
            wanted = (sample >= self._pixels) & (position[:, 3] > 0.0)
            kept = np.flatnonzero(wanted if alone is None else wanted | alone)
            # Of a crowded cell another surface's sample may serve.
            place, facing = self._position[sample[kept]], self._normal[sample[kept]]
            kept = kept[same_surface(place, facing, position[kept], normal[kept])]
            hits = OwnHits(sample[kept], position[kept], normal[kept], triangle[kept])
            self._hits.add(hits, look)
        self._new.append(pixel << 32 | sample)
        if weight is not None:
            self._new_weights.append(weight.astype(np.float64))
        if sum(len(keys) for keys in self._new) > _COUNT_TOGETHER:
            self._count_together()

    def add_none(self) -> None:
        """Count one visibility sample that is no pixel's stray."""
        self._visibility += 1

    def finish(self, own_light: Sequence[NDArray[np.float32]] = ()) -> PixelLists:
        """The lists of what was added so far.

        Args:
            own_light: (H, W, 3) each, with sheer layers: the sum of what reached the viewer from
                the pixels' own samples, of what is opaque and of the layers.
        """
        self._count_together()
        if self._is_tinted:
            return self._tinted_lists(own_light)
        pixel, sample, hits = self._keys >> 32, self._keys & _LOW, self._times
        # What came back to its own pixel's sample is no stray.
        is_stray = pixel != sample
        pixel, sample, hits = pixel[is_stray], sample[is_stray], hits[is_stray]
        listed, times = np.unique(pixel, return_counts=True)
        strays = np.bincount(pixel, hits, self._pixels)[listed]
        own = self._visibility - strays.astype(np.int64)
        kept = own > 0
        pixel = np.concatenate([pixel, listed[kept]])
        sample = np.concatenate([sample, listed[kept]])
        count = np.concatenate([hits, own[kept]])
        order = np.argsort(pixel, kind="stable")
        lengths = np.zeros(self._pixels, dtype=np.int64)
        lengths[listed] = times + kept
        weight = (count[order] / max(self._visibility, 1)).astype(np.float32)
        return self._lists(lengths, sample[order], weight)

    def _tinted_lists(self, own_light: Sequence[NDArray[np.float32]]) -> PixelLists:
        keys, weights = [self._keys], [self._weights]
        for slot, share in zip(self._slots, own_light, strict=True):
            pixel = np.flatnonzero(slot >= 0)
            keys.append(pixel << 32 | slot[pixel])
            weights.append(share.reshape(-1, 3)[pixel].astype(np.float64))
        key, weight = _summed(np.concatenate(keys), np.concatenate(weights))
        weight /= max(self._visibility, 1)
        pixel, sample = key >> 32, key & _LOW
        # What lies behind something opaque is not seen; and of what is seen whole there is no list.
        lengths = np.bincount(pixel[weight.any(axis=1)], minlength=self._pixels)
        whole = (lengths[pixel] == 1) & (pixel == sample) & (weight == 1.0).all(axis=1)
        used = weight.any(axis=1) & ~whole
        lengths = np.bincount(pixel[used], minlength=self._pixels)
        return self._lists(lengths, sample[used], weight[used].astype(np.float32))

    def _lists(
        self, lengths: NDArray[np.int64], sample: NDArray[np.int64], weight: NDArray[np.float32]
    ) -> PixelLists:
        """Lists of these lengths, one pixel's after another's."""
        extra = slice(self._pixels, self._count)
        return PixelLists(
            height=self._height,
            width=self._width,
            first=np.cumsum(lengths) - lengths,
            count=lengths,
            sample=sample,
            weight=weight,
            cell=self._cell[extra].copy(),
            position=self._position[extra].copy(),
            normal=self._normal[extra].copy(),
            triangle=self._triangle[extra].copy(),
            visibility=self._visibility,
            own_hits=self._hits.finish(),
        )

    def _cells(self, film: NDArray[np.float64]) -> NDArray[np.int64]:
        """(N,) the cells of (N, 2) places; what lies beyond the border counts for those at it."""
        column, row = np.clip(np.floor(film), 0, [self._width - 1, self._height - 1]).T
        return np.asarray(row * self._width + column, dtype=np.int64)

    def _count_together(self) -> None:
        if self._is_tinted:
            self._keys, self._weights = _summed(
                np.concatenate([self._keys, *self._new]),
                np.concatenate([self._weights, *self._new_weights]),
            )
            self._new, self._new_weights = [], []
            return
        keys, where = np.unique(np.concatenate([self._keys, *self._new]), return_inverse=True)
        ones = np.ones(len(where) - len(self._times), dtype=np.int64)
        times = np.bincount(where, np.concatenate([self._times, ones]), len(keys))
        self._keys, self._times, self._new = keys, times.astype(np.int64), []

    def _samples_of(
        self,
        cell: NDArray[np.int64],
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
        triangle: NDArray[np.float32],
    ) -> NDArray[np.int64]:
        """(N,) the sample of each hit, made where there was none."""
        sample = np.full(len(cell), -1, dtype=np.int64)
        todo = np.arange(len(cell))
        while len(todo):
            found, last = self._find(cell[todo], position[todo], normal[todo])
            sample[todo] = found
            todo, last = todo[found < 0], last[found < 0]
            # The first hit of each cell makes a sample, and the others look again.
            _, first = np.unique(cell[todo], return_index=True)
            new = todo[first]
            sample[new] = self._append(cell[new], last[first])
            self._crowd[cell[new]] += 1
            self._position[sample[new]] = position[new]
            self._normal[sample[new]] = normal[new]
            self._triangle[sample[new]] = triangle[new]
            todo = np.delete(todo, first)
        return sample

    def _find(
        self,
        cell: NDArray[np.int64],
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(N,) the sample that serves each hit, or -1; and the last sample of its cell."""
        found = np.full(len(cell), -1, dtype=np.int64)
        last = cell.copy()
        nearest = cell.copy()
        distance = np.full(len(cell), np.inf)
        some, current = np.arange(len(cell)), cell
        while len(some):
            place = self._position[current]
            same = same_surface(place, self._normal[current], position[some], normal[some])
            found[some[same]] = current[same]
            some, current, place = some[~same], current[~same], place[~same]
            away = np.linalg.norm(place - position[some], axis=1)
            nearer = away < distance[some]
            nearest[some[nearer]], distance[some[nearer]] = current[nearer], away[nearer]
            last[some] = current
            current = self._next[current]
            some, current = some[current >= 0], current[current >= 0]
        full = self._crowd[cell] >= MOST_IN_CELL
        if self._count + len(cell) > self._most:
            full[:] = True
            self._lacks_room |= bool((found < 0).any())
        full &= found < 0
        found[full] = nearest[full]
        return found, last

    def _append(self, cell: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.int64]:
        """Add samples behind the last ones of their cells; their numbers."""
        number = np.arange(self._count, self._count + len(cell))
        self._count += len(cell)
        if self._count > len(self._cell):
            more = max(self._count - len(self._cell), len(self._cell) // 4)
            self._position = np.pad(self._position, ((0, more), (0, 0)))
            self._normal = np.pad(self._normal, ((0, more), (0, 0)))
            self._cell = np.pad(self._cell, (0, more))
            self._triangle = np.pad(self._triangle, ((0, more), (0, 0)))
            self._next = np.pad(self._next, (0, more), constant_values=-1)
        self._cell[number] = cell
        self._next[last] = number
        return number


def _summed(
    keys: NDArray[np.int64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Each key once, in ascending order, with the sum of its weights (N, 3)."""
    unique, where = np.unique(keys, return_inverse=True)
    sums = [np.bincount(where, weights[:, channel], len(unique)) for channel in range(3)]
    return unique, np.stack(sums, axis=1)
