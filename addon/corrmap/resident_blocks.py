# SPDX-License-Identifier: GPL-3.0-or-later
"""Which blocks have a place on the GPU, when there are fewer places than blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class ResidentBlocks:
    """Places that blocks take in turn: who was not asked for the longest gives way.

    Attributes:
        places: how many there are.
        place: (count,) int64, of each block; -1 where it has none.
    """

    def __init__(self, count: int, places: int) -> None:
        """`count` blocks, none of which has a place yet."""
        self.places = places
        self.place = np.full(count, -1, dtype=np.int64)
        self._block = np.full(places, -1, dtype=np.int64)
        self._asked = np.full(places, -1, dtype=np.int64)
        self._time = 0

    def resize(self, first: int, count: int, places: int) -> None:
        """Take the places of the blocks from `first` on; then have `count` blocks, and `places`,
        which are no fewer than before."""
        free = self.place[first:]
        free = free[free >= 0]
        self._block[free] = self._asked[free] = -1
        self.place = np.append(self.place[:first], np.full(count - first, -1, dtype=np.int64))
        more = np.full(places - self.places, -1, dtype=np.int64)
        self._block = np.append(self._block, more)
        self._asked = np.append(self._asked, more)
        self.places = places

    def ask(self, wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        """Give places to all wanted blocks; returns those that had none and are to be written.

        Args:
            wanted: numbers of blocks, each once.

        Raises:
            ValueError: there are more of them than places.
        """
        if len(wanted) > self.places:
            raise ValueError(f"{len(wanted)} blocks do not have {self.places} places")
        self._time += 1
        held = self.place[wanted]
        self._asked[held[held >= 0]] = self._time
        missing = wanted[held < 0]
        taken = np.argsort(self._asked, kind="stable")[: len(missing)]
        gone = self._block[taken]
        self.place[gone[gone >= 0]] = -1
        self._block[taken] = missing
        self.place[missing] = taken
        self._asked[taken] = self._time
        return missing
