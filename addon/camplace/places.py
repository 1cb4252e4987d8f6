# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that are tried for perspective cameras."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .box import inside_box
from .coverage import visible_from_each
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
# Cells looked at for each candidate wanted, since those near surfaces fall away.
SPARE_CELLS = 6
# Places from which rays are cast together: enough to outweigh the calls, few enough for memory.
AT_ONCE = 8

# A place near a view may be this much nearer to a surface than the view is.
LEAST_CLEAR = 0.5

# Gives (N, 3) places for what samples (S,) are worth as they are seen so far.
Proposer = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class VotedPlaces:
    """The strongest cells of the ray votes (paper III.1.B) that keep clear of surfaces."""

    def __init__(self, stage: Stage, settings: PlacementSettings, rng: np.random.Generator) -> None:
        self._stage = stage
        self._count = settings.candidates
        self._grid = Grid.over(stage.box, settings.grid_cells)
        self._ballot = Ballot(
            stage.samples,
            stage.lift,
            self._grid,
            stage.rays,
            count=settings.rays,
            resolution=settings.max_resolution,
            rng=rng,
        )

    def __call__(self, worth: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 3) places for samples that are worth (S,) so far, best first."""
        votes = self._ballot.count(worth)
        places = self._grid.centres(strongest_cells(votes, self._count * SPARE_CELLS))
        return clear_places(self._stage, places, self._grid.cell)[: self._count]


def clear_places(stage: Stage, places: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
    """(N, 3) those of `places` in the box and `CLEARANCE` cells away from every surface."""
    places = places[inside_box(places, stage.box)]
    if not len(places):
        return places
    clear = stage.surface.distance(places, sphere_directions(STAR))
    return places[clear >= CLEARANCE * cell]


class Sights:
    """Which samples places see; what was asked once is known.

    Attributes:
        reached: (S,) bool, samples that some place asked about sees.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._known: dict[bytes, NDArray[np.int64]] = {}
        self.reached = np.zeros(len(stage.samples), dtype=np.bool_)

    def of(self, place: NDArray[np.float64]) -> NDArray[np.int64]:
        """(V,) all samples that a camera at `place` (3,) sees in any direction."""
        self.ask([place])
        return self._known[place.tobytes()]

    def ask(self, places: Sequence[NDArray[np.float64]]) -> None:
        """Find out what (3,) `places` see, several at once; `of` then knows."""
        new = [place for place in places if place.tobytes() not in self._known]
        everything = np.arange(len(self.reached))
        for start in range(0, len(new), AT_ONCE):
            some = new[start : start + AT_ONCE]
            for place, seen in zip(some, self.among(some, everything), strict=True):
                self._known[place.tobytes()] = seen
                self.reached[seen] = True

    def among(
        self, places: Sequence[NDArray[np.float64]], wanted: NDArray[np.int64]
    ) -> list[NDArray[np.int64]]:
        """For each of the (3,) `places` those of the samples `wanted` (W,) that it sees."""
        stage = self._stage
        if not len(places):
            return []
        return visible_from_each(np.array(places), stage.samples, stage.lift, stage.rays, wanted)


def fixed_places(
    stage: Stage, spheres: Spheres, near: Spheres, settings: PlacementSettings
) -> NDArray[np.float64]:
    """(N, 3) places that are always tried: the largest spheres' centres, and some near the views.

    Centres are few, far from surfaces, and see much. The views' own places are tried on request
    only.
    """
    fixed = [spheres.centre[: settings.candidates // 2], near.centre]
    if settings.offer_views:
        places = [view.origin for view in stage.views if view.perspective]
        fixed.append(np.array(places).reshape(-1, 3))
    return np.concatenate(fixed)


def near_spheres(stage: Stage) -> Spheres:
    """Empty spheres about the places that the shot's views may move to.

    What a view sees through leaves, or past a pillar, is seen best from near it; sphere centres
    and votes are seldom there. Places much nearer to a surface than their view are left out.
    """
    star = sphere_directions(STAR)
    centre, radius = [np.zeros((0, 3))], [np.zeros(0)]
    for view, moved in zip(stage.views, stage.moved, strict=True):
        places = np.array([copy.origin for copy in moved]).reshape(-1, 3)
        places = places[inside_box(places, stage.box)]
        if view.perspective and len(places):
            clear, least = np.split(
                stage.surface.distance(np.concatenate([places, view.origin[None]]), star), [-1]
            )
            far = clear >= LEAST_CLEAR * least
            centre.append(places[far])
            radius.append(clear[far])
    return Spheres(np.concatenate(centre), np.concatenate(radius))
