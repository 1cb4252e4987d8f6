# SPDX-License-Identifier: GPL-3.0-or-later
"""How much caching cameras see, measured on fresh samples: not those that placed them.

Two questions are asked, each of a sample of surface points drawn with a seed of its own:

* Of what the shot's views see, and of what they see when they are moved by up to a tenth of
  their viewing distance, how much is seen and well seen? Points are shot through pixels.
* Of all surface that any free point can see, by area, how much is?

A point is *seen* when a camera has a free line of sight to it, from its own side, in the
picture. It is *well seen* when that is at a usable angle and with texels no longer than
`addon.camplace.coverage.WELL_TEXEL` pixels of the view.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from addon.camplace.area_samples import sample_area
from addon.camplace.box import inside_box
from addon.camplace.camera import CachingCamera
from addon.camplace.coverage import seen_by, well_seen_by
from addon.camplace.frame import LocalFrame
from addon.camplace.moves import moved_view
from addon.camplace.rays import RayCaster
from addon.camplace.samples import Samples, joined_samples, tangent_basis
from addon.camplace.view_samples import pixel_gradient, sample_view, side_seen
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

# Moved copies of each view.
MOVES = 4
# Rays through the pixels of each view or moved view; points drawn by area.
RAYS = 1500
AREA_POINTS = 4000
# Random points of the box that stand for all of its free space.
FREE_POINTS = 512
# Without a view, surface is to be seen as in a picture of this many pixels across the box.
PICTURE = 1024.0


@dataclass(frozen=True)
class Shares:
    """What part of the fresh samples the cameras see, 0 to 1.

    Attributes:
        view_seen, view_well: of what the views and the moved views see; NaN without views.
        area_seen, area_well: of the surface, by area, that some free point can see; NaN where
            there is none.
    """

    view_seen: float
    view_well: float
    area_seen: float
    area_well: float


class FreshSamples:
    """Samples of a scene that no camera was placed by, and the rays that ask about them."""

    def __init__(
        self,
        geometry: SceneGeometry,
        views: Sequence[View],
        box: NDArray[np.float64],
        seed: int = 1_000_003,
    ) -> None:
        """Sample the scene.

        Args:
            geometry: the scene, in metres and world space.
            views: the shot's; may be none.
            box: (2, 3) the box of interest of the placement that is judged, metres.
            seed: of these samples; the placement's own seeds are small numbers.
        """
        rng = np.random.default_rng(seed)
        self.frame = LocalFrame.of(geometry, tuple(views), box)
        self.geometry = self.frame.geometry_from_world(geometry)
        self.views = tuple(self.frame.view_from_world(view) for view in views)
        self.box = self.frame.from_world(np.asarray(box, dtype=np.float64))
        self.rays = RayCaster(self.geometry)
        through = [sample_view(v, self.geometry, self.rays, RAYS, rng) for v in self.views]
        self.moved = tuple(
            moved_view(view, seen, self.rays, rng)
            for view, seen in zip(self.views, through, strict=True)
            if len(seen)
            for _ in range(MOVES)
        )
        through += [sample_view(v, self.geometry, self.rays, RAYS, rng) for v in self.moved]
        through = [s[inside_box(s.point, self.box)] for s in through]
        through = [s for s in through if len(s)]
        region = free_region(self.geometry, self.views, self.box)
        points = rng.uniform(region[0], region[1], (FREE_POINTS, 3))
        self.free = free_among(points, self.views, self.rays)
        self.by_view = joined_samples(through) if through else None
        self.by_area = self._seen_from_free(rng)

    def measure(self, cameras: Sequence[CachingCamera]) -> Shares:
        """What `cameras`, in metres and world space, see of the samples."""
        local = [self.frame.camera_from_world(camera) for camera in cameras]
        return Shares(*self._shares(self.by_view, local), *self._shares(self.by_area, local))

    def _shares(
        self, samples: Samples | None, cameras: Sequence[CachingCamera]
    ) -> tuple[float, float]:
        """Seen and well seen, 0 to 1; NaN where there is nothing to be seen."""
        total = 0.0 if samples is None else float(samples.weight.sum())
        if samples is None or not total > 0.0:
            return float("nan"), float("nan")
        lift = self.rays.lift(samples.point, samples.triangle)
        seen = np.zeros(len(samples), dtype=np.bool_)
        well = np.zeros(len(samples), dtype=np.bool_)
        for camera in cameras:
            index = seen_by(camera, samples, lift, self.rays)
            seen[index] = True
            well[well_seen_by(camera, samples, index)] = True
        return float(samples.weight @ seen) / total, float(samples.weight @ well) / total

    def _seen_from_free(self, rng: np.random.Generator) -> Samples | None:
        """Points by area, once for each side that some free point sees."""
        importance = np.where(self.geometry.camera_visible, self.geometry.weight, 0.0)
        point, triangle = sample_area(
            self.geometry, importance.astype(np.float64), self.box, AREA_POINTS, rng
        )
        if not len(point):
            return None
        sides = [self._side(point, triangle, side) for side in (1.0, -1.0)]
        samples = joined_samples(sides)
        lift = self.rays.lift(samples.point, samples.triangle)
        rest = np.arange(len(samples))
        for place in self.free:
            towards = place - samples.point[rest]
            faces = np.einsum("sx,sx->s", towards, samples.normal[rest]) > 0.0
            ask = rest[faces]
            start = samples.point[ask] + lift[ask, None] * samples.normal[ask]
            rest = np.setdiff1d(rest, ask[~self.rays.occluded(start, place)])
        found = np.ones(len(samples), dtype=np.bool_)
        found[rest] = False
        return samples[found] if found.any() else None

    def _side(
        self, point: NDArray[np.float64], triangle: NDArray[np.int64], side: float
    ) -> Samples:
        """One side of area points, asking for the density of a view that sees it, or the usual."""
        normal = side * self.geometry.normal[triangle]
        usual = float(np.linalg.norm(self.box[1] - self.box[0])) / PICTURE
        if self.by_view is not None:
            usual = float(np.median(self.by_view.footprint))
        samples = Samples(
            point=point,
            normal=normal,
            weight=np.ones(len(point)),
            pixels=np.swapaxes(tangent_basis(normal), -1, -2) / usual,
            triangle=triangle,
            from_view=np.zeros(len(point), dtype=np.bool_),
        )
        lift = self.rays.lift(point, triangle)
        pixels = samples.pixels.copy()
        known = np.zeros(len(point), dtype=np.bool_)
        for view in self.views:
            new = (side_seen(view, samples, self.rays, lift) > 0) & ~known
            pixels[new] = pixel_gradient(view, point[new])
            known |= new
        return replace(samples, pixels=pixels)


def free_region(
    geometry: SceneGeometry, views: Sequence[View], box: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(2, 3) the part of the box (2, 3) that the scene's bounds and the views' places span.

    The box is a little larger, so that surfaces lie inside it. Nobody looks from that margin:
    it is behind the scene's outermost walls and under its ground.
    """
    within = np.concatenate([geometry.bounds, *(v.origin[None] for v in views if v.perspective)])
    return np.stack(
        [np.maximum(box[0], within.min(axis=0)), np.minimum(box[1], within.max(axis=0))]
    )


