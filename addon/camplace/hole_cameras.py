# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras at a view's own place, for what no other caching camera sees of it, or sees
with fewer texels than the view has pixels.

The paper's small temporary scene (Kim, Kyung, Lee 2009, III.3) is looked at from the view. What a
camera there sees has no parallax against the view, so that each hole is in its picture. A parallel
projection has no place: its cameras stand so far back that their rays are nearly parallel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.view import View
from .camera import CachingCamera
from .settings import RESOLUTIONS

# Texels along a pixel's side, at least: a sample somewhere in the pixel then has texels beside it
# that the pixel's centre alone would not tell of. Finer ones left no fewer holes.
TEXELS_PER_PIXEL = 1.5

# The same where what is soft is to be sharp. A wallpaper's HDR-FLIP beside Cycles is 0.046 with 1.3
# texels to a pixel in the mean, 0.043 with 2 and 0.042 with 3.
SHARP_TEXELS_PER_PIXEL = 3.0

# So many texels for what is soft: a large view gets fewer along a pixel's side. Temporary pictures
# are dropped beyond 24 or 256 MB, and those of one view have to stay together.
_SHARP_TEXELS = 12e6

# Pixels beyond the outermost holes: half of the widest pixel filter, and a texel's footprint.
_MARGIN_PIXELS = 3.0

# tan(fov / 2) of the widest picture: beyond 90 degrees its corners have twice the texels.
_WIDEST_EXTENT = 1.0

# What a picture takes to be baked, however small, in texels of a larger one: a tenth of what a
# million of them take, of a staircase of 774 objects.
_PICTURE_COST = 320.0**2

# Resolutions are multiples of this: texels are kept in such blocks.
_STEP = 16

# More pictures make each search through the cache longer.
_MOST_CAMERAS = 6

# A parallel view's camera stands back by so many times the width of what it shows: its rays then
# lean by half a 64th at most, which moves an edge by a 64th of what lies in front of another.
_STAND_BACK = 64.0

# Clips stay clear of what is to be seen by more than float32 rounds.
_CLEAR = 1e-5


@dataclass(frozen=True)
class HolePoints:
    """What a view sees, and where its holes are.

    Attributes:
        seen: (N, 3) float64, world space, metres: surfaces at the centres of the view's pixels.
        is_hole: (N,) which of them no caching camera sees.
        is_soft: (N,) which of them are seen, with fewer texels than the view has pixels; None
            where that was not asked.
    """

    seen: NDArray[np.float64]
    is_hole: NDArray[np.bool_]
    is_soft: NDArray[np.bool_] | None = None

    @property
    def soft_fraction(self) -> float:
        """Share of what is seen that is soft."""
        return 0.0 if self.is_soft is None or not len(self.is_soft) else float(self.is_soft.mean())


def hole_cameras(view: View, points: HolePoints, first_id: int = 0) -> tuple[CachingCamera, ...]:
    """Cameras whose pictures together hold all holes of a view and all that is soft, numbered
    from `first_id`.

    One, or as many as take the least time to bake. Without either none.
    """
    wanted, texels = points.is_hole, TEXELS_PER_PIXEL
    if points.is_soft is not None and points.is_soft.any():
        wanted = wanted | points.is_soft
        affordable = math.sqrt(_SHARP_TEXELS / np.count_nonzero(wanted))
        texels = min(max(affordable, TEXELS_PER_PIXEL), SHARP_TEXELS_PER_PIXEL)
    if not wanted.any():
        return ()
    eye = _Eye.of(view, points.seen[wanted], texels)
    fits = _fits(eye, points.seen[wanted], _MOST_CAMERAS)
    return tuple(
        fit.camera(number, eye, points.seen) for number, fit in enumerate(fits, start=first_id)
    )


@dataclass(frozen=True)
class _Eye:
    """Where the cameras stand: the view's eye, or far behind a parallel view.

    Attributes:
        place: (3,) world space.
        near: the view's near clip, metres along its axis from `place`.
        axes: (3, 3) right, up and back of the view, in columns.
        pixel: width of a pixel at distance 1 along the axis; for a parallel view in metres.
        texels: along a pixel's side, at least.
        perspective: which of these it is.
    """

    place: NDArray[np.float64]
    near: float
    axes: NDArray[np.float64]
    pixel: float
    texels: float
    perspective: bool

    @classmethod
    def of(cls, view: View, holes: NDArray[np.float64], texels: float) -> _Eye:
        clip, axes = view.clip_from_camera, view.world_from_camera[:3, :3]
        pixel = 2.0 / max(abs(clip[0, 0]) * view.width, abs(clip[1, 1]) * view.height)
        if view.perspective:
            near = clip[2, 3] / (clip[2, 2] - 1.0)
            return cls(view.origin, float(near), axes, pixel, texels, perspective=True)
        near = (1.0 + clip[2, 3]) / clip[2, 2]
        local = (holes - view.origin) @ axes
        middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
        across = 2.0 / min(abs(clip[0, 0]), abs(clip[1, 1]))
        middle[2] = local[:, 2].max() + _STAND_BACK * across
        place = view.origin + axes @ middle
        return cls(place, float(near + middle[2]), axes, pixel, texels, perspective=False)


