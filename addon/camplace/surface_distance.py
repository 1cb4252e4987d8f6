# SPDX-License-Identifier: GPL-3.0-or-later
"""How far points are from the nearest surface, and where the surfaces about them are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..scene.closest_point import closest_on_triangle
from ..scene.geometry import SceneGeometry
from .parallel import in_parts
from .rays import RayCaster

# Nearest surface points looked at for each place: a few, since the nearest point need not lie
# on the nearest triangle.
NEAREST = 6
# Places whose triangles one thread looks at together: few enough to stay in a processor's cache.
PLACES = 16


class SurfaceDistance:
    """Answers with points on triangles, exact for every triangle that it looks at.

    It looks at the triangles of the nearest surface points (small things close by), and at
    those that a star of rays meets (large things all around). A triangle smaller than the
    points' spacing and missed by the star can be overlooked, and then only until the place is
    about one spacing away.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        rays: RayCaster,
        points: NDArray[np.float64],
        triangle: NDArray[np.int64],
    ) -> None:
        """`points` (N, 3) lie on `triangle` (N,) and stand for the surface."""
        self._geometry = geometry
        self._rays = rays
        self._tree = cKDTree(points)
        self._triangle = triangle

    def contacts(
        self, places: NDArray[np.float64], star: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Nearest points on the triangles about each place.

        Args:
            places: (N, 3).
            star: (D, 3) unit directions to look in.

        Returns:
            (N, NEAREST + D, 3) surface points; inf where a ray meets nothing.
        """
        count = min(NEAREST, len(self._triangle))
        _, nearest = self._tree.query(places, k=count)
        near_triangle = self._triangle[nearest.reshape(len(places), count)]
        hits = self._rays.first_triangle(
            np.repeat(places, len(star), axis=0), np.tile(star, (len(places), 1))
        )
        triangle = np.concatenate(
            [near_triangle, hits.triangle.reshape(len(places), len(star))], axis=1
        )
        points = np.full((*triangle.shape, 3), np.inf)

        def nearest_on(part: slice) -> None:
            place, number = np.nonzero(triangle[part] >= 0)
            place += part.start
            corners = self._geometry.vertices[self._geometry.triangles[triangle[place, number]]]
            points[place, number] = closest_on_triangle(places[place], corners)

        in_parts(nearest_on, len(places), PLACES)
        return points

    def distance(
        self, places: NDArray[np.float64], star: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(N,) distances from (N, 3) places to the nearest surface found."""
        gap = self.contacts(places, star) - places[:, None, :]
        return np.asarray(np.sqrt((gap * gap).sum(axis=-1)).min(axis=-1))

    def blocked(
        self, places: NDArray[np.float64], others: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(N,) whether a surface lies between two places (N, 3) and (N, 3)."""
        return self._rays.occluded(places, others)


def sphere_directions(count: int) -> NDArray[np.float64]:
    """(count, 3) unit directions spread evenly (a Fibonacci spiral)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)
