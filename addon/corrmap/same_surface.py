# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether one shading sample serves two places that the view sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Facets that meet at more than this (8 degrees) are edges: their light may differ by a seventh.
MOST_BEND = 0.14
SAME_BEND = float(np.sqrt(1.0 - MOST_BEND**2))

# Places come out of the rasterizer with some float32 spacings of their distance from the viewer.
PLACE_SPACING = 8.0 * float(np.finfo(np.float32).eps)

SAME_SURFACE_DEFINES = (
    ("MOST_BEND", repr(MOST_BEND)),
    ("SAME_BEND", repr(SAME_BEND)),
    ("PLACE_SPACING", f"{PLACE_SPACING:.9e}"),
)


def same_surface(
    p: NDArray[np.floating],
    n: NDArray[np.floating],
    q: NDArray[np.floating],
    m: NDArray[np.floating],
) -> NDArray[np.bool_]:
    """(...,) as same_surface.glsl.

    Two places are on one surface if their material is the same, their facets bend by less than
    `MOST_BEND`, and each lies in the other's plane as far as such a bend allows. All is relative to
    how far they are apart, so that it holds for any size of scene, and at grazing angles too.

    Args:
        p: (..., 4): local position in metres, and 1 + material id, or 0 for nothing.
        n: (..., 3): unit geometric normal there.
        q: (..., 4): the same of another place.
        m: (..., 3): its normal.
    """
    apart = q[..., :3] - p[..., :3]
    size = np.linalg.norm(p[..., :3], axis=-1) + np.linalg.norm(q[..., :3], axis=-1)
    reach = MOST_BEND * np.linalg.norm(apart, axis=-1) + PLACE_SPACING * size
    flat = np.abs(np.sum(n * apart, axis=-1)) <= reach
    flat &= np.abs(np.sum(m * apart, axis=-1)) <= reach
    flat &= np.sum(n * m, axis=-1) >= SAME_BEND
    return np.asarray((p[..., 3] == q[..., 3]) & (flat | (p[..., 3] == 0.0)))
