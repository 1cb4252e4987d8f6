# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows of a light's point with a ray for every eleventh pixel, and more where it may matter.

The pixels of every fourth row and column have a ray each, and in the middle of four of them every
other has. One halfway between two of them (or, on their diagonals, four) that found the same, on
one even surface, is taken to see the same; every other has a ray of its own. The same follows with
every second row and column, and with all. Then each pixel that was taken to see what one beside it
does not has a ray, and so on along the edge that is found. So edges of shadows are where they are,
to the pixel; what is lost is a shadow or a gap that lies between the first rays as a whole: nothing
that is two pixels wide and eight long.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .even_places import BETWEEN, COARSEST, between

# Of what a pixel sees, times its side.
HIDDEN, SEEN = 1, 2

_Pixels = NDArray[np.int64]

# How far around a pixel of an edge its other pixels are looked for at once: asking some in vain
# costs less than asking more often.
_REACH = 3

# Rows and columns from a pixel to those around it.
_AROUND = np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1].reshape(2, -1)

# Two pictures of all that lie beside each other, along four directions.
_HERE, _BEFORE, _AFTER = slice(None), slice(None, -1), slice(1, None)
_PAIRS = (
    ((_HERE, _BEFORE), (_HERE, _AFTER)),
    ((_BEFORE, _HERE), (_AFTER, _HERE)),
    ((_BEFORE, _BEFORE), (_AFTER, _AFTER)),
    ((_BEFORE, _AFTER), (_AFTER, _BEFORE)),
)


def look_sparsely(
    ask: Callable[[_Pixels], NDArray[np.bool_]],
    sides: NDArray[np.int8],
    even: NDArray[np.bool_],
) -> NDArray[np.int8]:
    """(H, W) whether pixels see a light's point: `HIDDEN` or `SEEN` times the side that is lit; 0
    where none is.

    Args:
        ask: sends rays of some pixels (R,) by their numbers, row by row from 0, in any order, each
            once; whether each meets nothing.
        sides: (H, W) the side that may be lit: 1 the viewer's, -1 the other; 0 for none.
        even: (H, W) as `lies_between`.
    """
    look = _Look(ask, sides)
    middles = [(2 * COARSEST, COARSEST // 2), (2 * COARSEST, COARSEST // 2 + COARSEST)]
    look.trace((COARSEST, 0), *middles)
    step = COARSEST
    while step > 1:
        step //= 2
        look.take_over(step, even)
        look.trace((step, 0))
    look.follow_edges()
    return look.known


class _Look:
    """What is known so far.

    Attributes:
        known: (H, W) as `look_sparsely`; 0 also where nothing is known yet.
    """

    def __init__(
        self, ask: Callable[[_Pixels], NDArray[np.bool_]], sides: NDArray[np.int8]
    ) -> None:
        self._ask, self._sides = ask, sides
        self._asked = np.zeros(sides.shape, dtype=np.bool_)
        self.known = np.zeros_like(sides)

    def trace(self, *lattices: tuple[int, int]) -> None:
        """Ask the pixels of every so many rows and columns, from one on, of which nothing is
        known."""
        self._send(np.concatenate([self._unknown(*lattice) for lattice in lattices]))

    def _unknown(self, step: int, begin: int) -> _Pixels:
        chosen = np.s_[begin::step, begin::step]
        some = (self.known[chosen] == 0) & (self._sides[chosen] != 0)
        pixel = np.flatnonzero(some)
        if step == 1:
            return pixel
        row, column = np.divmod(pixel, some.shape[1])
        return np.asarray((begin + step * row) * self.known.shape[1] + begin + step * column)

    def take_over(self, step: int, even: NDArray[np.bool_]) -> None:
        """Have those between pixels of every other such row and column see what these do."""
        known, sides = (x[::step, ::step] for x in (self.known, self._sides))
        even = even[::step, ::step]
        for begin, pairs in BETWEEN:
            own = between(known[None], begin, (0, 0))[0]
            around = [between(known[None], begin, at)[0] for pair in pairs for at in pair]
            same = between(even[None], begin, (0, 0))[0] & (around[0] != 0) & (own == 0)
            same &= np.sign(around[0]) == between(sides[None], begin, (0, 0))[0]
            for other in around[1:]:
                same &= other == around[0]
            np.copyto(own, around[0], where=same)

    def follow_edges(self) -> None:
        """Ask all that were not, beside others of the same side that see otherwise."""
        known, edge = self.known, np.zeros(self.known.shape, dtype=np.bool_)
        for one, other in _PAIRS:
            differs = known[one] * known[other] == HIDDEN * SEEN
            edge[one] |= differs
            edge[other] |= differs
        pixel = np.flatnonzero(edge & ~self._asked)
        while len(pixel):
            pixel = self._beside(self._send(pixel))

    def _beside(self, pixel: _Pixels) -> _Pixels:
        """Those around some pixels that were taken to see otherwise, on the same side."""
        height, width = self.known.shape
        row, column = (
            one[:, None] + away for one, away in zip(np.divmod(pixel, width), _AROUND, strict=True)
        )
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        other = np.where(inside, row * width + column, pixel[:, None])
        known = self.known.ravel()
        differs = known[other] * known[pixel][:, None] == HIDDEN * SEEN
        return np.unique(other[differs & ~self._asked.ravel()[other]])

    def _send(self, pixel: _Pixels) -> _Pixels:
        """Ask some pixels; those of which something else was known."""
        known, asked = self.known.ravel(), self._asked.ravel()
        sees = np.where(self._ask(pixel), np.int8(SEEN), np.int8(HIDDEN))
        sees *= self._sides.ravel().take(pixel)
        other = known.take(pixel) != sees
        known[pixel] = sees
        asked[pixel] = True
        return pixel[other]
