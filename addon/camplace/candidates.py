# SPDX-License-Identifier: GPL-3.0-or-later
"""The perspective camera that gains most, among all places that were ever proposed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .aim import aimed_camera
from .camera import CachingCamera
from .places import Proposer, Sights
from .prepare import Stage

# Samples by which proposed places are compared, and how many of the places are then kept.
SCREENED = 1024
FINALISTS = 8


class Candidates:
    """Places, and the most that a camera there may gain.

    What is gained at a place only falls while cameras are added, so what it was when last asked
    bounds what it is now, and most places need not be asked again (Minoux, "Accelerated greedy
    algorithms for maximizing submodular set functions", 1978). That would be exact if cameras
    were aimed as well as can be; they are aimed well (`aimed_camera`).
    """

    def __init__(
        self,
        stage: Stage,
        sights: Sights,
        places: NDArray[np.float64],
        propose: Proposer,
        resolution: int,
    ) -> None:
        """`places` (N, 3) are always tried, `propose` gives more; pictures have `resolution`."""
        self._stage = stage
        self._sights = sights
        self._propose = propose
        self._resolution = resolution
        self._places: list[NDArray[np.float64]] = []
        self._most: list[float] = []
        self._add(list(places))

    def forget(self) -> None:
        """Call when cameras were taken away: places may gain more again."""
        self._most = [np.inf] * len(self._places)

    def best(self, worth: NDArray[np.float64]) -> CachingCamera | None:
        """The camera that gains most; None if none gains anything.

        `worth` (S,) is what samples are worth as they are seen so far.
        """
        lack = self._stage.samples.weight * (1.0 - worth)
        self._propose_more(worth, lack)
        for number, place in enumerate(self._places):
            held = float(lack[self._sights.of(place)].sum())
            self._most[number] = min(self._most[number], held)
        best: CachingCamera | None = None
        most = 0.0
        for number in np.argsort(np.negative(self._most), kind="stable").tolist():
            if self._most[number] <= most:
                break
            visible = self._sights.of(self._places[number])
            camera, gained = self._aimed(self._places[number], visible[lack[visible] > 0.0], worth)
            self._most[number] = min(self._most[number], gained)
            if gained > most:
                best, most = camera, gained
        return best

    def _propose_more(self, worth: NDArray[np.float64], lack: NDArray[np.float64]) -> None:
        """Add the best of the newly proposed places, compared by some of the samples."""
        wanted = np.flatnonzero(lack > 0.0)
        thin = wanted[:: max(1, len(wanted) // SCREENED)]
        places = self._propose(worth)
        gained = np.zeros(len(places))
        for number, visible in enumerate(self._sights.among(list(places), thin)):
            gained[number] = self._aimed(places[number], visible, worth)[1]
        # A stable order, so that the same places win each time.
        finalists = np.argsort(-gained, kind="stable")[:FINALISTS]
        self._add([places[number] for number in finalists])

    def _add(self, places: list[NDArray[np.float64]]) -> None:
        known = {place.tobytes() for place in self._places}
        new = [place for place in places if place.tobytes() not in known]
        self._sights.ask(new)
        self._places += new
        self._most += [np.inf] * len(new)

    def _aimed(
        self, place: NDArray[np.float64], visible: NDArray[np.int64], worth: NDArray[np.float64]
    ) -> tuple[CachingCamera | None, float]:
        """The best camera at `place` (3,) for what it sees (V,), and what is gained by it."""
        if not visible.size:
            return None, 0.0
        camera, _, gained = aimed_camera(
            place, self._stage.samples, visible, worth, self._resolution
        )
        return camera, gained
