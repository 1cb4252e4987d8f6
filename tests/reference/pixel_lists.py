# SPDX-License-Identifier: GPL-3.0-or-later
"""The indirect framebuffer in plain numpy, float64: which shading samples a pixel is made of.

Written from the docstrings of `addon/corrmap/pixel_lists.py`, one hit after another.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# Facets that bend by more are edges (sine of the angle).
MOST_BEND = 0.14
_SPACINGS = 8.0 * 2.0**-23


def same_surface(
    p: NDArray[np.float64],
    n: NDArray[np.float64],
    q: NDArray[np.float64],
    m: NDArray[np.float64],
) -> bool:
    """Whether two hits, place with 1 + material (4,) and normal (3,), are on one surface."""
    if p[3] == 0.0 or q[3] == 0.0:
        return bool(p[3] == q[3])
    apart = q[:3] - p[:3]
    rounding = _SPACINGS * (np.linalg.norm(p[:3]) + np.linalg.norm(q[:3]))
    reach = MOST_BEND * np.linalg.norm(apart) + rounding
    bends = n @ m < np.sqrt(1.0 - MOST_BEND**2)
    return bool(p[3] == q[3] and not bends and max(abs(n @ apart), abs(m @ apart)) <= reach)


@dataclass
class Lists:
    """What `make_lists` finds.

    Attributes:
        weights: for each pixel (row, column) the weight of each shading sample by its number.
        places: of each shading sample.
        normals: likewise.
        cells: likewise: (row, column).
    """

    weights: dict[tuple[int, int], dict[int, float]] = field(default_factory=dict)
    places: list[NDArray[np.float64]] = field(default_factory=list)
    normals: list[NDArray[np.float64]] = field(default_factory=list)
    cells: list[tuple[int, int]] = field(default_factory=list)

    def resolve(self, shaded: NDArray[np.float64], height: int, width: int) -> NDArray[np.float64]:
        """(H, W, C) pixels from (S, C) shaded samples."""
        pixels = np.zeros((height, width, shaded.shape[1]))
        for (row, column), weights in self.weights.items():
            for sample, weight in weights.items():
                pixels[row, column] += weight * shaded[sample]
        return pixels


def make_lists(
    position: NDArray[np.float64],
    normal: NDArray[np.float64],
    offsets: Sequence[tuple[float, float]],
) -> Lists:
    """The lists of (V, H, W, 4) places and (V, H, W, 3) normals, of V visibility samples.

    The first is that of the pixels' centres.
    """
    count, height, width, _ = position.shape
    pixels = [(row, column) for row in range(height) for column in range(width)]
    lists = Lists()
    chains: dict[tuple[int, int], list[int]] = {}
    for pixel in pixels:
        chains[pixel] = [len(lists.places)]
        lists.places.append(position[0][pixel])
        lists.normals.append(normal[0][pixel])
        lists.cells.append(pixel)
    times: dict[tuple[int, int], Counter[int]] = {pixel: Counter() for pixel in pixels}
    for k in range(count):
        fresh: list[tuple[tuple[int, int], tuple[int, int]]] = []
        for pixel in pixels:
            p, n = position[k][pixel], normal[k][pixel]
            own = pixel[0] * width + pixel[1]
            if same_surface(lists.places[own], lists.normals[own], p, n):
                times[pixel][own] += 1
                continue
            cell = (
                int(np.clip(np.floor(pixel[0] + 0.5 + offsets[k][1]), 0, height - 1)),
                int(np.clip(np.floor(pixel[1] + 0.5 + offsets[k][0]), 0, width - 1)),
            )
            serving = [
                sample
                for sample in chains[cell]
                if same_surface(lists.places[sample], lists.normals[sample], p, n)
            ]
            if serving:
                times[pixel][serving[0]] += 1
            else:
                fresh.append((cell, pixel))
        # New samples are numbered by their cells; another hit of the cell may find one of them.
        for cell, pixel in sorted(fresh):
            p, n = position[k][pixel], normal[k][pixel]
            serving = [
                sample
                for sample in chains[cell]
                if same_surface(lists.places[sample], lists.normals[sample], p, n)
            ]
            if not serving:
                serving = [len(lists.places)]
                chains[cell].append(serving[0])
                lists.places.append(p)
                lists.normals.append(n)
                lists.cells.append(cell)
            times[pixel][serving[0]] += 1
    lists.weights = {
        pixel: {sample: number / count for sample, number in counter.items()}
        for pixel, counter in times.items()
    }
    return lists
