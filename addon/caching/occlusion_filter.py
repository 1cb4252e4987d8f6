# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooths baked ambient occlusion along surfaces, so that few rays a texel are enough.

An edge-avoiding à-trous wavelet filter (Dammertz, Sewtz, Hanika, Lensch 2010: "Edge-Avoiding
À-Trous Wavelet Transform for fast Global Illumination Filtering"): a B3 spline whose taps move
apart by two from level to level. Each tap is weighted by how well its surface continues the
texel's own, and by how much of what their values differ by may be noise (as the luminance is in
Schied et al. 2017, "Spatiotemporal Variance-Guided Filtering"; here rays are counted, so the noise
is known). A shadow on a wall keeps its edge, and what little light reaches has the rays of more
texels. It runs along rows and columns in turn, which is exact where nothing is weighted away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ..camplace.camera import CachingCamera

# B3 spline: weight of the texel itself, and of its neighbours at one and two steps.
_SPLINE = (6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0)

# Texels. The standard deviation of all of them is sqrt(1 + 4 + 16 + 64 + 256) = 18.5 texels.
_STEPS = (1, 2, 4, 8, 16)

# The largest distance, in texels, from which a value comes.
REACH = (len(_SPLINE) - 1) * sum(_STEPS)

# A tap counts for nothing when its value is more than five standard errors off. Two with rays of
# their own that are equal but for their noise are more than that apart in one of 2500 pairs.
_ERRORS = 5.0

# A tap counts for nothing when it is seen from the texel more than 15 degrees off its plane, or
# has a normal that differs by more than 25 degrees: less than any edge that looks like one,
# more than a smooth surface turns within the filter.
_OFF_PLANE = float(np.sin(np.radians(15.0)))
_NORMALS_AGREE = float(np.cos(np.radians(25.0)))

# All rays of a texel are blocked by chance so seldom where it is told by its neighbours that they
# began on an edge: with four rays where 0.8 are open, with eight where 0.55.
_BY_CHANCE = 1.0 / 600.0

# Rows and columns from a texel to its eight neighbours.
_AROUND = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


def smooth_occlusion(
    camera: CachingCamera,
    occlusion: NDArray[np.float32],
    depth: NDArray[np.float32],
    normal: NDArray[np.float32],
    rays: int,
) -> NDArray[np.float32]:
    """Mean of the open share of neighbouring texels on the same surface.

    Args:
        camera: that sees them, with resolution R.
        occlusion: (R, R, 1) the channel as rendered, in [0, 1].
        depth: (R, R, 1) metres along the view axis, 0 where nothing is hit.
        normal: (R, R, 3) world space, unit length where something is hit.
        rays: from each texel, whose open share `occlusion` is.

    Returns:
        (R, R, 1) float32 in [0, 1]; unchanged where nothing is hit.
    """
    place = _places(camera, depth[..., 0])
    facing = _facing(camera, normal)
    hit = depth[..., 0] > 0.0
    values = np.ascontiguousarray(occlusion[..., 0])
    # How much of the filter so far lies on a texel's own surface.
    kept = np.ones_like(values)
    variance = 0.0
    for step in _STEPS:
        # The rays of each value, as under a Gaussian of this variance; a texel's own at the least.
        count = np.maximum(np.float32(4.0 * np.pi * variance) * kept, np.float32(1.0)) * rays
        for axis in (0, 1):
            values, share = _blur(
                values, place, facing, hit, step, axis, None if variance == 0.0 else count
            )
            kept *= share
        variance += step * step
    return values[..., None]


def without_edge_hits(
    camera: CachingCamera,
    occlusion: NDArray[np.float32],
    depth: NDArray[np.float32],
    normal: NDArray[np.float32],
    rays: int,
) -> NDArray[np.float32]:
    """What Cycles' Ambient Occlusion node gives on the edge between two triangles, put right.

    It keeps a ray from the triangle that it starts on, but not from that one's neighbour: all of
    its rays count as blocked, and the texels along an edge would be a dark line. They are told by
    an open share of exactly 0 beside texels of the same surface that are nearly open, and get their
    mean.

    Args:
        camera: that sees them, with resolution R.
        occlusion: (R, R, 1) of the node.
        depth: (R, R, 1) metres, 0 where nothing is hit.
        normal: (R, R, 3) world space, unit length where something is hit.
        rays: from each texel, four or more, whose open share `occlusion` is.

    Returns:
        (R, R, 1) float32.
    """
    values, hit = occlusion[..., 0], depth[..., 0] > 0.0
    is_open = hit & (values > 0.0)
    open_enough = np.float32(1.0 - _BY_CHANCE ** (1.0 / rays))
    nearly = hit & (values >= open_enough)
    row, column = np.nonzero(hit & ~is_open & maximum_filter(nearly, 3))
    place, facing = _places(camera, depth[..., 0]), _facing(camera, normal)
    total, count = np.zeros((2, len(row)), dtype=np.float32)
    for down, right in _AROUND:
        r, c = row + down, column + right
        inside = (r >= 0) & (r < len(values)) & (c >= 0) & (c < len(values))
        r, c = np.where(inside, r, 0), np.where(inside, c, 0)
        same = _continues(
            (place[:, row, column] - place[:, r, c])[:, None],
            facing[:, row, column][:, None],
            facing[:, r, c][:, None],
        )[0]
        counts = inside & is_open[r, c] & (same > 0.0)
        total += counts * values[r, c]
        count += counts
    wrong = (count > 1.0) & (total >= open_enough * count)
    result = values.copy()
    result[row[wrong], column[wrong]] = total[wrong] / count[wrong]
    return result[..., None]


