# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of one frame of a flight, and from one frame to the next.

What is measured is the light that surfaces scatter diffusely: on a still surface under still lights
it does not depend on the view, so that every change from frame to frame is the caching's.
Values are luma, display-encoded, from 0 to 255. Pictures are (H, W), row 0 at the bottom.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.camplace.rays import RayCaster
from addon.scene.view import View

# Neighbours are on one surface if it bends by less than this (cosine, 25 degrees), and the line
# that joins them leaves the plane of either by less than this share of its length.
LEAST_COSINE, MOST_OFF_PLANE = 0.9, 0.3
# A point is seen again if what is seen there is nearer to it than so many of the pixels' diagonals.
SAME_POINT_PIXELS = 1.5
# A surface is not taken to be turned away further than this (cosine): its pixels have no end.
GLANCING = 0.05


@dataclass(frozen=True)
class Surfaces:
    """What the pixels of a view see, by embree: exact, whatever the rasterizer does.

    Attributes:
        point: (H, W, 3) float64, metres, world space.
        normal: (H, W, 3) unit geometric normal towards the viewer.
        owner: (H, W) int64, whose surface it is; -1 for none.
        pixel: (H, W) a pixel's diagonal on the surface, which is longer where that is turned away,
            metres.
    """

    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    owner: NDArray[np.int64]
    pixel: NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """One picture of the flight.

    Attributes:
        view: its camera.
        surfaces: what it sees.
        value: (H, W) luma of the diffuse light.
        camera: (H, W) int64, the caching camera that each pixel reads; -1 for a hole.
    """

    view: View
    surfaces: Surfaces
    value: NDArray[np.float64]
    camera: NDArray[np.int64]


@dataclass(frozen=True)
class Seams:
    """Steps across neighbours that read from different caching cameras.

    Attributes:
        share: of neighbours on one surface.
        step: mean difference of their values.
        beside: mean difference of the neighbours next to them on the same line, of one camera each.
        worst: 99th percentile of a step less that beside it.
        picture: (H, W) the larger step at each pixel's lower and left side; 0 for no seam.
    """

    share: float
    step: float
    beside: float
    worst: float
    picture: NDArray[np.float32]


@dataclass(frozen=True)
class Flicker:
    """Changes of the same points' values from a frame to the next.

    Attributes:
        share: of the pixels whose point is seen again with all four pixels about it.
        switched: share of these that read from another camera than before.
        stayed_change, switched_change: mean changes; 0 for no pixels.
        worst: 99th percentile of all changes.
        picture: (H, W) each pixel's change; 0 where it is not known.
    """

    share: float
    switched: float
    stayed_change: float
    switched_change: float
    worst: float
    picture: NDArray[np.float32]

    @property
    def excess(self) -> float:
        """Mean over all pixels seen again of what switching cameras adds to the change.

        Pixels that stayed tell what resampling and texture cost by themselves.
        """
        return self.switched * max(self.switched_change - self.stayed_change, 0.0)


def see(
    view: View,
    rays: RayCaster,
    origin: NDArray[np.float64],
    normal: NDArray[np.float64],
    owner: NDArray[np.int64],
) -> Surfaces:
    """What a view sees.

    Args:
        view: metres, world space.
        rays: of the geometry less `origin`.
        origin: (3,) metres, world space.
        normal: (T, 3) the triangles' normals.
        owner: (T,) whose they are: a number for each object and material.
    """
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    shape = (view.height, view.width)
    start, direction = view.rays(np.stack([x, y], axis=-1).reshape(-1, 2))
    hits = rays.first_hit(start - origin, direction)
    met = hits.triangle >= 0
    distance = np.where(met, hits.distance, 0.0)
    found = normal[hits.triangle]
    towards = np.einsum("rx,rx->r", found, direction)
    found = np.where(towards[:, None] > 0.0, -found, found)
    width = 2.0 / (view.clip_from_camera[0, 0] * view.width)
    if view.perspective:
        width = width * distance * -(direction @ view.world_from_camera[:3, 2])
    pixel = np.sqrt(2.0) * width / np.maximum(np.abs(towards), GLANCING)
    return Surfaces(
        point=(start + distance[:, None] * direction).reshape(*shape, 3),
        normal=found.reshape(*shape, 3),
        owner=np.where(met, owner[hits.triangle], -1).reshape(shape),
        pixel=pixel.reshape(shape),
    )


