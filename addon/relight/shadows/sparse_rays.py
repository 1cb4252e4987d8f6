# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows of a light's point with a ray for every fourth pixel, and all where it may matter.

The pixels of even rows and columns have a ray each. One between two of them (in odd rows and
columns, four) that found the same, on one even surface, is taken to see the same; every other pixel
has a ray of its own. So edges of shadows are where they are, to the pixel; what is lost is a shadow
or a gap that lies between the rays, narrower than two pixels.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .even_places import BETWEEN, between
from .lit_pixels import LitPixels


def look_sparsely(
    ask: Callable[[NDArray[np.int64]], NDArray[np.bool_]],
    lit: LitPixels,
    even: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """(N,) whether N pixels see a light's point.

    Args:
        ask: sends rays of some (R,) of them; whether each meets nothing.
        lit: the pixels.
        even: (H, W) as `lies_between`, of the whole layer.
    """
    sides = np.zeros(lit.size, dtype=np.int8)
    sides.ravel()[lit.pixel] = lit.side
    # 0: not known; 1: hidden; 2: seen; negative where the other side is lit.
    known = np.zeros(lit.size, dtype=np.int8)
    grid = np.zeros(lit.size, dtype=np.bool_)
    grid[::2, ::2] = True

    def trace(some: NDArray[np.int64]) -> None:
        sign = lit.side[some].astype(np.int8)
        known.ravel()[lit.pixel[some]] = sign * (1 + ask(some))

    trace(np.flatnonzero(grid.ravel().take(lit.pixel)))
    for begin, pairs in BETWEEN:
        around = [between(known[None], begin, at)[0] for pair in pairs for at in pair]
        same = between(even[None], begin, (0, 0))[0] & (around[0] != 0)
        same &= np.sign(around[0]) == between(sides[None], begin, (0, 0))[0]
        for other in around[1:]:
            same &= other == around[0]
        np.copyto(between(known[None], begin, (0, 0))[0], around[0], where=same)
    trace(np.flatnonzero(known.ravel().take(lit.pixel) == 0))
    return np.asarray(np.abs(known.ravel().take(lit.pixel)) == 2)
