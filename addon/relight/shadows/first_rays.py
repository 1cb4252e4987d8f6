# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays of a view's first picture, made in float32 as embree takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts
from ..lights.plain_reach import PlainReach
from .receivers import SeenReceivers
from .shadow_rays import ShadowRays
from .vectors import dot

# Rays at once: they stay in the processor's nearest cache, and embree gets as many as it takes.
_PART = 1 << 12

# Pixels at once.
_PIXELS = 1 << 13


class FirstRays:
    """Rays from the pixels of one sample of a view to a light's only point.

    Attributes:
        count: how many were sent.
        sides: (H, W) the side that the point may light: 1 the viewer's, -1 the other; 0 for none.

    Args:
        shadow_rays: what stops them.
        reach: of the point.
        seen: the sample of the view.
        short: the share of its length by which a ray ends before the point.
    """

    def __init__(
        self, shadow_rays: ShadowRays, reach: PlainReach, seen: SeenReceivers, short: float
    ) -> None:
        self._rays, self._reach, self._seen, self._short = shadow_rays, reach, seen, short
        self.count = 0
        self.sides = self._lit_sides()

    def _lit_sides(self) -> NDArray[np.int8]:
        start, normal = self._seen.starts, self._seen.shaded
        hit = self._seen.hit.ravel()
        through = self._seen.surface.layout.has("HAS_TRANSLUCENT")
        sides = np.zeros(hit.shape, dtype=np.int8)

        def work(part: slice) -> None:
            way = self._reach.way(start[:, part])
            cosine = dot(normal[:, part], way)
            shines = self._reach.shines(way) & hit[part]
            sides[part] = (cosine > 0.0) & shines
            if through:
                sides[part] -= (cosine < 0.0) & shines

        in_parts(work, len(sides), _PIXELS)
        return sides.reshape(self._seen.hit.shape)

    def reach(self, pixel: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(R,) whether rays of some pixels (R,) meet nothing."""
        start = self._starts(pixel)
        is_open = np.empty(len(pixel), dtype=np.bool_)

        def work(part: slice) -> None:
            way = self._reach.way(start[:, part])
            length = np.sqrt(dot(way, way))
            limit = length * np.float32(1.0 - self._short)
            if self._reach.light.type == "SUN":
                limit[:] = np.inf
            is_open[part] = ~self._rays.blocked(start[:, part].T, (way / length).T, limit)

        in_parts(work, len(pixel), _PART)
        self._seen.close_buried(self._rays, self._seen.number.ravel().take(pixel), is_open)
        self.count += len(pixel)
        return is_open

    def _starts(self, pixel: NDArray[np.int64]) -> NDArray[np.float32]:
        """(3, R) where rays of some pixels start."""
        seen, smooth, receivers = self._seen, self._seen.smooth, self._seen.receivers
        number, side = seen.number.ravel().take(pixel), self.sides.ravel().take(pixel)
        start = np.empty((3, len(pixel)), dtype=np.float32)
        is_near = np.zeros(len(pixel), dtype=np.bool_)

        def work(part: slice) -> None:
            of, lit = number[part], side[part]
            own, facing = seen.starts.take(pixel[part], axis=1), receivers.normal.take(of, axis=1)
            behind = np.flatnonzero(lit < 0)
            own[:, behind] -= 2.0 * receivers.lift.take(of[behind]) * facing[:, behind]
            start[:, part] = own
            if not smooth.any:
                return
            way, shaded = self._reach.way(own), smooth.normal.take(of, axis=1)
            least = np.minimum(lit * dot(facing, way), lit * dot(shaded, way))
            is_near[part] = least < smooth.lifted_below * np.sqrt(dot(way, way))

        in_parts(work, len(pixel), _PART)
        near = np.flatnonzero(is_near)
        if len(near):
            way = self._reach.way(start[:, near].astype(np.float64))
            some, lift = smooth.lift(number[near], way / np.sqrt(dot(way, way)), side[near])
            start[:, near[some]] += lift
        return start
