# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes the suns out of a world's picture: what is small and holds much of its light.

A sun casts shadows with an edge, for which directions drawn from the whole sky would be far too
few. What stands out above its surroundings in a small patch is a light of its own; picture and
patches add up to the whole picture again, texel by texel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .equirect import LUMINANCE, directions, solid_angles

Array = NDArray[np.float64]

# Suns of one world; each costs a shadow map for each sample.
MOST_SUNS = 3
# Peaks that are looked at to find them.
_PEAKS = 8
# Of the world's light, what a patch must hold to be one: about what one of the directions that
# the rest is lit from holds.
LEAST_SHARE = 0.02
# Angular radius of the widest patch, radians: shadows of wider ones have no edge to speak of.
WIDEST = float(np.radians(4.0))
# A patch reaches to where the picture has fallen to this share of its peak.
_FOOT = 0.05


@dataclass(frozen=True)
class SplitWorld:
    """A world's picture in parts.

    Attributes:
        residual: (H, W, 3) float64, without its suns.
        suns: (H, W, 3) float64 each, zero but for a patch; none is negative.
    """

    residual: Array
    suns: tuple[Array, ...]


def split_world(equirect: NDArray[np.float32]) -> SplitWorld:
    """Part (H, W, 3) radiance; its texels are the parts' sums, to float64's rounding."""
    residual = equirect.astype(np.float64)
    height, width, _ = residual.shape
    weight = solid_angles(height, width)
    toward = directions(height, width)
    luminance = np.maximum(residual @ LUMINANCE, 0.0)
    total = float((luminance * weight).sum())
    suns: list[Array] = []
    refused = np.zeros((height, width), dtype=np.bool_)
    for _ in range(_PEAKS):
        open_luminance = np.where(refused, 0.0, luminance)
        peak = float(open_luminance.max())
        if peak <= 0.0 or len(suns) == MOST_SUNS:
            break
        place = np.unravel_index(int(np.argmax(open_luminance)), (height, width))
        near = toward @ toward[place] > np.cos(2.0 * WIDEST)
        patch = _connected((luminance > _FOOT * peak) & near, place)
        refused |= patch
        wide = float(np.arccos(np.clip((toward[patch] @ toward[place]).min(), -1.0, 1.0)))
        # A texel is as wide as the picture is coarse.
        if wide + np.pi / height > WIDEST:
            continue
        around = ndimage.binary_dilation(_wrapped(patch), iterations=2)[:, width:-width] & ~patch
        if not around.any():
            continue
        level = np.median(residual[around], axis=0)
        sun = np.where(patch[..., None], np.maximum(residual - level, 0.0), 0.0)
        if float(((sun @ LUMINANCE) * weight).sum()) < LEAST_SHARE * total:
            continue
        suns.append(sun)
        residual = residual - sun
        luminance = np.maximum(residual @ LUMINANCE, 0.0)
    return SplitWorld(residual, tuple(suns))


def _wrapped(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Three copies side by side: longitude goes round."""
    return np.concatenate([mask, mask, mask], axis=1)


def _connected(mask: NDArray[np.bool_], place: tuple[np.intp, ...]) -> NDArray[np.bool_]:
    """The part of a mask that is connected with a place in it, longitude going round."""
    width = mask.shape[1]
    labels, _ = ndimage.label(_wrapped(mask), structure=np.ones((3, 3)))
    whole = labels == labels[place[0], place[1] + width]
    return np.asarray(whole[:, :width] | whole[:, width:-width] | whole[:, -width:])
