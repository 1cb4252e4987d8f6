# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels of a reference lie at an edge.

One texel cannot hold what two surfaces share in a pixel, so errors at surface boundaries are
of another kind than errors inside surfaces (Kim, Kyung and Lee 2009, section IV), and both
are reported. With the reference's depth and objects at the pixel centres, edges are the
boundaries of surfaces and their creases; shadows' edges and textures' are then *not* edges,
and errors there count in full. Without them, edges are where the reference's own luma
changes quickly, which excuses more: the report says which it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .metrics import LUMA, Mask

# The pixel filter (Blackman-Harris, 1.5 px wide) and the neighbour that a hole is filled
# from reach this far across an edge.
RADIUS = 2
# Least change of slope that is called a crease, as the tangent between the two directions:
# 27 degrees, seen face on.
CREASE = 0.5
# Least step between neighbours' luma, of 1, that is called an edge when there is no geometry:
# twice the smallest that a good display shows next to texture, in 8 bits about 20 levels.
LUMA_STEP = 0.08


def dilate(mask: Mask, radius: int) -> Mask:
    """Every pixel within `radius` (rows and columns alike) of one in the mask."""
    grown = mask
    for axis in (0, 1):
        padding = [(radius, radius) if a == axis else (0, 0) for a in (0, 1)]
        windows = np.lib.stride_tricks.sliding_window_view(
            np.pad(grown, padding), 2 * radius + 1, axis=axis
        )
        grown = windows.any(axis=-1)
    return grown


def _differs(values: NDArray[np.generic]) -> Mask:
    """Pixels whose value is not their right-hand or upper neighbour's, and those neighbours."""
    mask = np.zeros(values.shape, dtype=bool)
    across = values[:, 1:] != values[:, :-1]
    mask[:, 1:] |= across
    mask[:, :-1] |= across
    up = values[1:] != values[:-1]
    mask[1:] |= up
    mask[:-1] |= up
    return mask


def _bends(values: NDArray[np.float64], limit: NDArray[np.float64]) -> Mask:
    """Pixels whose second difference along rows or columns exceeds their limit."""
    mask = np.zeros(values.shape, dtype=bool)
    across = values[:, 2:] - 2.0 * values[:, 1:-1] + values[:, :-2]
    mask[:, 1:-1] |= np.abs(across) > limit[:, 1:-1]
    up = values[2:] - 2.0 * values[1:-1] + values[:-2]
    mask[1:-1] |= np.abs(up) > limit[1:-1]
    return mask


def _creases(depth: NDArray[np.float32], pixel: float, *, perspective: bool) -> Mask:
    """Where the surface folds by more than CREASE.

    Over a plane, 1 / depth is affine in pixels (depth itself, without perspective), so planes
    never fold, however slanted they are seen. A change s of slope (depth over width) bends
    1 / depth by s · pixel / depth, and depth itself by s · pixel.
    """
    metres = np.asarray(depth, dtype=np.float64)
    if not perspective:
        return _bends(metres, np.full(metres.shape, CREASE * pixel))
    inverse = np.divide(1.0, metres, out=np.zeros_like(metres), where=metres > 0.0)
    return _bends(inverse, CREASE * pixel * inverse)


def surface_edges(
    depth: NDArray[np.float32],
    objects: NDArray[np.float32],
    pixel: float,
    *,
    perspective: bool = True,
) -> Mask:
    """Pixels at a surface's boundary or crease.

    Args:
        depth: (H, W) at the pixel centres, along the view axis, metres; 0 for the background.
        objects: (H, W), a number for each object.
        pixel: a pixel's width in metres, at distance 1 m with perspective.
        perspective: False for an orthographic camera.
    """
    found = _differs(depth > 0) | _differs(objects)
    found |= _creases(depth, pixel, perspective=perspective)
    return dilate(found, RADIUS)


def luma_edges(encoded: NDArray[np.floating]) -> Mask:
    """Pixels where a display-encoded (H, W, 3) picture's luma steps; no geometry is needed."""
    luma = np.asarray(encoded, dtype=np.float64) @ LUMA
    found = np.zeros(luma.shape, dtype=bool)
    across = np.abs(np.diff(luma, axis=1)) > LUMA_STEP
    found[:, 1:] |= across
    found[:, :-1] |= across
    up = np.abs(np.diff(luma, axis=0)) > LUMA_STEP
    found[1:] |= up
    found[:-1] |= up
    return dilate(found, RADIUS)