@dataclass(frozen=True)
class _Fit:
    """One picture around some holes: (3, 3) axes as `_Eye`, half its side at distance 1, and the
    texels that it needs along a side. `lean` is the least depth of a hole, in its depth along the
    view's own axis, `nearest` in metres."""

    axes: NDArray[np.float64]
    extent: float
    texels: float
    lean: float
    nearest: float

    @property
    def cost(self) -> float:
        """What its bake takes, in texels."""
        return _PICTURE_COST + self.texels**2

    def camera(self, number: int, eye: _Eye, seen: NDArray[np.float64]) -> CachingCamera:
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes
        matrix[:3, 3] = eye.place
        depth = -((seen - eye.place) @ self.axes[:, 2])
        far = float(depth.max()) * (1.0 + _CLEAR)
        near = min(max(eye.near * self.lean, far * 1e-9), self.nearest) * (1.0 - _CLEAR)
        return CachingCamera(
            id=number,
            world_from_camera=matrix,
            fov=2.0 * float(np.arctan(self.extent)),
            near=near,
            far=far,
            resolution=min(_STEP * int(np.ceil(self.texels / _STEP)), RESOLUTIONS[-1]),
            kind="PERSPECTIVE",
            source=number,
        )


def _fits(eye: _Eye, holes: NDArray[np.float64], most: int) -> tuple[_Fit, ...]:
    """Pictures that hold (N, 3) holes: one, or those of both sides of a gap, if these take less
    time or one cannot hold all; `most` of them unless they have to be more."""
    way = holes - eye.place
    own = way @ eye.axes
    # By columns, along which numpy finds the least and the greatest several times faster.
    tangents = np.asfortranarray(own[:, :2] / -own[:, 2:])
    fit = _fit(eye, way, own, 0.5 * (tangents.min(axis=0) + tangents.max(axis=0)))
    fits = fit.extent <= _WIDEST_EXTENT and fit.texels <= RESOLUTIONS[-1]
    # Two pictures take at least twice what any takes.
    if fits and (most < 2 or fit.cost <= 2.0 * _PICTURE_COST):
        return (fit,)
    upper = _widest_gap(tangents, halves=not fits)
    if not upper.any():
        return (fit,)
    below = _fits(eye, holes[~upper], most - 1)
    above = _fits(eye, holes[upper], max(most - len(below), 1))
    parted = (*below, *above)
    return parted if not fits or sum(part.cost for part in parted) < fit.cost else (fit,)


def _widest_gap(tangents: NDArray[np.float64], *, halves: bool) -> NDArray[np.bool_]:
    """(N,) which of N directions lie beyond the widest gap along an axis; or, where only their
    spread counts, in the upper half of the longer axis. None does where all are one."""
    low, high = tangents.min(axis=0), tangents.max(axis=0)
    if halves:
        axis = int(np.argmax(high - low))
        return tangents[:, axis] > 0.5 * (low[axis] + high[axis])
    ordered = np.sort(tangents, axis=0)
    gaps = np.diff(ordered, axis=0)
    row, axis = divmod(int(np.argmax(gaps)), 2) if len(gaps) else (0, 0)
    return tangents[:, axis] > ordered[row, axis]


def _fit(
    eye: _Eye, way: NDArray[np.float64], own: NDArray[np.float64], middle: NDArray[np.float64]
) -> _Fit:
    """The picture about the direction with these tangents, upright in the view."""
    back = eye.axes @ np.array([-middle[0], -middle[1], 1.0])
    back /= np.linalg.norm(back)
    right = np.cross(eye.axes[:, 1], back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back], axis=1)
    turned = way @ axes
    depth = -turned[:, 2]
    # Behind a camera's plane nothing can be seen: such a fit is parted.
    if depth.min() <= 0.0:
        return _Fit(axes, np.inf, np.inf, 0.0, 0.0)
    pixel = eye.pixel * -own[:, 2] if eye.perspective else np.full(len(own), eye.pixel)
    across = np.maximum(np.abs(turned[:, 0]), np.abs(turned[:, 1]))
    reach = across + _MARGIN_PIXELS * pixel * depth / -own[:, 2]
    extent = float((reach / depth).max())
    width = _least_stretch(eye.axes.T @ axes, turned) * pixel
    density = eye.texels * float((1.0 / np.maximum(width, np.finfo(float).tiny)).max())
    lean = float((depth / -own[:, 2]).min())
    return _Fit(axes, extent, 2.0 * extent * density, lean, float(depth.min()))


def _least_stretch(axes: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) how far a step of a metre across the view moves a point in the picture, at distance 1,
    in the direction in which it moves it least.

    Args:
        axes: (3, 3) the camera's, in columns, in those of the view.
        place: (N, 3) the points, in the camera's axes.
    """
    depth = -place[:, 2]
    # Of x / depth and y / depth by the view's right and up.
    (xr, xu), (yr, yu) = (
        [(depth * axes[j, i] + place[:, i] * axes[j, 2]) / depth**2 for j in (0, 1)] for i in (0, 1)
    )
    determinant = np.abs(xr * yu - xu * yr)
    squares = xr**2 + xu**2 + yr**2 + yu**2
    most = 0.5 * (squares + np.sqrt(np.maximum(squares**2 - 4.0 * determinant**2, 0.0)))
    return np.asarray(determinant / np.sqrt(most))
