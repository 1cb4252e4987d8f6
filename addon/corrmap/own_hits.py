# SPDX-License-Identifier: GPL-3.0-or-later
"""What visibility samples hit of shading samples that serve a single pixel, or of which no cell's
middle sees the surface.

Sample k of the lights is shaded at one of these places, so that none of them is shaded elsewhere
than where a pixel sees it, however little of the pixel its surface takes. Of large pictures of many
samples not all are kept, but those of the first visibility samples: the more is seen of a surface,
the more it has of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.row_texture import ROW_DEFINES, ROW_LIBRARY, row_texture
from ..glsl.shader import Samplers, Texture, texture_from_array

OWN_HIT_SAMPLERS: Samplers = (
    ("hit_range", "FLOAT_2D"),
    ("hit_position", "FLOAT_2D"),
    ("hit_normal", "FLOAT_2D"),
    ("hit_triangle", "FLOAT_2D"),
)
OWN_HIT_LIBRARY = ROW_LIBRARY
OWN_HIT_DEFINES = (("HAS_OWN_HITS", "1"), *ROW_DEFINES)

# More than any number of visibility samples, as GLSL holds it.
ALL_LOOKS = (1 << 31) - 1

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
        looks: of so many visibility samples all are here.
    """

    sample: NDArray[np.int64]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    triangle: NDArray[np.float32]
    looks: int = ALL_LOOKS

    def __len__(self) -> int:
        return len(self.sample)

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

    Args:
        most: how many there may be. Those of the visibility sample that goes beyond, and of all
            that follow, are not taken.
    """

    def __init__(self, most: int = 1 << 22) -> None:
        self._most = most
        self._count = 0
        self._looks = ALL_LOOKS
        nothing = np.zeros((0, 4), dtype=np.float32)
        self._parts = [
            OwnHits(np.zeros(0, dtype=np.int64), nothing, nothing[:, :3], nothing[:, :2])
        ]

    def add(self, hits: OwnHits, look: int) -> None:
        """Take some of a visibility sample, whose number is not below that of the last."""
        if self._count + len(hits) > self._most:
            self._looks = min(self._looks, look)
        if look < self._looks:
            self._count += len(hits)
            self._parts.append(hits)

    def finish(self) -> OwnHits:
        """All that were taken."""
        sample = np.concatenate([part.sample for part in self._parts])
        order = np.argsort(sample, kind="stable")
        position, normal, triangle = (
            np.concatenate([getattr(part, name) for part in self._parts])[order]
            for name in ("position", "normal", "triangle")
        )
        return OwnHits(sample[order], position, normal, triangle, self._looks)
