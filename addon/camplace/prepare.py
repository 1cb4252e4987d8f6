# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that the choice of cameras is based on, in the local frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.geometry import SceneGeometry
from ..scene.view import View
from .area_samples import sample_area
from .box import box_about, inside_box
from .moves import moved_view
from .rays import RayCaster
from .samples import Samples, joined_samples, tangent_basis
from .settings import PlacementSettings
from .surface_distance import SurfaceDistance
from .view_samples import pixel_gradient, sample_view, side_seen

# Points that stand for the surface when the nearest one is asked for.
SURFACE_POINTS = 65536
# With many views each still gets this many rays, or a short pan would be sampled too coarsely.
LEAST_RAYS = 64
# Moved copies of each view, and the share of the samples that the views themselves get.
MOVES = 8
OWN_SHARE = 0.5
# What no place near the views sees counts this much against what one sees: the far sides of
# walls and the insides of furniture are large, and no camera move short of a new shot shows them.
HIDDEN = 0.3
# Without a view, surface is to be seen as in a picture of this many pixels across the box.
PICTURE = 1024.0


@dataclass(frozen=True)
class Stage:
    """The scene as the placement sees it.

    Attributes:
        geometry, views: in the local frame.
        moved: for each view, itself from a little elsewhere (`moves`); none where it sees nothing.
        rays: queries against the geometry.
        surface: distances to the geometry.
        box: (2, 3) box of interest.
        samples: view samples, then area samples.
        known_side: (S,) bool, whether a sample's side is one that is looked at; the others have
            their triangle's winding.
        lift: (S,) how far above the surface rays leave each sample.
    """

    geometry: SceneGeometry
    views: tuple[View, ...]
    moved: tuple[tuple[View, ...], ...]
    rays: RayCaster
    surface: SurfaceDistance
    box: NDArray[np.float64]
    samples: Samples
    known_side: NDArray[np.bool_]
    lift: NDArray[np.float64]

    @property
    def seeds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points (N, 3) and normals (N, 3) above which spheres may start.

        Where a view sees a surface, on that side; if no view sees anything, on both sides,
        since which one is outside is not known.
        """
        samples = self.samples
        if self.known_side.any():
            return samples.point[self.known_side], samples.normal[self.known_side]
        return (
            np.concatenate([samples.point, samples.point]),
            np.concatenate([samples.normal, -samples.normal]),
        )

    def settled_by(self, centres: NDArray[np.float64]) -> Stage:
        """Give samples that no view sees their side and weight.

        Places near the views (`_near_views`), then the other `centres` (N, 3) of spheres, stand
        for the space that a camera may look from. A sample is turned to the first that sees it;
        larger spheres come first, so a room decides before the inside of its furniture does. A
        sample that no place near the views sees loses most of its weight.
        """
        near = self._near_views(centres)
        places = np.concatenate([near, centres])
        normal = self.samples.normal.copy()
        unknown = np.flatnonzero(~self.known_side)
        seen_near = self.known_side.copy()
        for number, centre in enumerate(places):
            point = self.samples.point[unknown]
            towards = np.einsum("sx,sx->s", centre - point, normal[unknown])
            side = np.where(towards < 0.0, -1.0, 1.0)
            start = point + (side * self.lift[unknown])[:, None] * normal[unknown]
            seen = ~self.rays.occluded(start, centre)
            normal[unknown[seen]] *= side[seen, None]
            seen_near[unknown[seen]] |= number < len(near)
            unknown = unknown[~seen]
        known = np.ones(len(self.samples), dtype=np.bool_)
        known[unknown] = False
        spread = ~self.samples.from_view
        weight = self.samples.weight.copy()
        weight[spread & ~seen_near] *= HIDDEN
        total = float(weight[spread].sum())
        if total > 0.0:  # it is 0 where the views have all the weight
            weight[spread] *= float(self.samples.weight[spread].sum()) / total
        samples = replace(self.samples, normal=normal, weight=weight)
        return replace(self, samples=samples, known_side=known)

    def _near_views(self, centres: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 3) the views' own places and the centres that one of them sees.

        Without perspective views, all centres are as good as any.
        """
        origins = [view.origin for view in self.views if view.perspective]
        if not origins:
            return centres
        seen = np.zeros(len(centres), dtype=np.bool_)
        for origin in origins:
            seen |= ~self.rays.occluded(centres, np.broadcast_to(origin, centres.shape))
        return np.concatenate([np.array(origins), centres[seen]])