def free_among(
    points: NDArray[np.float64], views: Sequence[View], rays: RayCaster
) -> NDArray[np.float64]:
    """(N, 3) those of `points` that can be reached, with the perspective views' places first.

    Free space is what lines of sight join to the views, from point to point and so through
    doors; the insides of solids are never joined. Without a perspective view it is the largest
    set of points that are joined.
    """
    starts = np.array([view.origin for view in views if view.perspective]).reshape(-1, 3)
    if len(starts):
        return np.concatenate([starts, points[_joined_to(starts, points, rays)]])
    rest = np.arange(len(points))
    best = rest[:0]
    while len(rest) > len(best):
        joined = rest[_joined_to(points[rest[:1]], points[rest], rays)]
        best = joined if len(joined) > len(best) else best
        rest = np.setdiff1d(rest, np.union1d(joined, rest[:1]))
    return points[best]


def _joined_to(
    starts: NDArray[np.float64], points: NDArray[np.float64], rays: RayCaster
) -> NDArray[np.int64]:
    """Indices of `points` (N, 3) that lines of sight join to `starts` (M, 3), in order."""
    joined = np.zeros(len(points), dtype=np.bool_)
    front = list(starts)
    while front:
        place = front.pop()
        rest = np.flatnonzero(~joined)
        if not rest.size:
            break
        new = rest[~rays.occluded(points[rest], place)]
        joined[new] = True
        front += list(points[new])
    return np.flatnonzero(joined)
