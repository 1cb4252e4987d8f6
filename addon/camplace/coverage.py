# SPDX-License-Identifier: GPL-3.0-or-later
"""How well caching cameras see the samples, and what one more camera adds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .camera import CachingCamera
from .rays import RayCaster
from .samples import Samples

# An angle is usable up to 81 degrees from the surface's normal. Flatter, texels are smeared over
# more than six times their width, and depth hardly tells a surface from its neighbours.
LEAST_COSINE = 0.15
# What being seen at a usable angle is worth, out of 1; the rest is earned by density. A hole
# costs a picture far more than a blur does, so density only decides once few holes are left.
SEEN = 0.9
# A sample that is seen at a glancing angle only is worth this share of that: it is no hole, but
# another camera that sees it better is wanted.
GLANCING = 0.5
# A sample is well seen when some camera sees it at a usable angle and no texel is longer than
# this many of the view's pixels there. At two the texture loses its last octave, the one that a
# pixel filter of the usual width takes half away already; at four a blur is plain to see.
WELL_TEXEL = 2.0
# What a sample is worth from which on it is well seen.
WELL = SEEN + (1.0 - SEEN) / WELL_TEXEL


@dataclass(frozen=True)
class Seen:
    """The samples that one camera covers.

    Attributes:
        index: (V,) int64, into the samples.
        texel: (V,) float64, the longest extent of one texel in the picture of the view that
            the sample is for, in pixels; at most 1 is as sharp as that view.
        usable: (V,) bool, whether the angle is.
    """

    index: NDArray[np.int64]
    texel: NDArray[np.float64]
    usable: NDArray[np.bool_]

    @cached_property
    def worth(self) -> NDArray[np.float64]:
        """(V,) in (0, 1]: 1 for a usable angle and texels no larger than the view's pixels.

        A sample that no camera sees is worth 0.
        """
        worth = SEEN + (1.0 - SEEN) / np.maximum(self.texel, 1.0)
        return np.asarray(np.where(self.usable, worth, GLANCING * worth))


def visible_from(
    place: NDArray[np.float64],
    samples: Samples,
    lift: NDArray[np.float64],
    rays: RayCaster,
    wanted: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Those of the samples `wanted` (W,) that a camera at `place` (3,) sees in any direction.

    A sample is seen from its own side only: a cache holds one side of a two-sided sheet, and
    the other side may look different. `lift` (S,) is where rays leave the surface.
    """
    return visible_from_each(place[None], samples, lift, rays, wanted)[0]


def visible_from_each(
    places: NDArray[np.float64],
    samples: Samples,
    lift: NDArray[np.float64],
    rays: RayCaster,
    wanted: NDArray[np.int64],
) -> list[NDArray[np.int64]]:
    """As `visible_from`, for each of the `places` (P, 3); faster than one after the other."""
    point, normal = samples.point[wanted], samples.normal[wanted]
    height = places @ normal.T - np.einsum("sx,sx->s", point, normal)
    number, facing = np.nonzero(height > 0.0)
    start = point + lift[wanted, None] * normal
    seen = ~rays.occluded(start[facing], places[number])
    number, facing = number[seen], facing[seen]
    ends = np.searchsorted(number, np.arange(1, len(places)))
    return np.split(wanted[facing], ends)


def seen_by_camera(camera: CachingCamera, samples: Samples, visible: NDArray[np.int64]) -> Seen:
    """Those of the samples `visible` (V,) from the camera's place that are in its picture."""
    index = visible[_in_picture(camera, samples.point[visible])]
    usable = _cosines(camera.origin, samples, index) >= LEAST_COSINE
    return Seen(index, texel_size(camera, samples, index), usable)


def seen_by(
    camera: CachingCamera, samples: Samples, lift: NDArray[np.float64], rays: RayCaster
) -> NDArray[np.int64]:
    """The samples in the camera's picture with a free line of sight, however flat it is."""
    inside = np.flatnonzero(_in_picture(camera, samples.point))
    return visible_from(camera.origin, samples, lift, rays, inside)


def well_seen_by(
    camera: CachingCamera, samples: Samples, index: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Those of the samples `index` (V,), which the camera sees, that it sees well."""
    seen = seen_by_camera(camera, samples, index)
    return seen.index[seen.usable & (seen.texel <= WELL_TEXEL)]


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
    adjugate, determinant = _adjugate(texels)
    stretch = largest_singular_value(pixels @ adjugate)
    # A surface seen edge on has the determinant 0: an endless texel.
    seen = determinant != 0.0
    return np.where(seen, stretch / np.where(seen, np.abs(determinant), 1.0), np.inf)


def largest_singular_value(m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(...,) of 2 x 2 matrices (..., 2, 2), in closed form."""
    total = (m * m).sum(axis=(-2, -1))
    determinant = m[..., 0, 0] * m[..., 1, 1] - m[..., 0, 1] * m[..., 1, 0]
    root = np.sqrt(np.maximum(total * total - 4.0 * determinant * determinant, 0.0))
    return np.asarray(np.sqrt(0.5 * (total + root)))


def gain(seen: Seen, worth: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    """How much the samples' mean worth rises if `seen` joins what is worth (S,) so far.

    `weight` (S,) adds up to 1.
    """
    return float(weight[seen.index] @ np.maximum(seen.worth - worth[seen.index], 0.0))


def joined(worth: NDArray[np.float64], seen: Seen) -> NDArray[np.float64]:
    """(S,) what each sample is worth once `seen` has joined."""
    result = worth.copy()
    result[seen.index] = np.maximum(result[seen.index], seen.worth)
    return result


def _in_picture(camera: CachingCamera, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie in the camera's frustum, clips apart."""
    place = camera.project(points)
    return np.asarray((place[:, 2] > 0.0) & (np.abs(place[:, :2] - 0.5) <= 0.5).all(axis=-1))


def _cosines(
    place: NDArray[np.float64], samples: Samples, index: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(V,) between the normals of the samples `index` (V,) and the ways to `place` (3,)."""
    towards = place - samples.point[index]
    length = np.maximum(np.linalg.norm(towards, axis=-1), np.finfo(np.float64).tiny)
    return np.asarray(np.einsum("sx,sx->s", towards, samples.normal[index]) / length)


def _adjugate(m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Adjugates (..., 2, 2) and determinants (...,) of 2 x 2 matrices: the inverse's parts."""
    a, b, c, d = m[..., 0, 0], m[..., 0, 1], m[..., 1, 0], m[..., 1, 1]
    adjugate = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return adjugate, a * d - b * c
