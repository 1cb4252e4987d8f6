# SPDX-License-Identifier: GPL-3.0-or-later
"""Which spots of a light's cell pixels look at, and what they make of the answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..light_points.light_cells import SPOTS, quarters

ALL_SPOTS = (1 << SPOTS) - 1

# Which spot a pixel of a 4 x 4 block looks at first: in each 2 x 2 four of different quarters.
_FIRST = np.array([[0, 1, 4, 5], [2, 3, 6, 7], [8, 9, 12, 13], [10, 11, 14, 15]])

# Rays of some pixels (R,) to a spot each (R,): whether it is open, and whether it is on the side
# that is lit.
Reach = Callable[
    [NDArray[np.int64], NDArray[np.int64]], tuple[NDArray[np.bool_], NDArray[np.bool_]]
]


@dataclass(frozen=True)
class PixelPlaces:
    """Where N pixels are.

    Attributes:
        row: (N,) their rows.
        column: (N,) their columns.
        size: the picture's height and width.
        with_neighbours: below which row those beside a pixel are its neighbours; None for all.
    """

    row: NDArray[np.int64]
    column: NDArray[np.int64]
    size: tuple[int, ...]
    with_neighbours: int | None

    @property
    def rows(self) -> int:
        """Those with neighbours."""
        return self.size[0] if self.with_neighbours is None else self.with_neighbours

    @property
    def alone(self) -> NDArray[np.bool_]:
        """(N,) which have no neighbours."""
        return np.asarray(self.row >= self.rows)

    def any_near(self, chosen: NDArray[np.bool_], near: int) -> NDArray[np.bool_]:
        """(N,) whether any pixel up to `near` rows and columns away is chosen (N,)."""
        picture = np.zeros(self.size, dtype=np.bool_)
        picture[self.row, self.column] = chosen
        for axis in (0, 1):
            along = np.moveaxis(picture, axis, 0)
            result = along.copy()
            for step in range(1, near + 1):
                result[step:] |= along[:-step]
                result[:-step] |= along[step:]
            picture = np.moveaxis(result, 0, axis)
        return np.asarray(picture[self.row, self.column])


def look_at_spots(reach: Reach, places: PixelPlaces, thorough: float) -> NDArray[np.int64]:
    """(N,) the spots that N pixels see, a bit each; see `TracedShadowPass.draw`."""
    first = _FIRST[places.row % 4, places.column % 4]
    looks = _Looks(len(first))
    looks.look(reach, np.arange(len(first)), first[:, None])
    # In the 5 x 5 pixels around are blocks of 4 x 4, which look at all spots.
    some = np.flatnonzero(looks.differ(places, 2) | places.alone)
    looks.look(reach, some, first[some, None] ^ np.arange(1, 4))
    # In 3 x 3 as well, of four each.
    some = np.flatnonzero((looks.count > 1) & looks.differ(places, 1))
    # The picture's own: what else there is has no say in how its shadows look.
    own = np.count_nonzero(~places.alone[some])
    if own <= thorough * places.rows * places.size[1]:
        looks.look(reach, some, first[some, None] ^ np.arange(4, SPOTS))
    return looks.spots()


class _Looks:
    """What N pixels know of their spots.

    Attributes:
        is_open: (N,) for each spot a bit: it was looked at and is open.
        above: (N,) it was looked at and is on the side that is lit.
        count: (N,) how many were looked at.
    """

    def __init__(self, pixels: int) -> None:
        self.is_open = np.zeros(pixels, dtype=np.int32)
        self.above = np.zeros(pixels, dtype=np.int32)
        self.count = np.zeros(pixels, dtype=np.int32)

    def look(self, reach: Reach, some: NDArray[np.int64], spots: NDArray[np.int64]) -> None:
        """Send rays of some pixels (M,) to the spots (M, G)."""
        found = reach(np.repeat(some, spots.shape[1]), spots.ravel())
        bit = 1 << spots
        for known, each in zip((self.is_open, self.above), found, strict=True):
            known[some] |= np.where(each.reshape(spots.shape), bit, 0).sum(axis=1, dtype=np.int32)
        self.count[some] += spots.shape[1]

    def differ(self, places: PixelPlaces, near: int) -> NDArray[np.bool_]:
        """(N,) whether pixels up to `near` rows and columns away found spots open and others
        hidden."""
        hidden, is_open = self.is_open != self.above, self.is_open != 0
        differ = places.any_near(hidden, near) & places.any_near(is_open, near)
        # Who looked at something that is not lit from there knows nothing.
        return np.asarray(differ | (self.above == 0))

    def spots(self) -> NDArray[np.int64]:
        """(N,) a bit for each spot that is open; those that were not looked at are as open as the
        one in their quarter, and those below what is lit as most that are above."""
        result = np.where(self.is_open != 0, ALL_SPOTS, 0)
        mixed = (self.count > 1) & (self.is_open != 0) & (self.is_open != self.above)
        some = np.flatnonzero(mixed)
        bits = np.arange(SPOTS)
        is_open, above = (
            ((known[some, None] >> bits) & 1).astype(np.bool_)
            for known in (self.is_open, self.above)
        )
        quarter = quarters()
        for number in range(4):
            inside = quarter == number
            few = (self.count[some] == 4)[:, None] & inside
            is_open |= few & is_open[:, inside].any(axis=1)[:, None]
            above |= few & above[:, inside].any(axis=1)[:, None]
        mostly = 2 * is_open.sum(axis=1) > above.sum(axis=1)
        is_open = np.where(above, is_open, mostly[:, None])
        result[some] = (is_open << bits).sum(axis=1)
        return result
