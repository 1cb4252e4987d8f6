# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels see a plane that their neighbours see too, and how far apart their places on it are.

From there rays may start anywhere in the pixel, not only from the place that was rasterized.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .smooth_height import dot

if TYPE_CHECKING:
    from .receivers import Receivers

# How much longer than the one before a step may be, over both: near a plane's horizon, where it is
# more, places in between are not where the steps lead. A pixel away they are off by half of this.
_UNEVEN = 0.1


def flat_steps(
    receivers: Receivers, hit: NDArray[np.bool_], with_neighbours: int | None = None
) -> NDArray[np.float32]:
    """(2, 3, N) local space: the steps along a plane from each receiver to the next column's place
    and to the next row's; zero unless all in the 3 x 3 pixels around, and those beside these, are
    on its plane. That is a pixel more than what samples of a pixel reach.

    Args:
        receivers: N places, of the pixels that see something, row by row.
        hit: (H, W) which these are.
        with_neighbours: below which row those beside a pixel are its neighbours; None for all.
    """
    hit = hit[:with_neighbours]
    count = int(np.count_nonzero(hit))
    steps = np.zeros((2, 3, receivers.place.shape[1]), dtype=np.float32)
    if min(hit.shape) < 3 or not count:
        return steps
    # NaN is on nobody's plane.
    place, normal = (np.full((3, *hit.shape), np.nan) for _ in range(2))
    lift = np.zeros(hit.shape, dtype=np.float32)
    place[:, hit] = receivers.place[:, :count]
    normal[:, hit] = receivers.normal[:, :count]
    lift[hit] = receivers.lift[:count]
    flat = np.ones(hit.shape, dtype=np.bool_)
    along = np.zeros((2, *place.shape))
    for step, axis in zip(along, (1, 0), strict=True):
        first, last = _part(axis, slice(None, -1)), _part(axis, slice(1, None))
        middle = _part(axis, slice(1, -1))
        apart = place[:, *last] - place[:, *first]
        on_plane = np.abs(dot(normal[:, *first], apart)) <= lift[first]
        on_plane &= np.abs(dot(normal[:, *last], apart)) <= lift[last]
        both = apart[:, *last] + apart[:, *first]
        more = apart[:, *last] - apart[:, *first]
        even = dot(more, more) <= _UNEVEN**2 * dot(both, both)
        # The first and the last have nobody on one side.
        here = np.zeros(hit.shape, dtype=np.bool_)
        here[middle] = on_plane[last] & on_plane[first] & even
        flat &= here
        step[:, *middle] = 0.5 * both
    flat = ndimage.binary_erosion(flat, np.ones((3, 3), dtype=np.bool_))
    steps[:, :, :count] = np.where(flat, along, 0.0)[..., hit]
    return steps


def _part(axis: int, chosen: slice) -> tuple[slice, slice]:
    """Of (H, W): some along an axis."""
    return (chosen, slice(None)) if axis == 0 else (slice(None), chosen)
