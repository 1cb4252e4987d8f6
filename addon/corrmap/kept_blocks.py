# SPDX-License-Identifier: GPL-3.0-or-later
"""Which blocks of the deep framebuffers hold a texel that some view would choose.

Lightspeed (Ragan-Kelley et al. 2007, section 4.2) drops what its one view does not refer to. Here
the views are not known; but the score by which caching cameras compete for a point of a surface
(`glsl/passes/correspondence.glsl`, equation 5) does not depend on the view. So a texel can be
dropped where another camera sees the same surface better. A texel is *beaten* when one other
camera sees its point

- with a score that is better by `MARGIN`, and
- on the same material and in the same plane in nine of its texels, which together cover the
  texel's own ground: then no edge, and nothing in front, makes it lose the point.

What beats a texel has the higher score, so of all that see a point the best is never beaten. A
block is kept when one of its texels, or of those right beside it, hits a surface and is not beaten:
bilinear footprints stay whole.

Of many cameras each picture's texels are tried against the few dozen that would beat most of them
if nothing stood between: every pair of cameras would take time that grows with their square, and
trying fewer only keeps more.

Of each block one texel is tried first, then one in sixteen, then all: most of the blocks that are
kept are found after few texels, and none is dropped before all of its texels are beaten.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..camplace.parallel import in_parts
from ..progress import Progress, silent
from .tile_layout import BLOCK

# How much better the other camera's score has to be. The score is taken at the texel's centre and
# with a normal from differences of depth, but holds for all that reads the texel, up to a texel
# away. A quarter is what the distances or the slopes change within a texel of 1/16 of a distance.
MARGIN = np.float32(1.25)

# As in glsl/lib/tolerances.glsl: a plane is left by half of the distance between texels where the
# surface bends by some 25 degrees; and float32 rounds positions.
_SAME_SURFACE = np.float32(0.5)
_ROUNDING = np.float32(8.0 * 2.0**-23)

# Texels at once: what numpy makes of them stays in the processor's cache.
_PART = 1 << 14

# Other cameras that a picture's texels are tried against, of how many of its texels that is judged,
# and how many of them each texel is to have, if so many would beat it: some are hidden from it.
MOST_RIVALS = 32
_JUDGED = 1024
_RIVALS_EACH = 4

_STRIDES = (BLOCK, BLOCK // 4, 1)

_Floats = NDArray[np.float32]
_Texels = NDArray[np.int64]


@dataclass(frozen=True)
class SeenSurface:
    """What decides over one caching camera's texels.

    Attributes:
        camera: the camera, with its resolution R.
        depth: (R, R) float32, metres along its axis; 0 where nothing is hit.
        material: (R, R) integers, which of the materials.
    """

    camera: CachingCamera
    depth: _Floats
    material: NDArray[np.integer]


def kept_blocks(
    pictures: Sequence[SeenSurface], progress: Progress = silent, *, drop: bool = True
) -> list[NDArray[np.bool_]]:
    """(B, B) for each picture, row 0 at the bottom: whether each block is to be kept.

    Without `drop`, all that hit a surface are.
    """
    if not drop:
        return [_blocks_with(picture.depth > 0.0) for picture in pictures]
    result = []
    for index, picture in enumerate(pictures):
        progress(index / len(pictures), f"Looking for texels to keep: camera {index + 1}")
        others = [other for other in pictures if other is not picture]
        result.append(_kept(picture, others))
    return result


def _kept(picture: SeenSurface, others: Sequence[SeenSurface]) -> NDArray[np.bool_]:
    side = picture.camera.resolution
    blocks = -(-side // BLOCK)
    hit = picture.depth > 0.0
    asked = np.zeros((side, side), dtype=bool)
    worth = np.zeros((side, side), dtype=bool)
    kept = np.zeros((blocks, blocks), dtype=bool)
    likely = np.full((blocks, blocks), -1, dtype=np.int64)
    rivals = _Rivals.of(picture, others).strongest(picture)
    for stride in _STRIDES:
        open_texels = _texels_of(~kept, side)
        if stride == 1:
            open_texels = _grown(open_texels)
        else:
            grid = np.zeros_like(open_texels)
            grid[stride // 2 :: stride, stride // 2 :: stride] = True
            open_texels &= grid
        texels = np.flatnonzero(open_texels & hit & ~asked)
        asked.flat[texels] = True
        row, column = np.divmod(texels, side)
        block = row // BLOCK, column // BLOCK
        winner = _winners(picture, rivals, texels, likely[block])
        worth.flat[texels] = winner < 0
        kept |= _blocks_with(_grown(worth) if stride == 1 else worth)
        # Who has beaten one texel of a block is the likeliest to beat the others.
        likely[block] = winner
    return kept


def _texels_of(blocks: NDArray[np.bool_], side: int) -> NDArray[np.bool_]:
    return blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[:side, :side]


def _blocks_with(texels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    side = len(texels)
    blocks = -(-side // BLOCK)
    whole = np.zeros((blocks * BLOCK, blocks * BLOCK), dtype=bool)
    whole[:side, :side] = texels
    return whole.reshape(blocks, BLOCK, blocks, BLOCK).any(axis=(1, 3))


def _grown(texels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """By one texel to all eight sides."""
    result = texels.copy()
    result[1:] |= texels[:-1]
    result[:-1] |= texels[1:]
    wide = result.copy()
    wide[:, 1:] |= result[:, :-1]
    wide[:, :-1] |= result[:, 1:]
    return wide


@dataclass(frozen=True)
class _Rival:
    """Another camera, and how to come to its axes (right, up, forward) from a picture's own."""

    seen: SeenSurface
    turn: _Floats
    shift: _Floats


