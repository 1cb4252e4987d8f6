# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells near a surface do not win for no other reason than that rays are dense there."""

from __future__ import annotations

import numpy as np

from addon.camplace.grid import Grid
from addon.camplace.rays import RayCaster
from addon.camplace.samples import Samples
from addon.camplace.votes import Ballot
from tests.synthetic import geometry_of

SHEET = np.array([[0, 1, 2], [0, 2, 3]])
SIDE = 64
SAMPLES = 2000


def _votes_above_a_small_patch() -> tuple[np.ndarray, np.ndarray]:
    """Distances (N,) of cells from a patch that is not seen yet, in cells, and their votes.

    The patch lies in the middle of the floor, and is far smaller than a cell. All of the cells
    are within 45 degrees of straight above it, where as many rays go each way.
    """
    floor = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * SIDE
    rays = RayCaster(geometry_of([(floor, SHEET)]))
    place = np.zeros((SAMPLES, 3))
    place[:, :2] = np.random.default_rng(0).uniform(-0.05, 0.05, (SAMPLES, 2))
    samples = Samples(
        point=place,
        normal=np.tile([0.0, 0.0, 1.0], (SAMPLES, 1)),
        weight=np.full(SAMPLES, 1.0 / SAMPLES),
        # A pixel is as large as the room: sharpness plays no part.
        pixels=np.tile([[1.0, 0, 0], [0, 1.0, 0]], (SAMPLES, 1, 1)) / SIDE,
        triangle=np.zeros(SAMPLES, dtype=np.int64),
        from_view=np.ones(SAMPLES, dtype=np.bool_),
    )
    half = 0.5 * SIDE
    grid = Grid.over(np.array([[-half, -half, 0.0], [half, half, half]]), SIDE)
    lift = rays.lift(samples.point, samples.triangle)
    ballot = Ballot(
        samples, lift, grid, rays, count=24, resolution=2048, rng=np.random.default_rng(1)
    )
    votes = ballot.count(np.zeros(SAMPLES)).ravel()
    centre = grid.centres(np.arange(len(grid)))
    distance = np.linalg.norm(centre, axis=-1)
    above = centre[:, 2] > np.sqrt(0.5) * distance
    return distance[above], votes[above]


def test_votes_fall_off_far_slower_than_the_rays_spread() -> None:
    distance, votes = _votes_above_a_small_patch()
    near = votes[(distance > 4.0) & (distance < 5.0)].mean()
    far = votes[(distance > 20.0) & (distance < 22.0)].mean()
    # A cell five times as far meets a 22nd of the rays. Most of that is undone, but not all:
    # the few rays that come far would drown the rest in their noise.
    assert 0.25 < far / near < 1.0