def seams(frame: Frame) -> Seams:
    """Steps along rows and columns together."""
    pairs = different = 0
    steps, around = [], []
    picture = np.zeros(frame.value.shape)
    for turn in (False, True):
        value, camera, same = _lines(frame, turn)
        valid = same & (camera[:, 1:] >= 0) & (camera[:, :-1] >= 0)
        changes = valid & (camera[:, 1:] != camera[:, :-1])
        pairs += int(valid.sum())
        different += int(changes.sum())
        step = np.abs(np.diff(value, axis=1))
        plain = valid & ~changes
        # A seam counts with a plain pair on both sides of it: what the picture does there anyway.
        inner = changes[:, 1:-1] & plain[:, :-2] & plain[:, 2:]
        steps.append(step[:, 1:-1][inner])
        around.append(0.5 * (step[:, :-2] + step[:, 2:])[inner])
        drawn = picture.T if turn else picture
        drawn[:, 1:] = np.maximum(drawn[:, 1:], np.where(changes, step, 0.0))
    step, beside = np.concatenate(steps), np.concatenate(around)
    return Seams(
        share=different / pairs if pairs else 0.0,
        step=float(step.mean()) if step.size else 0.0,
        beside=float(beside.mean()) if step.size else 0.0,
        worst=float(np.percentile(step - beside, 99.0)) if step.size else 0.0,
        picture=picture.astype(np.float32),
    )


def _lines(
    frame: Frame, turn: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Values and cameras by rows, or by columns; and which neighbours are on one surface."""
    seen = frame.surfaces
    value, camera, owner = frame.value, frame.camera, seen.owner
    point, normal = seen.point, seen.normal
    if turn:
        value, camera, owner = value.T, camera.T, owner.T
        point, normal = point.swapaxes(0, 1), normal.swapaxes(0, 1)
    line = np.diff(point, axis=1)
    length = np.linalg.norm(line, axis=-1)
    off = np.maximum(
        np.abs(np.einsum("hwx,hwx->hw", line, normal[:, 1:])),
        np.abs(np.einsum("hwx,hwx->hw", line, normal[:, :-1])),
    )
    same = (owner[:, 1:] == owner[:, :-1]) & (owner[:, 1:] >= 0)
    same &= np.einsum("hwx,hwx->hw", normal[:, 1:], normal[:, :-1]) >= LEAST_COSINE
    same &= off <= MOST_OFF_PLANE * length
    return value, camera, same


def flicker(before: Frame, after: Frame) -> Flicker:
    """How the points that `before` sees at its pixels' centres change."""
    height, width = before.value.shape
    seen = before.surfaces
    there = (seen.owner >= 0) & (before.camera >= 0)
    place = after.view.project(seen.point)
    x, y = place[..., 0] - 0.5, place[..., 1] - 0.5
    there &= (place[..., 3] > 0.0) & (x >= 0.0) & (y >= 0.0)
    there &= (x < width - 1) & (y < height - 1)
    column = np.where(there, x, 0.0).astype(np.int64)
    row = np.where(there, y, 0.0).astype(np.int64)
    u, v = np.where(there, x, 0.0) - column, np.where(there, y, 0.0) - row
    change = np.zeros_like(before.value)
    switched = np.zeros_like(there)
    for i in (0, 1):
        for j in (0, 1):
            at = (row + i, column + j)
            weight = (v if i else 1.0 - v) * (u if j else 1.0 - u)
            change += weight * after.value[at]
            there &= _same_point(seen, after.surfaces, at) & (after.camera[at] >= 0)
            # One that hardly counts has not switched.
            switched |= (after.camera[at] != before.camera) & (weight > 0.1)
    change = np.where(there, np.abs(change - before.value), 0.0)
    stayed, moved = change[there & ~switched], change[there & switched]
    return Flicker(
        share=float(there.mean()),
        switched=float(switched[there].mean()) if there.any() else 0.0,
        stayed_change=float(stayed.mean()) if stayed.size else 0.0,
        switched_change=float(moved.mean()) if moved.size else 0.0,
        worst=float(np.percentile(change[there], 99.0)) if there.any() else 0.0,
        picture=change.astype(np.float32),
    )


def _same_point(
    seen: Surfaces, other: Surfaces, at: tuple[NDArray[np.int64], NDArray[np.int64]]
) -> NDArray[np.bool_]:
    """Whether what another view sees at some pixels is what this one sees."""
    line = other.point[at] - seen.point
    near = np.linalg.norm(line, axis=-1) <= SAME_POINT_PIXELS * other.pixel[at]
    flat = np.einsum("hwx,hwx->hw", other.normal[at], seen.normal) >= LEAST_COSINE
    return np.asarray(near & flat & (other.owner[at] == seen.owner))
