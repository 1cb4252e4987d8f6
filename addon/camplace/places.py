# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that are tried for perspective cameras."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .box import inside_box
from .coverage import visible_from
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

# Gives (N, 3) places for the quality (S,) with which samples are seen so far.
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

    def __call__(self, quality: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 3) places for what is seen with `quality` (S,) so far, best first."""
        votes = self._ballot.count(quality)
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
        reached: (S,) bool, samples that some place asked about sees at a usable angle.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._known: dict[bytes, NDArray[np.int64]] = {}
        self.reached = np.zeros(len(stage.samples), dtype=np.bool_)

    def of(self, place: NDArray[np.float64]) -> NDArray[np.int64]:
        """(V,) all samples that a camera at `place` (3,) sees in any direction."""
        key = place.tobytes()
        if key not in self._known:
            self._known[key] = self._ask(place, np.arange(len(self.reached)))
            self.reached[self._known[key]] = True
        return self._known[key]

    def among(
        self,
        place: NDArray[np.float64],
        wanted: NDArray[np.int64],
        is_wanted: NDArray[np.bool_],
    ) -> NDArray[np.int64]:
        """(V,) those of the samples `wanted` (W,) that a camera at `place` (3,) sees.

        `is_wanted` (S,) says the same as `wanted`.
        """
        known = self._known.get(place.tobytes())
        return self._ask(place, wanted) if known is None else known[is_wanted[known]]

    def _ask(self, place: NDArray[np.float64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        stage = self._stage
        return visible_from(place, stage.samples, stage.lift, stage.rays, wanted)


def fixed_places(
    stage: Stage, spheres: Spheres, settings: PlacementSettings
) -> NDArray[np.float64]:
    """(N, 3) places that are always tried: the largest spheres' centres, and the views'.

    Centres are few, far from surfaces, and see much. Views are tried on request only.
    """
    fixed = spheres.centre[: settings.candidates // 2]
    if settings.offer_views:
        places = [view.origin for view in stage.views if view.perspective]
        fixed = np.concatenate([fixed, np.array(places).reshape(-1, 3)])
    return fixed
