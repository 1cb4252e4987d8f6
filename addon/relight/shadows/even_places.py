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

# The pixels between others: where they begin, and their neighbours' places on both sides.
BETWEEN = (
    ((0, 1), (((0, -1), (0, 1)),)),
    ((1, 0), (((-1, 0), (1, 0)),)),
    ((1, 1), (((-1, -1), (1, 1)), ((-1, 1), (1, -1)))),
)


def lies_between(place: NDArray[np.float64], hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(H, W) which pixels lie evenly between those of even rows and columns beside them.

    Args:
        place: (3, N) of the pixels that see something, row by row.
        hit: (H, W) which these are.
    """
    height, width = hit.shape
    even = np.zeros(hit.shape, dtype=np.bool_)
    places = place
    if place.shape[1] < hit.size:
        places = np.full((3, hit.size), np.nan)
        places[:, hit.ravel()] = place
    places = places.reshape(3, height, width)

    def work(part: slice) -> None:
        # The next part's first row is a neighbour.
        first, last = 2 * part.start, min(2 * part.stop + 1, height)
        some = places[:, first:last]
        for begin, pairs in BETWEEN:
            own = between(some, begin, (0, 0))
            even_here = np.ones(own.shape[1:], dtype=np.bool_)
            for one, other in pairs:
                a, b = between(some, begin, one), between(some, begin, other)
                off, apart = 2.0 * own - a - b, b - a
                off_sq, apart_sq = (np.einsum("xij,xij->ij", v, v) for v in (off, apart))
                even_here &= off_sq <= (2.0 * _OFF_MIDDLE) ** 2 * apart_sq
            between(even[None, first:last], begin, (0, 0))[0] |= even_here

    in_parts(work, height // 2, _PART)
    return even


def between(picture: NDArray[Any], begin: tuple[int, int], away: tuple[int, int]) -> NDArray[Any]:
    """(C, h, w) of (C, H, W): every other pixel from `begin` on that has neighbours on both sides,
    or what lies so far away from each."""
    chosen = []
    for size, first, step in zip(picture.shape[1:], begin, away, strict=True):
        # Of odd rows or columns the last may have no neighbour.
        count = (size - first) // 2 if first else (size + 1) // 2
        chosen.append(slice(first + step, first + step + 2 * count - 1 if count else 0, 2))
    return picture[:, chosen[0], chosen[1]]
