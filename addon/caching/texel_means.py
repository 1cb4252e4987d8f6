# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours as the means over texels, made ready for being read bilinearly.

A colour at a texel's centre says little of a fine pattern: which of its values is there is chance,
and a pixel that reads a few of them is off by it. The mean over the texel is not. Read bilinearly,
means are too soft, though: a texel's box has a variance of 1/12 of a squared texel along each axis,
the tent between texels 1/6. What a blur of variance s takes away is, to second order, s/2 of the
second derivative, which is given back beforehand: a texel loses an eighth of its second
differences. That is the prefilter of quasi-interpolation (Blu, Unser 1999: "Quantitative Fourier
Analysis of Approximation Techniques"; Nehab, Hoppe 2014: "A Fresh Look at Generalized Sampling"),
which costs nothing when the texel is read. Of a pattern of thin lines, at four texels to a pixel,
the pixels' error is 2 dB less with means and 6 dB less with both (`tests/caching/
test_texel_means.py`).

Only within one surface: where a texel and its eight neighbours show one material, and no edge.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from ..camplace.camera import CachingCamera
from .channels import CHANNEL_BY_NAME, lobe_channel
from .plan import ChannelPlan

Picture = NDArray[np.float32]

# The share of a texel that shows anything, among the means, where no material tells.
COVERED = "covered"

# Half of 1/12 + 1/6.
_SHARPENING = np.float32(0.125)
# Steps in depth of a quarter of a texel's width, or bends of as many radians, are edges.
_STEP = 0.25
_LINEAR_FIELDS = ("diffuse_share", "specular_share")
# A colour whose quotient with a weight is used must not leave what the weight allows.
_WEIGHTS = {"diffuse_color": "diffuse_share", "specular_f0": "specular_share",
            "specular_f90": "specular_share", "specular_dip": "specular_share"}  # fmt: skip


def averaged_channels(plan: ChannelPlan) -> tuple[str, ...]:
    """The stored channels whose mean over a texel is what the texel sends back in the mean."""
    return tuple(
        channel.name
        for channel in plan.channels
        if channel.space == "linear Rec.709" or channel.field in _LINEAR_FIELDS
    )


def take_means(
    channels: dict[str, Picture],
    means: Mapping[str, Picture],
    camera: CachingCamera,
    plan: ChannelPlan,
) -> None:
    """Put the means in the place of the values at the texels' centres.

    Args:
        channels: (R, R, components) each, at the centres; those of `averaged_channels` change.
        means: the same of these channels, over the whole of each texel, and of `material_id` if
            that is stored, else COVERED.
        camera: that sees them.
        plan: of the scene.
    """
    own = within_one_surface(camera, channels["depth"][..., 0])
    if "material_id" in channels:
        material = channels["material_id"][..., 0]
        own &= minimum_filter(material, 3) == maximum_filter(material, 3)
        # What lies between the centres: whole numbers, whose mean is exact to float32.
        own &= np.abs(means["material_id"][..., 0] - material) < 1e-3
    else:
        own &= means[COVERED][..., 0] > 1.0 - 1e-3
    own &= np.all([np.isfinite(mean).all(axis=-1) for mean in means.values()], axis=0)
    for name in averaged_channels(plan):
        values = channels[name]
        np.copyto(values, means[name], where=own[..., None])
        if _is_sharpened(name, plan):
            channels[name] = sharpened(values, own)


def within_one_surface(camera: CachingCamera, depth: Picture) -> NDArray[np.bool_]:
    """(R, R): whether texels and all their neighbours lie on a surface without an edge there.

    The inverse of the depth is linear over the picture of a plane: its second differences are
    steps and bends. Nothing in metres.

    Args:
        camera: that sees them.
        depth: (R, R) metres along the view axis, 0 where nothing is hit.
    """
    own = np.zeros(depth.shape, dtype=bool)
    hit = depth > 0.0
    inverse = np.divide(1.0, depth, out=np.zeros(depth.shape), where=hit)
    bound = _STEP * 2.0 * camera.half_extent / camera.resolution * inverse[1:-1, 1:-1]
    middle = own[1:-1, 1:-1]
    middle[:] = minimum_filter(hit, 3)[1:-1, 1:-1]
    for (a, b), (c, d) in (((0, 1), (2, 1)), ((1, 0), (1, 2)), ((0, 0), (2, 2)), ((0, 2), (2, 0))):
        ends = _shifted(inverse, a, b) + _shifted(inverse, c, d)
        middle &= np.abs(ends - 2.0 * inverse[1:-1, 1:-1]) <= bound
    return own


def sharpened(values: Picture, own: NDArray[np.bool_]) -> Picture:
    """(R, R, C): texels less an eighth of their second differences, where they are `own`.

    A white texel among black ones becomes 1.5, of which a look between texels never sees more than
    the pattern has; only what would be negative is held at 0.
    """
    middle = values[1:-1, 1:-1]
    around = sum(_shifted(values, i, j) for i, j in ((0, 1), (2, 1), (1, 0), (1, 2)))
    wanted = middle - _SHARPENING * (around - 4.0 * middle)
    result = values.copy()
    np.copyto(result[1:-1, 1:-1], np.maximum(wanted, 0.0), where=own[1:-1, 1:-1, None])
    return result


def _is_sharpened(name: str, plan: ChannelPlan) -> bool:
    """Not what may be a thousand times brighter than its neighbour, nor quotients' terms."""
    channel = CHANNEL_BY_NAME[name]
    if channel.name == "emission" or channel.field in _LINEAR_FIELDS:
        return False
    weight = _WEIGHTS.get(channel.field)
    return weight is None or lobe_channel(weight, channel.lobe) not in plan.stored


def _shifted(values: NDArray[np.floating], row: int, column: int) -> NDArray[np.floating]:
    rows, columns = values.shape[0] - 2, values.shape[1] - 2
    return values[row : row + rows, column : column + columns]
