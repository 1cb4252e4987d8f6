# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels see a plane that their neighbours see too, and how far apart their places on it are.

From there rays may start anywhere in the pixel, not only from the place that was rasterized.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ...camplace.parallel import in_parts
from .vectors import dot

if TYPE_CHECKING:
    from .receivers import Receivers

# How much longer than the one before a step may be, over both: near a plane's horizon, where it is
# more, places in between are not where the steps lead. A pixel away they are off by half of this.
_UNEVEN = 0.1

# Of the height at which rays start: so far off a plane may what lies a pixel away be. Where a
# surface bends, what lies `REACH` pixels away is off four times as far.
_OFF_PLANE = 0.25

# How many pixels around are known to be on the plane.
REACH = 2

# Pixels at once, in whole rows: few enough to stay in the processor's cache.
_PART = 1 << 14


def flat_steps(
    receivers: Receivers, hit: NDArray[np.bool_], with_neighbours: int | None = None
) -> NDArray[np.float32]:
    """(2, 3, N) local space: the steps along a plane from each receiver to the next column's place
    and to the next row's; zero unless all in the 3 x 3 pixels around, and those beside these, are
    on its plane.

    Args:
        receivers: N places, of the pixels that see something, row by row.
        hit: (H, W) which these are.
        with_neighbours: below which row those beside a pixel are its neighbours; None for all.
    """
    hit = hit[:with_neighbours]
    height, width = hit.shape
    steps = np.zeros((2, 3, receivers.place.shape[1]), dtype=np.float32)
    if min(hit.shape) < 3:
        return steps
    # Of the rows before each one.
    before = np.concatenate([[0], np.cumsum(np.count_nonzero(hit, axis=1))])

    def work(rows: slice) -> None:
        first, last = max(rows.start - REACH, 0), min(rows.stop + REACH, height)
        found = _steps(receivers, slice(before[first], before[last]), hit[first:last])
        own = found[:, :, rows.start - first : rows.stop - first]
        steps[:, :, before[rows.start] : before[rows.stop]] = own[..., hit[rows]]

    in_parts(work, height, max(_PART // width, 2 * REACH))
    return steps


def _steps(receivers: Receivers, some: slice, hit: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2, 3, H, W) the same of whole rows, of which some receivers are hit (H, W); zero also in the
    first and the last `REACH` rows and columns."""
    # NaN is on nobody's plane.
    place, normal = (np.full((3, *hit.shape), np.nan) for _ in range(2))
    lift = np.zeros(hit.shape, dtype=np.float32)
    place[:, hit] = receivers.place[:, some]
    normal[:, hit] = receivers.normal[:, some]
    lift[hit] = receivers.lift[some]
    flat = np.ones(hit.shape, dtype=np.bool_)
    along = np.zeros((2, *place.shape))
    for step, axis in zip(along, (1, 0), strict=True):
        first, last = _part(axis, slice(None, -1)), _part(axis, slice(1, None))
        middle = _part(axis, slice(1, -1))
        apart = place[:, *last] - place[:, *first]
        on_plane = np.abs(dot(normal[:, *first], apart)) <= _OFF_PLANE * lift[first]
        on_plane &= np.abs(dot(normal[:, *last], apart)) <= _OFF_PLANE * lift[last]
        both = apart[:, *last] + apart[:, *first]
        more = apart[:, *last] - apart[:, *first]
        even = dot(more, more) <= _UNEVEN**2 * dot(both, both)
        # The first and the last have nobody on one side.
        here = np.zeros(hit.shape, dtype=np.bool_)
        here[middle] = on_plane[last] & on_plane[first] & even
        flat &= here
        step[:, *middle] = 0.5 * both
    flat = ndimage.binary_erosion(flat, np.ones((3, 3), dtype=np.bool_))
    return np.where(flat, along, 0.0)


def _part(axis: int, chosen: slice) -> tuple[slice, slice]:
    """Of (H, W): some along an axis."""
    return (chosen, slice(None)) if axis == 0 else (slice(None), chosen)
