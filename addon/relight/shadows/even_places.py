# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels lie evenly between others on one surface, so that these may speak for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts

# How far from the middle of two places one between them may lie, over their distance: half of it
# where one of them is on another surface.
_OFF_MIDDLE = 0.2

# Pairs of rows at once.
_PART = 24

# Every so many rows and columns a pixel speaks for others; then every half as many, down to two.
COARSEST = 4

# The pixels between others: where they begin, and their neighbours' places on both sides.
BETWEEN = (
    ((0, 1), (((0, -1), (0, 1)),)),
    ((1, 0), (((-1, 0), (1, 0)),)),
    ((1, 1), (((-1, -1), (1, 1)), ((-1, 1), (1, -1)))),
)


def lies_between(place: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(H, W) which pixels of odd rows or columns lie evenly between those of even ones beside them;
    of even rows and columns, which do among themselves, as far as `COARSEST` goes.

    Args:
        place: (3, H, W) what the pixels see, not numbers where that is nothing.
    """
    even = np.zeros(place.shape[1:], dtype=np.bool_)
    step = 1
    while step < COARSEST:
        place = _mark(place, even[::step, ::step])
        step *= 2
    return even


def _mark(place: NDArray[np.floating], even: NDArray[np.bool_]) -> NDArray[np.floating]:
    """Mark which of odd rows or columns do; the places (3, h, w) of even ones."""
    # Side by side: numpy works on these several times faster.
    grid = np.ascontiguousarray(place[:, ::2, ::2])

    def work(part: slice) -> None:
        around = grid[:, part.start : part.stop + 1]
        for begin, pairs in BETWEEN:
            # The next part's first row is a neighbour of odd ones, and no more.
            rows = slice(2 * part.start, 2 * part.stop + begin[0])
            own, marked = place[:, rows], even[rows]
            middle = np.ascontiguousarray(between(own, begin, (0, 0)))
            height, width = middle.shape[1:]
            even_here = np.ones((height, width), dtype=np.bool_)
            for pair in pairs:
                a, b = (
                    around[:, y : y + height, x : x + width]
                    for y, x in (np.add(begin, away) // 2 for away in pair)
                )
                off, apart = 2.0 * middle - a - b, b - a
                off_sq, apart_sq = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] for v in (off, apart))
                even_here &= off_sq <= (2.0 * _OFF_MIDDLE) ** 2 * apart_sq
            between(marked[None], begin, (0, 0))[0] |= even_here

    in_parts(work, (place.shape[1] + 1) // 2, _PART)
    return grid


def between(picture: NDArray[Any], begin: tuple[int, int], away: tuple[int, int]) -> NDArray[Any]:
    """(C, h, w) of (C, H, W): every other pixel from `begin` on that has neighbours on both sides,
    or what lies so far away from each."""
    chosen = []
    for size, first, step in zip(picture.shape[1:], begin, away, strict=True):
        # Of odd rows or columns the last may have no neighbour.
        count = (size - first) // 2 if first else (size + 1) // 2
        chosen.append(slice(first + step, first + step + 2 * count - 1 if count else 0, 2))
    return picture[:, chosen[0], chosen[1]]
