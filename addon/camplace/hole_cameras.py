# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras at a view's own place, for what no other caching camera sees of it, or sees
with fewer texels than the view has pixels.

The paper's small temporary scene (Kim, Kyung, Lee 2009, III.3) is looked at from the view. What a
camera there sees has no parallax against the view, so that each hole is in its picture. A parallel
projection has no place: its cameras stand so far back that their rays are nearly parallel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

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

# So many texels for what is soft, were none of them beside it: a large view gets fewer along a
# pixel's side.
_SHARP_TEXELS = 12e6

# What one view may have at most, so that a cache keeps its pictures together, and of the views
# before it some: two thirds of their number there, and at 8.1 bytes of a texel, the most of the
# scenes of docs/caching.md, three quarters of the bytes.
MOST_PICTURES = 16
MOST_TEXELS = 24_000_000

# Texels along a pixel's side, at least, where pictures have to be coarser for that: with fewer
# what is soft stays so, and holes that are narrower than texels stay open.
_LEAST_SHARP_TEXELS = 1.0
_LEAST_TEXELS = 0.5

# Steps in which they become coarser, and of how many points it is told whether they have to: a
# search among all of two million takes ten seconds.
_COARSER = 0.9
_MUCH_COARSER = 0.5
_TELLING = 10_000

# Pixels beyond the outermost holes: half of the widest pixel filter, and a texel's footprint.
_MARGIN_PIXELS = 3.0

# tan(fov / 2) of the widest picture: beyond 90 degrees its corners have twice the texels.
_WIDEST_EXTENT = 1.0

# What a picture takes to be baked, however small, in texels of a larger one: a tenth of what a
# million of them take, of a staircase of 774 objects.
_PICTURE_COST = 320.0**2

# Resolutions are multiples of this: texels are kept in such blocks.
_STEP = 16

# More pictures make each search through the cache longer: so many if fewer can hold all.
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


@dataclass(frozen=True)
class HoleCameras:
    """What is to be baked for a view.

    Attributes:
        cameras: at the view's place.
        texels: of their pictures along a pixel's side, at least.
        left: share of what the view lacks that need not be in any of the pictures, [0, 1].
    """

    cameras: tuple[CachingCamera, ...] = ()
    texels: float = 0.0
    left: float = 0.0

    @property
    def note(self) -> str:
        """What the view lacks for having no more pictures or texels, as one sentence; "" for
        nothing."""
        said = []
        if self.left > 0.0:
            said.append(
                f"up to {max(100.0 * self.left, 0.01):.2f} % of what the cache lacks of this view "
                "stays as it is"
            )
        if self.cameras and self.texels < 1.0:
            said.append(
                f"what is baked for this view has {self.texels:.2g} texels along a pixel's side"
            )
        if not said:
            return ""
        limit = f"one view has {MOST_PICTURES} pictures and {MOST_TEXELS // 10**6} million texels"
        return f"{', and '.join(said)}: {limit} at most; a narrower or smaller view takes fewer"


def hole_cameras(view: View, points: HolePoints, first_id: int = 0) -> HoleCameras:
    """Cameras whose pictures together hold all holes of a view and all that is soft, numbered
    from `first_id`.

    One, or as many as take the least time to bake. Without either none. Where that would be more
    than a view may have, they have fewer texels; and where that does not do, those are left out
    that hold the least.
    """
    wanted, texels, least = points.is_hole, TEXELS_PER_PIXEL, _LEAST_TEXELS
    if points.is_soft is not None and points.is_soft.any():
        wanted = wanted | points.is_soft
        affordable = math.sqrt(_SHARP_TEXELS / np.count_nonzero(wanted))
        texels = min(max(affordable, TEXELS_PER_PIXEL), SHARP_TEXELS_PER_PIXEL)
        least = _LEAST_SHARP_TEXELS
    holes = points.seen[wanted]
    if not len(holes):
        return HoleCameras()
    # Few of many points tell nearly what all do.
    for step in sorted({1, max(len(holes) // _TELLING, 1)}, reverse=True):
        eye = _Eye.of(view, holes[::step], texels)
        fits = _fits(eye, holes[::step], _MOST_CAMERAS)
        while texels > least and not _is_within(fits):
            texels = max(texels * _coarser(fits), least)
            eye = replace(eye, texels=texels)
            fits = _fits(eye, holes[::step], _MOST_CAMERAS)
    fits = _fullest(fits)
    cameras = (fit.camera(number, eye, points.seen) for number, fit in enumerate(fits, first_id))
    held = sum(fit.count for fit in fits)
    return HoleCameras(tuple(cameras), texels, 1.0 - held / len(holes))


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
    view's own axis, `nearest` in metres, and `count` how many holes there are."""

    axes: NDArray[np.float64]
    extent: float
    texels: float
    lean: float
    nearest: float
    count: int

    @property
    def resolution(self) -> int:
        """Texels along a side, as they are baked."""
        # What is alone at one place may need more than there can be.
        texels = min(self.texels, RESOLUTIONS[-1])
        return min(_STEP * int(np.ceil(texels / _STEP)), RESOLUTIONS[-1])

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
            resolution=self.resolution,
            kind="PERSPECTIVE",
            source=number,
        )


def _texels(fits: Sequence[_Fit]) -> int:
    return sum(fit.resolution**2 for fit in fits)


def _is_within(fits: Sequence[_Fit]) -> bool:
    """Whether one view may have all of them."""
    return len(fits) <= MOST_PICTURES and _texels(fits) <= MOST_TEXELS


def _coarser(fits: Sequence[_Fit]) -> float:
    """By which factor texels along a pixel's side become fewer where these fits are too many; not
    at once, since coarser ones may do with fewer pictures, which are larger."""
    share = math.sqrt(MOST_TEXELS / _texels(fits))
    return min(max(share, _MUCH_COARSER), _COARSER)


def _fullest(fits: tuple[_Fit, ...]) -> tuple[_Fit, ...]:
    """Those that one view may have: all, or of many those that hold the most."""
    if _is_within(fits):
        return fits
    kept: list[_Fit] = []
    for fit in sorted(fits, key=lambda fit: fit.count, reverse=True):
        if _is_within([*kept, fit]):
            kept.append(fit)
    return tuple(kept)


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
        return _Fit(axes, np.inf, np.inf, 0.0, 0.0, len(own))
    pixel = eye.pixel * -own[:, 2] if eye.perspective else np.full(len(own), eye.pixel)
    across = np.maximum(np.abs(turned[:, 0]), np.abs(turned[:, 1]))
    reach = across + _MARGIN_PIXELS * pixel * depth / -own[:, 2]
    extent = float((reach / depth).max())
    width = _least_stretch(eye.axes.T @ axes, turned) * pixel
    density = eye.texels * float((1.0 / np.maximum(width, np.finfo(float).tiny)).max())
    lean = float((depth / -own[:, 2]).min())
    return _Fit(axes, extent, 2.0 * extent * density, lean, float(depth.min()), len(own))


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