def _places(camera: CachingCamera, depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """(3, R, R) camera-space positions, metres."""
    size = camera.resolution
    centre = ((np.arange(size) + 0.5) / size * 2.0 - 1.0) * camera.half_extent
    along = centre.astype(np.float32)
    return np.stack([along[None, :] * depth, along[:, None] * depth, -depth])


def _facing(camera: CachingCamera, normal: NDArray[np.float32]) -> NDArray[np.float32]:
    """(3, R, R) camera-space normals."""
    rotation = camera.world_from_camera[:3, :3].astype(np.float32)
    return np.ascontiguousarray(np.moveaxis(normal @ rotation, -1, 0))


def _blur(  # noqa: PLR0917 - one pass's arrays, in the order of `smooth_occlusion`
    values: NDArray[np.float32],
    place: NDArray[np.float32],
    facing: NDArray[np.float32],
    hit: NDArray[np.bool_],
    step: int,
    axis: int,
    rays: NDArray[np.float32] | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """One pass along rows (axis 1) or columns (axis 0), with taps `step` texels apart.

    `rays` are those of each value, by which its noise is known; None lets all values count. Gives
    the values' means, and the share of the taps' weights that lies on one surface.
    """
    total = _SPLINE[0] * values
    weight = np.full_like(values, _SPLINE[0])
    share = weight.copy()
    for count, spline in enumerate(_SPLINE[1:], start=1):
        if count * step >= values.shape[axis]:
            continue
        ahead: list[slice] = [slice(None), slice(None)]
        behind: list[slice] = [slice(None), slice(None)]
        ahead[axis], behind[axis] = slice(count * step, None), slice(None, -count * step)
        a, b = tuple(ahead), tuple(behind)
        # The same for both texels of a pair, so each pair is looked at once.
        same = spline * _continues(place[:, *a] - place[:, *b], facing[:, *a], facing[:, *b])
        same *= hit[a] & hit[b]
        share[a] += same
        share[b] += same
        if rays is not None:
            same *= _agree(values[a], values[b], np.minimum(rays[a], rays[b]))
        total[a] += same * values[b]
        total[b] += same * values[a]
        weight[a] += same
        weight[b] += same
    return total / weight, share


def _agree(
    a: NDArray[np.float32], b: NDArray[np.float32], rays: NDArray[np.float32]
) -> NDArray[np.float32]:
    """How far two open shares may be one, by their rays' noise: 1 if they are equal."""
    # Of none or all rays the noise is that of half a ray, not zero.
    least = np.float32(0.5) / rays
    mean = np.clip(np.float32(0.5) * (a + b), least, np.float32(1.0) - least)
    # The square of a standard error is that of the binomial distribution.
    apart = (a - b) ** 2 * rays / np.float32(_ERRORS**2)
    return np.maximum(np.float32(1.0) - apart / (mean * (1.0 - mean)), np.float32(0.0))


def _continues(
    apart: NDArray[np.float32], normal_a: NDArray[np.float32], normal_b: NDArray[np.float32]
) -> NDArray[np.float32]:
    """How far two texels lie on one smooth surface: 1 on a plane, 0 over an edge."""
    square = np.einsum("ijk,ijk->jk", apart, apart)
    height = np.maximum(
        np.abs(np.einsum("ijk,ijk->jk", apart, normal_a)),
        np.abs(np.einsum("ijk,ijk->jk", apart, normal_b)),
    )
    # Two texels that are hit are never at one place; those that are not may divide by zero.
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = 1.0 - height * height / (square * np.float32(_OFF_PLANE**2))
    turned = np.einsum("ijk,ijk->jk", normal_a, normal_b)
    level = (turned - np.float32(_NORMALS_AGREE)) / np.float32(1.0 - _NORMALS_AGREE)
    return np.nan_to_num(np.clip(flat, 0.0, 1.0)) * np.clip(level, 0.0, 1.0)
