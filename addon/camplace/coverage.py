# SPDX-License-Identifier: GPL-3.0-or-later
"""How well caching cameras see the samples, and what one more camera adds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import CachingCamera
from .rays import RayCaster
from .samples import Samples

# A surface seen at more than 81 degrees from its normal is not covered: its texels are smeared
# over more than six times their width, and the depth test cannot tell it from its neighbours.
LEAST_COSINE = 0.15
# What being seen at all is worth, out of 1; the rest is earned by density. A hole costs a
# picture far more than a blur does, so density only decides once few holes are left to fill.
SEEN = 0.9
# A sample is well seen when some camera sees it at a usable angle and no texel is longer than
# this many of the view's pixels there. At two the texture loses its last octave, the one that a
# pixel filter of the usual width takes half away already; at four a blur is plain to see.
WELL_TEXEL = 2.0


@dataclass(frozen=True)
class Seen:
    """The samples that one camera covers.

    Attributes:
        index: (V,) int64, into the samples.
        texel: (V,) float64, the longest extent of one texel in the picture of the view that
            the sample is for, in pixels; at most 1 is as sharp as that view.
    """

    index: NDArray[np.int64]
    texel: NDArray[np.float64]

    def quality(self) -> NDArray[np.float64]:
        """(V,) in (0, 1]: 1 where texels are no larger than the view's pixels."""
        return np.asarray(1.0 / np.maximum(self.texel, 1.0))


def visible_from(
    place: NDArray[np.float64],
    samples: Samples,
    lift: NDArray[np.float64],
    rays: RayCaster,
    wanted: NDArray[np.int64],
    *,
    least_cosine: float = LEAST_COSINE,
) -> NDArray[np.int64]:
    """Those of the samples `wanted` (W,) that a camera at `place` (3,) sees in any direction.

    A sample is seen from its own side only: a cache holds one side of a two-sided sheet, and
    the other side may look different. `lift` (S,) is where rays leave the surface. The cosine
    between the normal and the way to the place is above 0 and at least `least_cosine`.
    """
    cosine = _cosines(place, samples, wanted)
    facing = (cosine > 0.0) & (cosine >= least_cosine)
    point, normal = samples.point[wanted], samples.normal[wanted]
    facing_index = wanted[facing]
    start = point[facing] + lift[facing_index, None] * normal[facing]
    return facing_index[~rays.occluded(start, place)]


def seen_by_camera(camera: CachingCamera, samples: Samples, visible: NDArray[np.int64]) -> Seen:
    """Those of the samples `visible` (V,) from the camera's place that are in its picture."""
    place = camera.project(samples.point[visible])
    inside = (place[:, 2] > 0.0) & (np.abs(place[:, :2] - 0.5) <= 0.5).all(axis=-1)
    index = visible[inside]
    return Seen(index, texel_size(camera, samples, index))


def seen_by(
    camera: CachingCamera, samples: Samples, lift: NDArray[np.float64], rays: RayCaster
) -> NDArray[np.int64]:
    """The samples in the camera's picture with a free line of sight, however flat it is."""
    place = camera.project(samples.point)
    inside = (place[:, 2] > 0.0) & (np.abs(place[:, :2] - 0.5) <= 0.5).all(axis=-1)
    return visible_from(
        camera.origin, samples, lift, rays, np.flatnonzero(inside), least_cosine=0.0
    )


def well_seen_by(
    camera: CachingCamera, samples: Samples, index: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Those of the samples `index` (V,), which the camera sees, that it sees well."""
    usable = index[_cosines(camera.origin, samples, index) >= LEAST_COSINE]
    return usable[texel_size(camera, samples, usable) <= WELL_TEXEL]


def texel_size(
    camera: CachingCamera, samples: Samples, index: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(V,) longest extent of one texel, carried by the surface into the view's picture, pixels.

    With A = d(pixel)/d(surface) and B = d(texel)/d(surface), both 2 x 2, a round texel becomes
    an ellipse in the picture, and the largest singular value of A B^-1 is its longest
    semi-axis. Distance, angle and resolution of both cameras are all in it; the paper counts
    covered samples only.
    """
    frame = camera.world_from_camera[:3, :3]
    local = (samples.point[index] - camera.origin) @ frame
    depth = -local[:, 2]
    slope = local[:, :2] / depth[:, None]
    # d(x / depth) = (right + slope_x * back) / depth, where back = -forward is frame[:, 2].
    rows = frame[:, :2].T[None] + slope[:, :, None] * frame[:, 2]
    focal = camera.resolution / (2.0 * camera.half_extent)
    texels = (focal / depth)[:, None, None] * (rows @ samples.tangents[index])
    pixels = samples.pixels_from_surface[index]
    return largest_singular_value(pixels @ _inverse(texels))


def largest_singular_value(m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(...,) of 2 x 2 matrices (..., 2, 2), in closed form."""
    total = (m * m).sum(axis=(-2, -1))
    determinant = m[..., 0, 0] * m[..., 1, 1] - m[..., 0, 1] * m[..., 1, 0]
    root = np.sqrt(np.maximum(total * total - 4.0 * determinant * determinant, 0.0))
    return np.asarray(np.sqrt(0.5 * (total + root)))


def score(quality: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a sample seen with `quality` is worth, in [0, 1]; 0 is a sample not seen."""
    return np.where(quality > 0.0, SEEN + (1.0 - SEEN) * quality, 0.0)


def gain(seen: Seen, quality: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    """How much the weighted score rises if `seen` joins what is seen with `quality` (S,)."""
    before = quality[seen.index]
    after = np.maximum(before, seen.quality())
    return float(weight[seen.index] @ (score(after) - score(before)))


def joined(quality: NDArray[np.float64], seen: Seen) -> NDArray[np.float64]:
    """(S,) the best quality of each sample once `seen` has joined."""
    result = quality.copy()
    result[seen.index] = np.maximum(result[seen.index], seen.quality())
    return result


def _cosines(
    place: NDArray[np.float64], samples: Samples, index: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(V,) between the normals of the samples `index` (V,) and the ways to `place` (3,)."""
    towards = place - samples.point[index]
    length = np.maximum(np.linalg.norm(towards, axis=-1), np.finfo(np.float64).tiny)
    return np.asarray(np.einsum("sx,sx->s", towards, samples.normal[index]) / length)


def _inverse(m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of 2 x 2 matrices. A surface seen edge on gives a determinant of 0: an endless texel."""
    a, b, c, d = m[..., 0, 0], m[..., 0, 1], m[..., 1, 0], m[..., 1, 1]
    determinant = a * d - b * c
    tiny = np.finfo(np.float64).tiny
    safe = np.where(np.abs(determinant) > tiny, determinant, tiny)
    adjugate = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray(adjugate / safe[..., None, None])
