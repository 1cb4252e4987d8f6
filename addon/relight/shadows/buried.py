# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that lie in another triangle too, and so get no light, see `coincident`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...scene.coincident import LEAST_OVERLAP, in_plane
from ...scene.plane_cells import PlaneCells

if TYPE_CHECKING:
    from ...corrmap.local_scene import LocalScene
    from .receivers import Receivers


class BuriedPlaces:
    """Finds them among a scene's triangles.

    Attributes:
        exist: whether there can be any.

    Args:
        scene: the triangles.
        stoppers: (T,) which of them stop all light.
    """

    def __init__(self, scene: LocalScene, stoppers: NDArray[np.bool_]) -> None:
        known = scene.coincident
        some = stoppers[known.triangles]
        self._owner = known.triangles[some]
        self.exist = len(self._owner) > 0
        if not self.exist:
            return
        self._plane = np.full(len(stoppers) + 1, -1, dtype=np.int64)
        self._axis = np.zeros(len(stoppers) + 1, dtype=np.int64)
        # The last is of triangles that are not known.
        self._plane[known.triangles], self._axis[known.triangles] = known.plane, known.axis
        corners = scene.geometry.vertices[scene.geometry.triangles[self._owner]]
        self._corners = in_plane(corners, known.axis[some])
        self._cells = PlaneCells(known.plane[some], self._corners)

    def of(self, receivers: Receivers, number: NDArray[np.integer]) -> NDArray[np.bool_]:
        """(R,) whether some of the receivers (R,) are such places."""
        found = np.zeros(len(number), dtype=np.bool_)
        if not self.exist:
            return found
        plane = self._plane.take(receivers.triangle.take(number), mode="wrap")
        row = np.flatnonzero(plane >= 0)
        triangle = receivers.triangle.take(number[row])
        place = in_plane(receivers.place.take(number[row], axis=1).T, self._axis.take(triangle))
        at = np.ascontiguousarray(place.T)
        for a, b in self._cells.near(plane[row], at, at):
            other = self._owner.take(b) != triangle.take(a)
            holds = _holds(self._corners[b[other]], place[a[other]])
            found[row[a[other][holds]]] = True
        return found


def _holds(corners: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(P,) whether triangles (P, 3, 2) hold places (P, 2), and not just on an edge: there are
    their neighbours, which are in their plane too."""
    x, y = np.moveaxis(corners - place[:, None], -1, 0)
    next_x, next_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    length = np.hypot(next_x - x, next_y - y)
    above = (x * next_y - next_x * y) / length
    least = LEAST_OVERLAP * length.max(axis=1)
    return np.asarray((above.min(axis=1) > least) | (above.max(axis=1) < -least))