@dataclass(frozen=True)
class _Rivals:
    """N other cameras: turns (N, 3, 3) and shifts (N, 3)."""

    seen: Sequence[SeenSurface]
    turn: _Floats
    shift: _Floats

    @classmethod
    def of(cls, picture: SeenSurface, others: Sequence[SeenSurface]) -> _Rivals:
        mine = _axes([picture.camera])[0]
        theirs = _axes([other.camera for other in others])
        apart = [picture.camera.origin - other.camera.origin for other in others]
        shift = np.einsum("nij,nj->ni", theirs, np.reshape(apart, (-1, 3)))
        return cls(others, (theirs @ mine.T).astype(np.float32), shift.astype(np.float32))

    def strongest(self, picture: SeenSurface) -> list[_Rival]:
        """Those worth trying, in their order."""
        chosen: Sequence[int] | _Texels = range(len(self.seen))
        if len(self.seen) > MOST_RIVALS:
            hit = np.flatnonzero(picture.depth.ravel() > 0.0)
            would_beat = self._would_beat(picture, hit[:: max(1, len(hit) // _JUDGED)])
            chosen = np.sort(_covering(would_beat))
        return [_Rival(self.seen[n], self.turn[n], self.shift[n]) for n in chosen]

    def _would_beat(self, picture: SeenSurface, texels: _Texels) -> NDArray[np.bool_]:
        """(N, K) whether each camera's score is better at some texels' places, seen or not."""
        with np.errstate(all="ignore"):
            place, normal = _surface(picture, texels)
            least = MARGIN * _score(picture.camera, place, normal)
            there = self.turn @ place + self.shift[:, :, None]
            across = self.turn @ normal
            squared = (there * there).sum(axis=1)
            facing = -(there * across).sum(axis=1) / np.sqrt(squared)
            cameras = [other.camera for other in self.seen]
            extent = np.array([camera.half_extent for camera in cameras], dtype=np.float32)
            density = np.array([0.5 * camera.resolution for camera in cameras]) / extent
            score = facing * (density.astype(np.float32) ** 2)[:, None] / squared
            reach = there[:, 2] * extent[:, None]
            inside = (np.abs(there[:, 0]) < reach) & (np.abs(there[:, 1]) < reach)
            # Of one whose own score is wrong nothing is better.
            return np.asarray(inside & (score > least) & (least > 0.0))


def _covering(would_beat: NDArray[np.bool_]) -> list[int]:
    """`MOST_RIVALS` of N cameras, one after the other that which is the most use to (N, K) texels
    that have not `_RIVALS_EACH` of them yet."""
    beats = would_beat.astype(np.float32)
    wanted = np.full(beats.shape[1], _RIVALS_EACH, dtype=np.float32)
    chosen: list[int] = []
    for _ in range(MOST_RIVALS):
        use = beats @ (wanted > 0.0).astype(np.float32)
        use[chosen] = -1.0
        best = int(use.argmax())
        chosen.append(best)
        wanted -= beats[best]
    return chosen


def _axes(cameras: Sequence[CachingCamera]) -> NDArray[np.float64]:
    """(N, 3, 3): right, up and forward in rows."""
    turns = [camera.world_from_camera[:3, :3].T for camera in cameras]
    rows = np.array(turns, dtype=np.float64).reshape(-1, 3, 3)
    rows[:, 2] *= -1.0
    return rows


def _winners(
    picture: SeenSurface, rivals: Sequence[_Rival], texels: _Texels, likely: _Texels
) -> _Texels:
    """(K,) the number of a rival that beats each texel, -1 where none does.

    Args:
        picture: whose texels are asked about.
        rivals: the other cameras.
        texels: (K,) by their flat index.
        likely: (K,) a rival to be tried first, or -1. Another one may come out where several beat
            a texel, but not whether any does.
    """
    winner = np.full(len(texels), -1, dtype=np.int64)

    def work(part: slice) -> None:
        some, found, first = texels[part], winner[part], likely[part]
        # A normal that cannot be told is not a number, which wins no comparison.
        with np.errstate(all="ignore"):
            place, normal = _surface(picture, some)
            score = _score(picture.camera, place, normal)
            points = _Points(place, normal, score, picture.material.ravel()[some])

            def contest(number: int, left: _Texels) -> None:
                found[_beaten_by(rivals[number], points, left)] = number

            for number in np.unique(first[first >= 0]):
                contest(int(number), np.flatnonzero(first == number))
            for number in range(len(rivals)):
                left = np.flatnonzero((found < 0) & (first != number))
                if len(left):
                    contest(number, left)

    in_parts(work, len(texels), _PART)
    return winner


def _surface(picture: SeenSurface, texels: _Texels) -> tuple[_Floats, _Floats]:
    """(3, K) places and unit normals toward the camera, in its axes; not a number where the
    surface has no neighbour in the picture to tell the normal.

    In a picture the inverse depth of a plane is linear: with slopes a and b along x = X / Z and
    y = Y / Z, its normal is (a, b, 1 / Z - a x - b y). Of the differences to both sides the
    smaller is taken: the greater may lead over an edge.
    """
    camera = picture.camera
    side = camera.resolution
    step = np.float32(2.0 * camera.half_extent / side)
    row, column = np.divmod(texels, side)
    x, y = (
        (axis.astype(np.float32) + np.float32(0.5 - 0.5 * side)) * step for axis in (column, row)
    )
    depth = picture.depth.ravel()
    z = depth[texels]
    inverse = 1.0 / z

    def slope(position: _Texels, stride: int) -> _Floats:
        before = depth[np.where(position > 0, texels - stride, texels)]
        after = depth[np.where(position < side - 1, texels + stride, texels)]
        rises = []
        for neighbour, exists, sign in (
            (before, (position > 0) & (before > 0.0), -1.0),
            (after, (position < side - 1) & (after > 0.0), 1.0),
        ):
            rise = np.float32(sign) * (1.0 / neighbour - inverse) / step
            rises.append(np.where(exists, rise, np.float32(np.inf)))
        least = np.where(np.abs(rises[0]) < np.abs(rises[1]), rises[0], rises[1])
        return np.where(np.isinf(least), np.float32(np.nan), least)

    a, b = slope(column, 1), slope(row, side)
    normal = -np.stack([a, b, inverse - a * x - b * y])
    normal /= np.sqrt((normal * normal).sum(axis=0))
    return np.stack([x * z, y * z, z]), normal


def _score(camera: CachingCamera, place: _Floats, normal: _Floats) -> _Floats:
    """Equation 5 with the density of texels, as the search has it, of a footprint seen whole."""
    squared = (place * place).sum(axis=0)
    facing = -(place * normal).sum(axis=0) / np.sqrt(squared)
    density = np.float32(0.5 * camera.resolution / camera.half_extent)
    return facing * density * density / squared


@dataclass(frozen=True)
class _Points:
    """K points of a picture: places and normals (3, K) in its own axes, scores and materials."""

    place: _Floats
    normal: _Floats
    score: _Floats
    material: NDArray[np.integer]


def _beaten_by(rival: _Rival, points: _Points, left: _Texels) -> _Texels:
    """Which of the points, of those in `left`, the rival sees better."""
    camera = rival.seen.camera
    side = camera.resolution
    extent = np.float32(camera.half_extent)
    there = rival.turn @ points.place[:, left] + rival.shift[:, None]
    reach = there[2] * extent
    # Beside the picture's edge nine texels leave the picture in any case.
    seen = np.flatnonzero((np.abs(there[0]) < reach) & (np.abs(there[1]) < reach))
    left, there = left[seen], there[:, seen]
    across = rival.turn @ points.normal[:, left]
    ratio = _score(camera, there, across) / points.score[left]
    # A picture's own score is above zero, unless its normal is wrong: then this is negative.
    better = ratio > MARGIN
    left, there, across, ratio = left[better], there[:, better], across[:, better], ratio[better]
    if not len(left):
        return left
    # Texels of the rival's from each of the nine to the next: half of those in the texel's width.
    spacing = np.maximum(np.rint(0.5 * np.sqrt(ratio)), 1.0).astype(np.int64)
    reach = there[2] * extent
    column, row = (
        np.floor((there[axis] / reach * 0.5 + 0.5) * side).astype(np.int64) for axis in (0, 1)
    )
    inside = np.flatnonzero(
        (np.minimum(column, row) >= spacing) & (np.maximum(column, row) + spacing < side)
    )
    left, there, across, ratio = left[inside], there[:, inside], across[:, inside], ratio[inside]
    nine = _Nine(row[inside], column[inside], spacing[inside])
    size = np.sqrt((points.place[:, left] ** 2).sum(axis=0)) + np.sqrt((there * there).sum(axis=0))
    width = np.float32(2.0 / side) * reach[inside]
    bound = _SAME_SURFACE * width * nine.spacing + _ROUNDING * size
    worst = _farthest(rival.seen, nine, there, across, points.material[left])
    # The search takes off as much from the score where the surface leaves the plane.
    return left[ratio * (1.0 - worst / bound) > MARGIN]


@dataclass(frozen=True)
class _Nine:
    """Nine texels for each of K points, all of them in the picture: the middle one, and how many
    texels it is from each to the next."""

    row: _Texels
    column: _Texels
    spacing: _Texels


def _farthest(
    seen: SeenSurface,
    nine: _Nine,
    there: _Floats,
    across: _Floats,
    material: NDArray[np.integer],
) -> _Floats:
    """(K,) how far the farthest of nine texels lies off a point's plane, in metres; infinite where
    one hits nothing or shows another material."""
    side = seen.camera.resolution
    step = np.float32(2.0 * seen.camera.half_extent / side)
    offset = np.float32(0.5 - 0.5 * side)
    depths, materials = seen.depth.ravel(), seen.material.ravel()
    plane = (across * there).sum(axis=0)
    middle = nine.row * side + nine.column
    # A direction's part along the normal, at depth 1, and what it changes from texel to texel.
    x, y = ((axis.astype(np.float32) + offset) * step for axis in (nine.column, nine.row))
    along = across[0] * x + across[1] * y + across[2]
    aside, up = (across[axis] * (step * nine.spacing.astype(np.float32)) for axis in (0, 1))
    worst = np.zeros(len(middle), dtype=np.float32)
    own = np.ones(len(middle), dtype=bool)
    for j in (-1, 0, 1):
        for i in (-1, 0, 1):
            texel = middle + (j * side + i) * nine.spacing
            depth = depths[texel]
            direction = along + np.float32(i) * aside + np.float32(j) * up
            np.maximum(worst, np.abs(depth * direction - plane), out=worst)
            own &= (depth > 0.0) & (materials[texel] == material)
    return np.where(own, worst, np.float32(np.inf))
