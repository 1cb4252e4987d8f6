# SPDX-License-Identifier: GPL-3.0-or-later
"""Maximal spheres: where primary cameras may stand (paper III.1.A, figure 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .surface_distance import SurfaceDistance, sphere_directions

# Directions in which a sphere looks for surfaces that it may touch.
STAR = 96
# The first seed's distance from the surface and the first move, as shares of the box's diagonal.
SEED_HEIGHT = 1.0 / 256.0
FIRST_MOVE = 1.0 / 32.0
# A move below this share of the box's diagonal changes nothing that a camera could see.
LAST_MOVE = 1.0 / 8192.0
# A move grows or is cut by these factors after it helped or did not.
LONGER, SHORTER = 1.5, 0.5
# Points within this many moves of the sphere's surface touch it: a move that far can close on
# them.
SKIN = 1.0
# The contacts hold a sphere fast when the nearest point of their directions' convex hull is
# this near to the centre: no direction then gains more than this share of a move.
HELD = 0.02
HULL_STEPS = 24
MAX_MOVES = 120
# Two spheres are the same when the centre of one lies within this share of the other's radius:
# a camera in either sees about the same.
SAME = 0.5
# A sphere smaller than this share of the largest one so far is no find: cluttered scenes have
# thousands, in which a camera would see a table leg and little else.
SMALL = 0.2
# Seeds grown at once, and the most that are grown in all, in terms of the paper's k.
BATCH = 64
MOST_SEARCHES = 4


@dataclass(frozen=True)
class Spheres:
    """Maximal spheres, in the frame that they were searched in.

    Attributes:
        centre: (N, 3) float64.
        radius: (N,) float64.
    """

    centre: NDArray[np.float64]
    radius: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.radius)


def joined_spheres(parts: Sequence[Spheres]) -> Spheres:
    """One after the other; at least one part."""
    return Spheres(
        np.concatenate([part.centre for part in parts]),
        np.concatenate([part.radius for part in parts]),
    )


def find_spheres(
    surface: SurfaceDistance,
    box: NDArray[np.float64],
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
    *,
    searches: int,
    rng: np.random.Generator,
) -> Spheres:
    """Search from random surface points until `searches` in a row find no new sphere.

    Args:
        surface: the scene.
        box: (2, 3) the box that bounds the workspace; spheres stay inside.
        point: (S, 3) surface points to start above; those outside the box are not used.
        normal: (S, 3) the side of the surface to start on, unit.
        searches: the paper's k.
        rng: chooses the starting points.

    Returns:
        The spheres, largest first; they differ from each other.
    """
    diagonal = float(np.linalg.norm(box[1] - box[0]))
    seeds = point + SEED_HEIGHT * diagonal * normal
    seeds = seeds[((seeds > box[0]) & (seeds < box[1])).all(axis=-1)]
    seeds = seeds[rng.permutation(len(seeds))[: MOST_SEARCHES * searches]]
    found = Spheres(np.zeros((0, 3)), np.zeros(0))
    in_vain = 0
    for start in range(0, len(seeds), BATCH):
        grown = grow_spheres(surface, box, seeds[start : start + BATCH])
        # A handful of comparisons in order, since "in a row" is about order.
        for centre, radius in zip(grown.centre, grown.radius, strict=True):
            apart = np.linalg.norm(found.centre - centre, axis=-1)
            same = apart < SAME * np.maximum(found.radius, radius)
            largest = max(radius, found.radius.max(initial=0.0))
            small = radius < SMALL * largest
            in_vain = in_vain + 1 if small or same.any() else 0
            if not small and (radius > found.radius[same]).all():
                found = Spheres(
                    np.concatenate([found.centre[~same], centre[None]]),
                    np.concatenate([found.radius[~same], [radius]]),
                )
            if in_vain >= searches:
                break
        if in_vain >= searches:
            break
    order = np.argsort(-found.radius, kind="stable")
    order = order[found.radius[order] >= SMALL * found.radius.max(initial=0.0)]
    return Spheres(found.centre[order], found.radius[order])


def grow_spheres(
    surface: SurfaceDistance, box: NDArray[np.float64], seeds: NDArray[np.float64]
) -> Spheres:
    """Grow every seed (N, 3) into a maximal sphere, all at once.

    The paper enlarges a sphere by small steps until it touches something. Here the largest
    empty radius at a centre is asked for directly, and the centre moves in the direction that
    leaves all contacts behind fastest (`escape_direction`); moves shrink when they stop
    helping, so the centre is found far more finely than the first step.
    """
    diagonal = float(np.linalg.norm(box[1] - box[0]))
    star = sphere_directions(STAR)
    centre = seeds.copy()
    touching = _contacts(surface, box, centre, star)
    radius = _radius(centre, touching)
    move = np.full(len(seeds), FIRST_MOVE * diagonal)
    active = np.arange(len(seeds))
    for _ in range(MAX_MOVES):
        away, freedom = escape_direction(
            touching[active] - centre[active, None], radius[active] + SKIN * move[active]
        )
        trial = np.clip(centre[active] + move[active, None] * away, box[0], box[1])
        trial_touching = _contacts(surface, box, trial, star)
        trial_radius = _radius(trial, trial_touching)
        better = (trial_radius > radius[active]) & (freedom > HELD)
        # A move may not jump through a surface: the new sphere must overlap the old one.
        better &= np.linalg.norm(trial - centre[active], axis=-1) < radius[active] + trial_radius
        better &= ~surface.blocked(centre[active], trial)
        took = active[better]
        centre[took], radius[took] = trial[better], trial_radius[better]
        touching[took] = trial_touching[better]
        move[active] *= np.where(better, LONGER, SHORTER)
        active = active[move[active] > LAST_MOVE * diagonal]
        if not active.size:
            break
    return Spheres(centre, radius)


def escape_direction(
    to_contact: NDArray[np.float64], reach: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The unit direction d that leaves all contacts behind fastest (equation 1).

    Equation 1 asks for d . (r_i - c) <= 0 for all contacts. The d that makes the largest of
    these products (with unit vectors) least is the opposite of the point of the unit vectors'
    convex hull that is nearest to the origin, and the product is then minus its length. That
    point is found by Gilbert's algorithm, for all spheres at once.

    Args:
        to_contact: (N, K, 3), r_i - c; inf where there is none.
        reach: (N,) contacts farther away do not count.

    Returns:
        d (N, 3), and its freedom (N,): how fast the nearest contact is left behind, from 1
        (one contact) to 0 (held fast: the sphere is maximal).
    """
    length = np.linalg.norm(to_contact, axis=-1)
    counts = length <= reach[:, None]
    safe = np.where(counts & (length > 0.0), length, 1.0)[..., None]
    unit = np.where(counts[..., None], to_contact, 0.0) / safe
    first = np.argmin(length, axis=-1)
    row = np.arange(len(unit))
    nearest = unit[row, first]
    for _ in range(HULL_STEPS):
        towards = np.where(counts, np.einsum("nkx,nx->nk", unit, nearest), np.inf)
        corner = unit[row, np.argmin(towards, axis=-1)]
        edge = corner - nearest
        squared = np.einsum("nx,nx->n", edge, edge)
        along = -np.einsum("nx,nx->n", nearest, edge) / np.where(squared > 0.0, squared, 1.0)
        nearest = nearest + np.clip(along, 0.0, 1.0)[:, None] * edge
    freedom = np.linalg.norm(nearest, axis=-1)
    return -nearest / np.where(freedom > 0.0, freedom, 1.0)[:, None], freedom


def _contacts(
    surface: SurfaceDistance,
    box: NDArray[np.float64],
    centre: NDArray[np.float64],
    star: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, K, 3) nearest points on the surfaces and on the six walls of the box."""
    walls = np.repeat(centre[:, None, :], 6, axis=1)
    axis = np.arange(3)
    walls[:, axis, axis] = box[0]
    walls[:, axis + 3, axis] = box[1]
    return np.concatenate([surface.contacts(centre, star), walls], axis=1)


def _radius(centre: NDArray[np.float64], touching: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(touching - centre[:, None], axis=-1).min(axis=-1))