def prepare(
    geometry: SceneGeometry,
    views: tuple[View, ...],
    bounds: NDArray[np.float64] | None,
    settings: PlacementSettings,
    rng: np.random.Generator,
) -> Stage:
    """Sample the surfaces and build what answers questions about them.

    Raises:
        InputError: if the box of interest holds no surface.
    """
    rays = RayCaster(geometry)
    seen, moved = _through_views(geometry, views, rays, settings.view_samples, rng)
    box = box_about((*views, *chain(*moved)), tuple(s.point for s in seen), geometry.bounds)
    if bounds is not None:
        box = bounds
        seen = tuple(s[inside_box(s.point, box)] for s in seen)
    importance = np.where(geometry.camera_visible, geometry.weight, 0.0).astype(np.float64)
    point, triangle = sample_area(geometry, importance, box, settings.area_samples, rng)
    if not len(point) and not any(len(s) for s in seen):
        raise InputError(
            "The box of interest holds no surface that cameras see: move or enlarge it."
        )
    spread, known = _area_samples(
        geometry, views, seen, rays, box=box, point=point, triangle=triangle
    )
    samples, known = _weighted(seen, spread, known, settings.view_share)
    cover, cover_triangle = sample_area(
        geometry, geometry.camera_visible.astype(np.float64), box, SURFACE_POINTS, rng
    )
    surface = SurfaceDistance(
        geometry,
        rays,
        np.concatenate([samples.point, cover]),
        np.concatenate([samples.triangle, cover_triangle]),
    )
    lift = rays.lift(samples.point, samples.triangle)
    return Stage(geometry, views, moved, rays, surface, box, samples, known, lift)


def _through_views(
    geometry: SceneGeometry,
    views: tuple[View, ...],
    rays: RayCaster,
    count: int,
    rng: np.random.Generator,
) -> tuple[tuple[Samples, ...], tuple[tuple[View, ...], ...]]:
    """What the views and their moved copies see, in about `count` samples; and these copies."""
    own = max(LEAST_RAYS, int(OWN_SHARE * count) // max(1, len(views)))
    seen = [sample_view(view, geometry, rays, own, rng) for view in views]
    moved = tuple(
        tuple(moved_view(view, samples, rays, rng) for _ in range(MOVES)) if len(samples) else ()
        for view, samples in zip(views, seen, strict=True)
    )
    each = max(LEAST_RAYS, int((1.0 - OWN_SHARE) * count) // max(1, MOVES * len(views)))
    seen += [sample_view(copy, geometry, rays, each, rng) for copy in chain(*moved)]
    return tuple(seen), moved


def _area_samples(
    geometry: SceneGeometry,
    views: tuple[View, ...],
    seen: tuple[Samples, ...],
    rays: RayCaster,
    *,
    box: NDArray[np.float64],
    point: NDArray[np.float64],
    triangle: NDArray[np.int64],
) -> tuple[Samples, NDArray[np.bool_]]:
    """Samples at area points, and which of them a view sees.

    A point that a view sees is turned to it and wants that view's density. The others want the
    density that is usual for the views, facing them; without a view, that of a picture of the
    whole box.
    """
    normal = geometry.normal_of(triangle)
    footprints = [s.footprint for s in seen if len(s)]
    usual = float(np.linalg.norm(box[1] - box[0])) / PICTURE
    if footprints:
        usual = float(np.median(np.concatenate(footprints)))
    pixels = np.swapaxes(tangent_basis(normal), -1, -2) / usual
    samples = Samples(
        point=point,
        normal=normal,
        weight=np.ones(len(point)),
        pixels=pixels,
        triangle=triangle,
        from_view=np.zeros(len(point), dtype=np.bool_),
    )
    known = np.zeros(len(point), dtype=np.bool_)
    lift = rays.lift(point, triangle)
    for view in views:
        side = np.where(known, 0, side_seen(view, samples, rays, lift))
        new = side != 0
        turned = samples.normal.copy()
        turned[side < 0] *= -1.0
        wanted = samples.pixels.copy()
        wanted[new] = pixel_gradient(view, point[new])
        samples = replace(samples, normal=turned, pixels=wanted)
        known |= new
    return samples, known


def _weighted(
    seen: tuple[Samples, ...], spread: Samples, known: NDArray[np.bool_], view_share: float
) -> tuple[Samples, NDArray[np.bool_]]:
    """All samples with weights that add up to 1, and which of them have a known side."""
    looked_at = sum(float(s.weight.sum()) for s in seen)
    everywhere = float(spread.weight.sum())
    view_share = view_share if looked_at > 0.0 else 0.0
    view_share = view_share if everywhere > 0.0 else 1.0
    parts = [
        replace(s, weight=s.weight * (view_share / looked_at)) for s in seen if looked_at > 0.0
    ]
    if everywhere > 0.0:
        parts.append(replace(spread, weight=spread.weight * ((1.0 - view_share) / everywhere)))
    samples = joined_samples(parts)
    views_know = np.ones(len(samples) - len(spread), dtype=np.bool_)
    return samples, np.concatenate([views_know, known])
