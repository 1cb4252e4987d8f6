# SPDX-License-Identifier: GPL-3.0-or-later
"""The greedy choice of cameras by what they really add."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..progress import Progress
from .aim import aimed_camera, cube_cameras
from .box import inside_box
from .camera import CachingCamera
from .coverage import Seen, gain, joined, score, seen_by_camera, visible_from
from .grid import Grid
from .prepare import Stage
from .settings import PlacementSettings
from .spheres import Spheres
from .surface_distance import sphere_directions
from .votes import Ballot, strongest_cells

# A camera keeps at least this many cells from every surface. Nearer, its picture is filled with
# one small patch, and a surface that the samples missed could hide all else.
CLEARANCE = 1.5
# Directions in which the nearest surface is looked for.
STAR = 64
# Samples on which all candidates are tried, and how many of these are then tried on all samples.
SCREENED = 2048
FINALISTS = 8
# Cells looked at for each candidate wanted, since those near surfaces fall away.
SPARE_CELLS = 6


@dataclass(frozen=True)
class Choice:
    """A chosen camera, in the local frame and at the highest resolution, and what it covers."""

    camera: CachingCamera
    seen: Seen


def choose_primaries(
    stage: Stage, spheres: Spheres, quality: NDArray[np.float64], settings: PlacementSettings
) -> tuple[list[Choice], NDArray[np.float64]]:
    """Up to `settings.primaries` cubes at sphere centres, greedily by gain.

    A face that covers no sample is left out: it would be baked for nothing.

    Returns:
        The cameras, and the quality (S,) with which samples are seen with them.
    """
    everything = np.arange(len(stage.samples))
    offers: list[list[Choice]] = []
    for source in range(min(len(spheres), settings.candidates)):
        visible = visible_from(
            spheres.centre[source], stage.samples, stage.lift, stage.rays, everything
        )
        faces = cube_cameras(spheres.centre[source], settings.max_resolution)
        offers.append(
            [
                Choice(replace(face, source=source), seen_by_camera(face, stage.samples, visible))
                for face in faces
            ]
        )
    chosen: list[Choice] = []
    for _ in range(settings.primaries):
        gains = [_cube_gain(offer, quality, stage.samples.weight) for offer in offers]
        if not gains or max(gains) < settings.least_gain:
            break
        best = offers.pop(int(np.argmax(gains)))
        chosen += [choice for choice in best if choice.seen.index.size]
        for choice in best:
            quality = joined(quality, choice.seen)
    return chosen, quality


def choose_secondaries(
    stage: Stage,
    spheres: Spheres,
    quality: NDArray[np.float64],
    settings: PlacementSettings,
    *,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[list[Choice], NDArray[np.float64]]:
    """Up to `settings.secondaries` perspective cameras, each the best of the voted places.

    Centres of spheres are offered too: they are few, far from surfaces, and see much.

    Returns:
        The cameras, and the quality (S,) with which samples are seen with them.
    """
    chosen: list[Choice] = []
    if not settings.secondaries:
        return chosen, quality
    grid = Grid.over(stage.box, settings.grid_cells)
    ballot = Ballot(
        stage.samples,
        stage.lift,
        grid,
        stage.rays,
        count=settings.rays,
        resolution=settings.max_resolution,
        rng=rng,
    )
    fixed = spheres.centre[: settings.candidates // 2]
    if settings.offer_views:
        places = [view.origin for view in stage.views if view.perspective]
        fixed = np.concatenate([fixed, np.array(places).reshape(-1, 3)])
    for source in range(settings.secondaries):
        progress(0.55 + 0.4 * source / settings.secondaries, "Choosing secondary cameras")
        voted = _voted_places(stage, grid, ballot.count(quality), settings.candidates)
        best = _best_of(stage, np.concatenate([voted, fixed]), quality, settings)
        if best is None:
            break
        chosen.append(Choice(replace(best.camera, source=source), best.seen))
        quality = joined(quality, best.seen)
    return chosen, quality


def _cube_gain(
    faces: list[Choice], quality: NDArray[np.float64], weight: NDArray[np.float64]
) -> float:
    """What a whole cube adds; its faces share only the samples on their edges."""
    total = 0.0
    for face in faces:
        total += gain(face.seen, quality, weight)
        quality = joined(quality, face.seen)
    return total


def _voted_places(
    stage: Stage, grid: Grid, votes: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """(N, 3) the strongest cells' centres that keep clear of surfaces, N <= count."""
    places = grid.centres(strongest_cells(votes, count * SPARE_CELLS))
    places = places[inside_box(places, stage.box)]
    if not len(places):
        return places
    clear = stage.surface.distance(places, sphere_directions(STAR))
    return places[clear >= CLEARANCE * grid.cell][:count]


def _best_of(
    stage: Stage,
    places: NDArray[np.float64],
    quality: NDArray[np.float64],
    settings: PlacementSettings,
) -> Choice | None:
    """The camera that gains most among those at `places` (N, 3); None if none gains enough.

    With many samples, all places are first tried on some of them, and the best few on all.
    """
    lacking = np.flatnonzero(stage.samples.weight * (1.0 - score(quality)) > 0.0)
    thin = max(1, len(lacking) // SCREENED)
    if thin > 1:
        rough = [
            _camera_at(stage, place, lacking[::thin], quality, settings)[1] for place in places
        ]
        places = places[np.argsort(-np.array(rough), kind="stable")[:FINALISTS]]
    best: CachingCamera | None = None
    most = settings.least_gain
    for place in places:
        camera, gained = _camera_at(stage, place, lacking, quality, settings)
        if gained > most:
            best, most = camera, gained
    if best is None:
        return None
    everything = np.arange(len(stage.samples))
    visible = visible_from(best.origin, stage.samples, stage.lift, stage.rays, everything)
    return Choice(best, seen_by_camera(best, stage.samples, visible))


def _camera_at(
    stage: Stage,
    place: NDArray[np.float64],
    wanted: NDArray[np.int64],
    quality: NDArray[np.float64],
    settings: PlacementSettings,
) -> tuple[CachingCamera | None, float]:
    """The best camera at `place` (3,) for the samples `wanted` (W,), and what they gain by it."""
    visible = visible_from(place, stage.samples, stage.lift, stage.rays, wanted)
    if not visible.size:
        return None, 0.0
    camera, _, gained = aimed_camera(
        place, stage.samples, visible, quality, settings.max_resolution
    )
    return camera, gained
