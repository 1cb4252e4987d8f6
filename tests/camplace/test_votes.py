# SPDX-License-Identifier: GPL-3.0-or-later
"""Votes for places from which what is missing can be seen."""

from __future__ import annotations

import numpy as np

from addon.camplace.coverage import LEAST_COSINE, SEEN
from addon.camplace.grid import Grid
from addon.camplace.rays import RayCaster
from addon.camplace.samples import Samples
from addon.camplace.votes import Ballot, hemisphere_rays, strongest_cells
from addon.scene.geometry import SceneGeometry
from tests.synthetic import box, geometry_of

# Two chambers of 2 x 2 x 2 side by side: x from 0 to 2 and from 2 to 4.
CHAMBERS = geometry_of([box((1, 1, 1), 2.0), box((3, 1, 1), 2.0)])


def _samples(geometry: SceneGeometry, count: int) -> Samples:
    """On the chambers' walls, facing inwards."""
    rng = np.random.default_rng(0)
    triangle = rng.integers(0, len(geometry), count)
    corners = geometry.vertices[geometry.triangles[triangle]]
    point = np.einsum("sc,scx->sx", rng.dirichlet(np.ones(3), count), corners)
    middle = np.where((triangle < 12)[:, None], [1.0, 1, 1], [3.0, 1, 1])
    normal = geometry.normal[triangle]
    inwards = np.sign(np.einsum("sx,sx->s", middle - point, normal))
    normal = normal * inwards[:, None]
    return Samples(
        point=point,
        normal=normal,
        weight=np.full(count, 1.0 / count),
        pixels=np.tile([[1.0, 0, 0], [0, 1.0, 0]], (count, 1, 1)) + 0.3,
        triangle=triangle,
        from_view=np.ones(count, dtype=np.bool_),
    )


def test_the_pocket_that_is_not_seen_gets_all_votes() -> None:
    samples = _samples(CHAMBERS, 1500)
    rays = RayCaster(CHAMBERS)
    grid = Grid.over(CHAMBERS.bounds, 32)
    ballot = Ballot(
        samples,
        rays.lift(samples.point, samples.triangle),
        grid,
        rays,
        count=12,
        resolution=2048,
        rng=np.random.default_rng(1),
    )
    left = samples.triangle < 12
    votes = ballot.count(np.where(left, 0.0, 1.0))
    assert votes[:16].sum() > 0.0
    assert votes[16:].sum() == 0.0
    places = grid.centres(strongest_cells(votes, 10))
    assert len(places) > 0
    assert (places[:, 0] < 2.0).all()
    # All of the chamber is seen from anywhere in it; what rays spread is undone, so its middle
    # is as good as its walls, and walls do not take all the strongest cells.
    assert (np.abs(places[0] - 1.0) < 0.9).all()
    assert ballot.count(np.ones(len(samples))).sum() == 0.0


def test_poorly_seen_samples_vote_for_places_close_enough_to_help() -> None:
    samples = _samples(CHAMBERS, 800)
    rays = RayCaster(CHAMBERS)
    grid = Grid.over(CHAMBERS.bounds, 32)
    # A pixel's footprint is about 1 here; a texel of a 2-texel picture is that large at d = 1.
    ballot = Ballot(
        samples,
        rays.lift(samples.point, samples.triangle),
        grid,
        rays,
        count=12,
        resolution=1,
        rng=np.random.default_rng(1),
    )
    some, none = ballot.count(np.full(800, SEEN + 0.3 * (1.0 - SEEN))), ballot.count(np.zeros(800))
    assert 0.0 < some.sum() < none.sum()
    assert ballot.count(np.ones(800)).sum() == 0.0
    assert np.count_nonzero(
        ballot.count(np.full(800, SEEN + 0.9 * (1.0 - SEEN)))
    ) < np.count_nonzero(some)


def test_rays_fill_the_part_of_the_hemisphere_that_covers() -> None:
    samples = _samples(CHAMBERS, 2000)
    directions = hemisphere_rays(samples, 12, np.random.default_rng(2))
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-12)
    cosine = np.einsum("srx,sx->sr", directions, samples.normal)
    assert (cosine >= LEAST_COSINE - 1e-12).all()
    # Even over a cap of the sphere means even in the cosine; one ray in each twelfth of it.
    counts, _ = np.histogram(cosine, bins=12, range=(LEAST_COSINE, 1.0))
    np.testing.assert_allclose(counts, 2000, atol=1)
    # All ways round: the part along the surface averages out (five standard errors).
    flat = directions - cosine[..., None] * samples.normal[:, None]
    assert (np.abs(flat.mean(axis=(0, 1))) < 5 / np.sqrt(2000)).all()


def test_strongest_cells_are_apart_and_in_order() -> None:
    votes = np.zeros((20, 20, 20))
    votes[5, 5, 5], votes[5, 5, 7], votes[15, 3, 4] = 9.0, 8.0, 7.0
    cells = strongest_cells(votes, 5)
    places = np.stack(np.unravel_index(cells, votes.shape), axis=-1)
    # (5, 5, 6) catches both neighbours when votes are averaged; each alone is no peak.
    assert np.abs(places[0] - [5, 5, 6]).max() <= 1
    assert (np.abs(places - [15, 3, 4]).max(axis=-1) <= 1).any()
    assert strongest_cells(np.zeros((4, 4, 4)), 3).size == 0
