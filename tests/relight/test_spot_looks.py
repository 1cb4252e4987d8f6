# SPDX-License-Identifier: GPL-3.0-or-later
"""Which spots pixels look at, with shadows that are told instead of traced."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.relight.light_points.light_cells import SPOTS, quarters, square_cells, unit_spots
from addon.relight.shadows.spot_looks import PixelPlaces, Reach, look_at_spots

Array = NDArray[np.int64]


def places(height: int, width: int, with_neighbours: int | None = None) -> PixelPlaces:
    row, column = (each.ravel() for each in np.indices((height, width)))
    return PixelPlaces(row, column, (height, width), with_neighbours)


def told(is_open: NDArray[np.bool_], above: NDArray[np.bool_], asked: list[int]) -> Reach:
    """Answers from tables (N, SPOTS) of what is open and what is above."""

    def reach(rows: Array, spots: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        asked.append(len(rows))
        return is_open[rows, spots] & above[rows, spots], above[rows, spots]

    return reach


def bits(spots: Array) -> NDArray[np.bool_]:
    """(N, SPOTS)."""
    return ((spots[:, None] >> np.arange(SPOTS)) & 1).astype(np.bool_)


def edge(pixels: PixelPlaces) -> NDArray[np.bool_]:
    """(N, SPOTS) of a penumbra about column 10, four pixels wide."""
    reaches = (pixels.column - 8.0) / 4.0
    return np.asarray(unit_spots()[:, 0] < reaches[:, None])


def test_spots_are_one_in_each_sixteenth() -> None:
    """And any four that begin at a multiple of four, turned by any number, one in each quarter."""
    spots = unit_spots()
    assert len({*map(tuple, np.floor(spots * 4).astype(int).tolist())}) == SPOTS
    for turn in range(SPOTS):
        order = quarters()[np.arange(SPOTS) ^ turn].reshape(4, 4)
        assert (np.sort(order, axis=1) == np.arange(4)).all()
    for cell in square_cells(7):
        low, high = cell.corners.min(axis=0), cell.corners.max(axis=0)
        assert ((cell.spots > low) & (cell.spots < high)).all()


def test_a_penumbra_is_looked_at_and_nothing_else() -> None:
    pixels, asked = places(24, 24), list[int]()
    is_open = edge(pixels)
    got = bits(look_at_spots(told(is_open, np.ones_like(is_open), asked), pixels, 0.5))
    # What differs by a spot or two from all or none may be missed where no pixel nearby says so.
    clear = np.isin(is_open.sum(axis=1), [0, SPOTS]) | (np.abs(is_open.mean(axis=1) - 0.5) < 0.3)
    assert (got == is_open)[clear].all()
    assert np.abs(got.mean(axis=1) - is_open.mean(axis=1)).max() < 0.2
    # A look of all, four of nine columns at the most, and all of seven.
    assert asked[0] == 24 * 24
    assert sum(asked) <= 24 * (24 + 3 * 9 + 12 * 7)


def test_four_spots_stand_for_their_quarters() -> None:
    """Where too much is in parts: nothing but quarters of what is seen, and the right mean."""
    pixels, asked = places(24, 24), list[int]()
    is_open = edge(pixels)
    got = bits(look_at_spots(told(is_open, np.ones_like(is_open), asked), pixels, 0.0))
    for number in range(4):
        inside = got[:, quarters() == number]
        assert (inside.all(axis=1) | ~inside.any(axis=1)).all()
    assert np.abs(got.mean() - is_open.mean()) < 0.01
    assert len(asked) == 2


def test_pixels_without_neighbours_look_at_four() -> None:
    pixels, asked = places(8, 8, with_neighbours=6), list[int]()
    is_open = np.ones((64, SPOTS), dtype=np.bool_)
    look_at_spots(told(is_open, is_open, asked), pixels, 0.5)
    assert asked == [64, 16 * 3, 0]


def test_spots_below_the_horizon_have_no_say() -> None:
    """A surface that the light's cell sets behind sees all of what is above."""
    pixels, asked = places(8, 8), list[int]()
    above = np.broadcast_to(unit_spots()[:, 1] > 0.6, (64, SPOTS))
    got = look_at_spots(told(np.ones_like(above), above, asked), pixels, 0.5)
    assert (bits(got).all(axis=1)).all()
