# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray votes: where a camera would see most of what is not yet seen well (paper III.1.B)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .coverage import LEAST_COSINE, SEEN
from .grid import Grid
from .parallel import in_parts
from .rays import RayCaster
from .samples import Samples

# A sample's rays spread, so a cell at distance d meets them in proportion to 1/d^2, and cells
# close to surfaces would win for no other reason. A vote is multiplied by the distance to this
# power; 2 would undo it all, but then the few rays that come far drown the rest in noise.
SPREAD_POWER = 1.5
# Votes are averaged over about this many cells to either side (standard deviation, in cells).
SMOOTH = 1.0
# Rays end this share of a cell short of the surface: it must not be rounded into the next cell.
SHORT = 1e-3
# Passages weighed at a time by one thread: few enough to stay in a processor's cache.
PASSAGES = 65536
# Candidates are at least this many cells apart.
APART = 3


class Ballot:
    """Rays from all samples through the grid, cast once and weighed anew for each camera.

    The paper shoots rays from the uncovered points in each iteration. The rays' ways do not
    change, so here they are walked once, and a ray's vote in a cell is what its sample would
    gain from a camera there: everything if it is uncovered, and what density a camera at that
    distance would add if it is seen already, but poorly.
    """

    def __init__(
        self,
        samples: Samples,
        lift: NDArray[np.float64],
        grid: Grid,
        rays: RayCaster,
        *,
        count: int,
        resolution: int,
        rng: np.random.Generator,
    ) -> None:
        """`count` rays for each sample; cameras would have `resolution` texels a side."""
        self._samples = samples
        self._grid = grid
        sample = np.repeat(np.arange(len(samples)), count)
        directions = hemisphere_rays(samples, count, rng).reshape(-1, 3)
        origins = samples.point[sample] + lift[sample, None] * samples.normal[sample]
        hits = rays.first_hit(origins, directions)
        passages = grid.traverse(origins, directions, hits.distance - SHORT * grid.cell)
        self._cell = passages.cell.astype(np.intp)
        self._sample = sample[passages.ray].astype(np.int32)
        # The middle of the way through the cell, about: half a cell past its entry.
        distance = passages.distance + np.float32(0.5 * grid.cell)
        # From this far a 90 degree picture's texel is a pixel's footprint.
        useful = (samples.footprint * (0.5 * resolution)).astype(np.float32)
        density = np.minimum(useful[self._sample] / distance, np.float32(1.0))
        self._after = np.float32(SEEN) + np.float32(1.0 - SEEN) * density
        distance /= np.float32(grid.cell)
        weight = samples.weight.astype(np.float32)
        self._weight = weight[self._sample] * distance ** np.float32(SPREAD_POWER)

    def count(self, worth: NDArray[np.float64]) -> NDArray[np.float64]:
        """(X, Y, Z) votes when samples are worth (S,) as they are seen so far."""
        now = worth.astype(np.float32)
        vote = np.empty(len(self._cell))

        def weigh(part: slice) -> None:
            gain = np.maximum(self._after[part] - now[self._sample[part]], np.float32(0.0))
            vote[part] = gain * self._weight[part]

        in_parts(weigh, len(vote), PASSAGES)
        votes = np.bincount(self._cell, weights=vote, minlength=len(self._grid))
        return votes.reshape(self._grid.shape)


def hemisphere_rays(samples: Samples, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(S, count, 3) unit directions, even over the part of the hemisphere that covers.

    A spiral about each normal, turned and shifted at random for each sample. Directions flatter
    than a camera may look from are left out; the paper casts them too.
    """
    step = (np.arange(count) + rng.random((len(samples), 1))) / count
    up = LEAST_COSINE + (1.0 - LEAST_COSINE) * step
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    turn = turn + 2.0 * np.pi * rng.random((len(samples), 1))
    across = np.sqrt(np.maximum(1.0 - up * up, 0.0))
    flat = np.stack([across * np.cos(turn), across * np.sin(turn)], axis=-1)
    return np.asarray(
        np.einsum("sxt,srt->srx", samples.tangents, flat)
        + up[..., None] * samples.normal[:, None, :]
    )


def strongest_cells(votes: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Flat numbers (N,) of up to `count` local maxima of the votes, strongest first.

    Votes are first averaged over neighbours: a cell is far smaller than the region from which
    about the same samples are seen, and so catches few rays. A cell that is not the highest of
    those about it is left to the one that is.
    """
    smooth = ndimage.gaussian_filter(votes, sigma=SMOOTH, mode="constant", truncate=2.0)
    peak = (smooth == ndimage.maximum_filter(smooth, size=2 * APART + 1)) & (smooth > 0.0)
    index = np.flatnonzero(peak)
    order = np.argsort(-smooth.ravel()[index], kind="stable")
    return index[order[:count]]
