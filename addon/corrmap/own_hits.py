# SPDX-License-Identifier: GPL-3.0-or-later
"""What visibility samples hit of shading samples that serve a single pixel, or of which no cell's
middle sees the surface.

Sample k of the lights is shaded at one of these places, so that none of them is shaded elsewhere
than where a pixel sees it, however little of the pixel its surface takes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_DEFINES, row_texture
from ..glsl.shader import Samplers, Texture, texture_from_array

OWN_HIT_SAMPLERS: Samplers = (
    ("hit_range", "FLOAT_2D"),
    ("hit_position", "FLOAT_2D"),
    ("hit_normal", "FLOAT_2D"),
    ("hit_triangle", "FLOAT_2D"),
)
OWN_HIT_DEFINES = (("HAS_OWN_HITS", "1"), *ROW_DEFINES)

# For messages.
_HITS = "pixels' hits"


@dataclass(frozen=True)
class OwnHits:
    """Hits, one sample's after another's, in the order of the visibility samples.

    Attributes:
        sample: (K,) int64, ascending: of which shading sample each is.
        position: (K, 4) float32, as `VisibleSurface.position`.
        normal: (K, 3) float32, as `VisibleSurface.normal`.
        triangle: (K, 2) float32, as `VisibleSurface.triangles`.
    """

    sample: NDArray[np.int64]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    triangle: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.sample)

    def some(self, chosen: NDArray[np.bool_]) -> OwnHits:
        """Those that are chosen (K,)."""
        return OwnHits(
            self.sample[chosen], self.position[chosen], self.normal[chosen], self.triangle[chosen]
        )

    def textures(self, width: int, height: int) -> dict[str, Texture]:
        """By the names in `OWN_HIT_SAMPLERS`; `hit_range` is as large as the samples' atlas, and
        has of each the first hit's number and how many there are."""
        count = np.bincount(self.sample, minlength=width * height)
        first = np.cumsum(count) - count
        ranges = np.stack([first, count], axis=1).astype(np.float32)
        normal = np.pad(self.normal, ((0, 0), (0, 1)))
        return {
            "hit_range": texture_from_array(ranges.reshape(height, width, 2), "RG32F"),
            "hit_position": row_texture(self.position, "RGBA32F", _HITS),
            "hit_normal": row_texture(normal, "RGBA32F", _HITS),
            "hit_triangle": row_texture(self.triangle, "RG32F", _HITS),
        }


class OwnHitsBuilder:
    """Takes hits as they come.

    When there are too many, those of the samples that are hit most are let go, and no more of these
    are taken: what visibility samples hit often, one of each group of them hits, and there it is
    shaded then (`shading_samples`).

    Args:
        most: how many are kept.
    """

    def __init__(self, most: int = 1 << 22) -> None:
        self._most = most
        self._kept = 0
        # Of each sample, how often it was hit, and whether its hits are let go.
        self._count = np.zeros(0, dtype=np.int64)
        self._is_let_go = np.zeros(0, dtype=np.bool_)
        self._parts = [
            OwnHits(
                np.zeros(0, dtype=np.int64),
                *(np.zeros((0, size), dtype=np.float32) for size in (4, 3, 2)),
            )
        ]

    def add(self, hits: OwnHits) -> None:
        """Take those of one visibility sample."""
        if not len(hits):
            return
        more = int(hits.sample.max()) + 1 - len(self._count)
        if more > 0:
            self._count = np.pad(self._count, (0, more))
            self._is_let_go = np.pad(self._is_let_go, (0, more))
        hits = hits.some(~self._is_let_go[hits.sample])
        self._count += np.bincount(hits.sample, minlength=len(self._count))
        self._parts.append(hits)
        self._kept += len(hits)
        if self._kept > self._most:
            self._let_go()

    def finish(self) -> OwnHits:
        """All that are kept."""
        sample, *values = (
            np.concatenate([getattr(part, name) for part in self._parts])
            for name in ("sample", "position", "normal", "triangle")
        )
        order = np.argsort(sample, kind="stable")
        return OwnHits(sample[order], *(value[order] for value in values))

    def _let_go(self) -> None:
        """Let hits of the most hit samples go, until there is room for as many again."""
        count = np.where(self._is_let_go, 0, self._count)
        of_count = np.bincount(count)
        total = np.cumsum(of_count * np.arange(len(of_count)))
        kept = int(np.searchsorted(total, self._most // 2, "right")) - 1
        self._is_let_go |= count > kept
        self._parts = [part.some(~self._is_let_go[part.sample]) for part in self._parts]
        self._kept = sum(len(part) for part in self._parts)
