# SPDX-License-Identifier: GPL-3.0-or-later
"""Which point of a light one sample of the view is lit from, and which cell of it lobes see.

All pixels of a sample share the point, so that one shadow map serves them. Area lights and suns
are parted into cells (`light_cells`), with a sample for each. Traced shadows look at spots all over
the cell.

Points of lamps follow the additive recurrence of the generalized golden ratio (M. Roberts, "The
Unreasonable Effectiveness of Quasirandom Sequences", 2018), turned by an offset of its own.
Lobes see the whole lamp in each sample: the disk that Cycles turns towards each receiver. Where
each receiver is lit by a point of its own disk, the disk is parted into cells as well.

Points of a point or spot light lie in a *ball*, with a density that grows as
1 / sqrt(1 - r^2) towards its surface. Seen from any side such a ball is an evenly bright disk:
the chord integral of that density is pi for every ray (Abel's transform of a constant). So one
set of isotropic point emitters stands for the disk that Cycles turns towards each receiver, and
by Newton's shell theorem their mean irradiance outside the ball is the centre's exactly. What a
spot lights lies before it: its points lie on the disk across its axis, so that a wall through
the lamp hides the same part of it as in Cycles.

A lamp that touches a surface is another matter: which part of the disk the surface hides then
depends on the receiver, from which the disk is seen turned. Such a light's sample is a place on
*every* disk, and `shadow_frustum` turns one for each of a set of directions. Traced shadows
follow each receiver's own disk, and all lamps are sampled so for them.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...corrmap.sobol_points import sobol_points
from ...scene.frame_across import frame_across
from ...scene.light import Light
from ...scene.mesh_light import MeshLight
from .light_cells import CORNERS, SPOTS, Cell, disk_cells, square_cells

# The real root of x^4 = x + 1: the generalized golden ratio for three dimensions. Three for
# every light, so that area lights and suns don't share the plane sequence that a picture's
# pixel samples may well follow.
_GOLDEN = 1.2207440846057596
_STEPS = _GOLDEN ** -np.arange(1.0, 4.0)

# A glowing object's triangles lie along one line, for which the golden ratio itself is best, and
# its points in a plane (x^3 = x + 1). Around a ball that leaves three quarters of the error of
# three dimensions' steps, and of random points a half with 64 and a quarter with 512.
_MESH_STEPS = np.array([0.6180339887498949, 0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class EmitterPoint:
    """Where on a glowing object a point is.

    Attributes:
        normal: (3,) float64, world space, unit: of its triangle.
        tint: (3,) float64: what the light's intensity is multiplied with, 1 where all of the
            object glows alike.
        corners: (3, 3) float64, world space: its triangle.
    """

    normal: NDArray[np.float64]
    tint: NDArray[np.float64]
    corners: NDArray[np.float64]


@dataclass(frozen=True)
class LightSample:
    """One point of a light, and a part of it that lobes see.

    Attributes:
        position: (3,) float64, world space, metres; for a sun the unit vector towards it.
        count: of how many samples it is one (they share the light's extent between them).
        on_disk: (2,) float64, metres: its place on a disk that is turned towards each receiver;
            None where `position` is the same point for all receivers.
        turn: (3,) float64 in [0, 1): which of all rotations the set of disks has.
        corners: (CORNERS, 3) float64, around that part, world space: of an area light places, of a
            sun directions; of a lamp the whole of it, on the unit disk across the direction to it
            (z is 0), or with `per_receiver` places on its disk as in `on_disk`.
        spots: (SPOTS, 3) float64, places in that part to which traced shadows look, of the same
            kind; or none of them, where the part is but a point.
        emitter: where on a glowing object's triangle it is; None for other lights.
        per_receiver: whether each receiver is lit by the point on its own disk, as in Cycles,
            instead of by `position`, and its disk is parted into cells. Only a shadow that is
            traced for each can follow.
    """

    position: NDArray[np.float64]
    count: int
    corners: NDArray[np.float64] = field(default_factory=lambda: np.zeros((CORNERS, 3)))
    on_disk: NDArray[np.float64] | None = None
    turn: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    per_receiver: bool = False
    emitter: EmitterPoint | None = None
    spots: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))

    def is_parted(self, light: Light) -> bool:
        """Whether lobes see one cell of the light of several."""
        return self.count > 1 and (light.type in ("SUN", "AREA") or self.per_receiver)

    def is_flat(self, light: Light) -> bool:
        """Whether it lies on a disk through the light's centre and not in a ball about that."""
        return light.is_flat_spot or self.on_disk is not None

    def facing(self, light: Light, axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """(F, 3) world space: the point on each of the disks across (F, 3) unit axes."""
        if self.on_disk is None:
            return np.broadcast_to(self.position, axes.shape)
        frames = np.stack([frame_across(axis) for axis in axes])
        return np.asarray(light.position + self.on_disk @ frames)


def light_sample(
    light: Light,
    k: int,
    count: int,
    seed: int = 0,
    *,
    touching: bool = False,
    per_receiver: bool = False,
) -> LightSample:
    """Point k of `count` on the light; a single sample is the light's centre.

    A lamp's points come in pairs that mirror each other in the centre, so that what grows evenly
    over the light is exact from two samples on; the last of an odd count is the centre.

    Args:
        light: the light.
        k: which point.
        count: of how many.
        seed: of the points' offset.
        touching: whether surfaces reach into the ball of a point or spot light's radius.
        per_receiver: whether each receiver gets its own point of such a light's disk.
    """
    if isinstance(light, MeshLight):
        return _on_mesh(light, k, count, seed)
    if light.type == "SUN":
        return _sun_sample(light, k, count, seed)
    if light.type == "AREA":
        return _on_area(light, k, count, seed)
    if light.has_disk and count > 1 and per_receiver:
        return _on_turned_disk(light, k, count, seed)
    return _in_lamp(light, k, count, seed, touching=touching)


def _in_lamp(light: Light, k: int, count: int, seed: int, *, touching: bool) -> LightSample:
    """A lamp's, the same for all receivers or nearly so."""
    corners = _lamp_corners(k * _STEPS[0])
    on_disk = light.has_disk and count > 1 and touching
    # A disk's middle is brighter than its points are on average, but from afar.
    if k == count - 1 and count % 2 == 1:
        return LightSample(light.position, count, corners, np.zeros(2) if on_disk else None)
    key = [seed, zlib.crc32(light.name.encode())]
    first = tuple(np.random.default_rng(key).random(3))
    radius = light.shadow_soft_size * (1.0 if k % 2 == 0 else -1.0)
    place = radius * _disk_points(first, count)[k // 2]
    if light.is_flat_spot:
        position = light.position + place @ frame_across(light.direction)
    else:
        position = light.position + radius * _ball_points(first, count)[k // 2]
    if not on_disk:
        return LightSample(position, count, corners)
    # Pairs share their turn, so that of each disk both mirrored points are looked from.
    turn = np.random.default_rng([*key, k // 2]).random(3)
    return LightSample(position, count, corners, place, turn)


def _on_area(light: Light, k: int, count: int, seed: int) -> LightSample:
    cell = _cell(light, k, count, seed)
    half = 0.5 * light.extents
    places = (light.position + part @ half for part in (cell.point, cell.corners, cell.spots))
    position, corners, spots = places
    return LightSample(position, count, corners, spots=_shuffled(spots, k, count))


def _on_turned_disk(light: Light, k: int, count: int, seed: int) -> LightSample:
    radius = light.shadow_soft_size
    number = _first_cell(light, seed, count) + k
    cell = disk_cells(count)[number % count]
    place = radius * _balanced_points(count)[number % count]
    corners, spots = (
        np.pad(radius * part, ((0, 0), (0, 1))) for part in (cell.corners, cell.spots)
    )
    return LightSample(
        light.position + place @ frame_across(light.direction),
        count,
        corners,
        place,
        per_receiver=True,
        spots=_shuffled(spots, k, count),
    )


def _shuffled(spots: NDArray[np.float64], k: int, count: int) -> NDArray[np.float64]:
    """A cell's spots so that a pixel looks at other places of the next cell; none of a light's
    single cell, of which the point is the whole light's."""
    return spots[np.arange(SPOTS) ^ (k % SPOTS)] if count > 1 else spots[:0]


def _on_mesh(light: MeshLight, k: int, count: int, seed: int) -> LightSample:
    """Triangles by their share of the power; even over each (E. Heitz, "A Low-Distortion Map
    Between Triangle and Square", 2019)."""
    offset = np.random.default_rng([seed, zlib.crc32(light.name.encode())]).random(3)
    choice, u, v = (offset + k * _MESH_STEPS) % 1.0
    number = min(int(np.searchsorted(light.ends, choice, side="right")), len(light.ends) - 1)
    if v > u:
        u, v = 0.5 * u, v - 0.5 * u
    else:
        u, v = u - 0.5 * v, 0.5 * v
    a, b, c = light.corners[number]
    # What this triangle sends, over how often it is chosen, in units of what all of them send.
    sent = light.areas[number] * light.radiance[number] / light.chances[number]
    total = light.areas @ light.radiance
    tint = np.divide(sent, total, out=np.zeros(3), where=total > 0.0)
    position = (1.0 - u - v) * a + u * b + v * c
    emitter = EmitterPoint(light.normals[number], tint, light.corners[number])
    return LightSample(position, count, emitter=emitter)


def _cell(light: Light, k: int, count: int, seed: int) -> Cell:
    """An area light's or a sun's k-th."""
    if light.type == "SUN":
        return disk_cells(count)[(_first_cell(light, seed, count) + k) % count]
    width, height = np.linalg.norm(light.extents, axis=1)
    # To three digits: lights of nearly one shape share their cells.
    aspect = float(f"{np.clip(width / height, 1e-3, 1e3):.3g}") if width * height > 0.0 else 1.0
    first = _first_cell(light, seed, count, aspect, is_round=light.is_round)
    return _cells(count, aspect, is_round=light.is_round)[(first + k) % count]


def _cells(count: int, aspect: float, *, is_round: bool) -> tuple[Cell, ...]:
    return (disk_cells if is_round else square_cells)(count, aspect)


def _first_cell(
    light: Light, seed: int, count: int, aspect: float = 1.0, *, is_round: bool = True
) -> int:
    """Lights begin at different ones."""
    choices = _good_firsts(count, aspect, is_round=is_round)
    return choices[zlib.crc32(light.name.encode(), seed) % len(choices)]


@lru_cache(maxsize=64)
def _good_firsts(count: int, aspect: float, *, is_round: bool) -> tuple[int, ...]:
    """The cells to begin at so that the light's points and the samples' places in the pixel have
    the least to do with each other: a quarter of them, at least two.

    All pixels share both. A shadow's edge is blurred by the sum of the two, which is sharper or
    softer than it should be where one grows with the other.
    """
    points = np.array([cell.point for cell in _cells(count, aspect, is_round=is_round)])
    places = sobol_points(count) - 0.5
    together = [np.sum((places.T @ np.roll(points, -first, axis=0)) ** 2) for first in range(count)]
    return tuple(int(first) for first in np.argsort(together)[: max(count // 4, 2)])


def _lamp_corners(turn: float) -> NDArray[np.float64]:
    """(CORNERS, 3) around the unit disk, turned by a share of an angle between them.

    What their mean over many samples shows is round.
    """
    (around,) = disk_cells(1)
    angle = 2.0 * np.pi * turn / CORNERS
    rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.pad(around.corners @ rotation, ((0, 0), (0, 1)))


@lru_cache(maxsize=64)
def _ball_points(first: tuple[float, ...], count: int) -> NDArray[np.float64]:
    """(N, 3) in the unit ball, one for each pair; see the module's text."""
    u = (np.array(first) + np.arange((count + 1) // 2)[:, None] * _STEPS) % 1.0
    z = 2.0 * u[:, 0] - 1.0
    around = 2.0 * np.pi * u[:, 1]
    ring = np.sqrt(1.0 - z * z)
    unit = np.stack([ring * np.cos(around), ring * np.sin(around), z], axis=1)
    radius = np.array([_ball_radius(float(value)) for value in u[:, 2]])
    # The mean of r^2 is 3/4.
    return _balanced(radius[:, None] * unit, 0.25)


@lru_cache(maxsize=64)
def _disk_points(first: tuple[float, ...], count: int) -> NDArray[np.float64]:
    """(N, 2) evenly in the unit disk, one for each pair."""
    u = (np.array(first) + np.arange((count + 1) // 2)[:, None] * _STEPS) % 1.0
    around = 2.0 * np.pi * u[:, 1]
    points = np.sqrt(u[:, :1]) * np.stack([np.cos(around), np.sin(around)], axis=1)
    return _balanced(points, 0.25)


@lru_cache(maxsize=64)
def _balanced_points(count: int) -> NDArray[np.float64]:
    """(count, 2) those of the unit disk's cells."""
    return _balanced(np.array([cell.point for cell in disk_cells(count)]), 0.25)


def _balanced(points: NDArray[np.float64], mean_sq: float) -> NDArray[np.float64]:
    """Points, or one of each mirrored pair, stretched a little so that their coordinates'
    mean square is `mean_sq` along all directions: what is quadratic over the lamp is then exact.

    Few points are left as they are; so are pairs that would have to move far.
    """
    if len(points) < 4:
        return points
    found = points.T @ points / len(points)
    values, vectors = np.linalg.eigh(found)
    stretch = np.sqrt(mean_sq / np.maximum(values, 1e-9))
    if stretch.min() < 0.5 or stretch.max() > 2.0:
        return points
    stretched = points @ (vectors * stretch) @ vectors.T
    # Shadows rely on that all are in the ball.
    return np.asarray(stretched / np.maximum(np.linalg.norm(stretched, axis=1), 1.0)[:, None])


def _ball_radius(u: float) -> float:
    """Distance from the centre of a unit ball, for u in [0, 1).

    With r = sin(e / 2) the density r^2 / sqrt(1 - r^2) has the distribution (e - sin e) / pi:
    Kepler's equation. It is convex up to pi, so Newton's method converges from either side.
    """
    mean = np.pi * u
    e = min(np.pi, np.cbrt(9.0 * mean))  # between e^3 / 6 for small e and pi
    for _ in range(12):
        slope = 1.0 - np.cos(e)
        if slope > 0.0:
            e -= (e - np.sin(e) - mean) / slope
    return float(np.sin(0.5 * e))


def _sun_sample(light: Light, k: int, count: int, seed: int) -> LightSample:
    cell = _cell(light, k, count, seed)
    places = np.vstack([cell.point, cell.corners, cell.spots])
    towards = _in_cone(-light.direction, light.angle, places)
    corners, spots = towards[1 : 1 + CORNERS], towards[1 + CORNERS :]
    some = count if light.angle > 0.0 else 1
    return LightSample(towards[0], count, corners, spots=_shuffled(spots, k, some))


def _in_cone(
    axis: NDArray[np.float64], angle: float, disk: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, 3) directions within angle / 2 of the axis, for (N, 2) points of the unit disk; solid
    angles are in proportion to areas."""
    squared = np.sum(disk * disk, axis=1)
    one_minus_cos = np.minimum(2.0 * np.sin(0.25 * angle) ** 2 * squared, 2.0)
    ring = np.sqrt(one_minus_cos * (2.0 - one_minus_cos) / np.where(squared > 0.0, squared, 1.0))
    across = (ring[:, None] * disk) @ frame_across(axis)
    return np.asarray((1.0 - one_minus_cos)[:, None] * axis + across)
