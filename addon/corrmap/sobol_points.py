# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that fill a square evenly, however many of them are taken.

Sobol's sequence in two dimensions, of which the first 2^m points have one in every cell of any grid
of 2^m equal rectangles whose sides are powers of two; with nested uniform ("Owen") scrambling by
a hash (Burley 2020: "Practical Hash-based Owen Scrambling", section 3), which keeps that and takes
away that every point lies at its cell's lower corner.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Bits = NDArray[np.uint32]

# Of the first twenty thousand seeds one whose first 16, 32, 64 points have the mean, the variance
# and the covariance of Blender's default pixel filter most nearly: a mean that is off moves the
# picture, a variance that is off makes it sharper or softer.
_SEED = 2980
# Of the first eight one with which edges of shadows are least off, of several directions and
# widths.
_SEED_AROUND = 2
_HALF = np.uint32(1 << 31)
# Laine, Karras (2011), with the constants of Burley's listing 2.
_HASH = (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6)


# A view asks for the same points again and again, one by one.
@lru_cache(maxsize=1024)
def sobol_points(count: int, first: int = 0) -> NDArray[np.float64]:
    """(count, 2) float64 in [0, 1): the points from `first` on; point 0 is the square's centre."""
    # Flipping the same bits of all points takes cells to cells.
    return _in_square(_turned(np.arange(first, first + count), _SEED) ^ _HALF)


@lru_cache(maxsize=1024)
def sobol_points_around(number: int, count: int) -> NDArray[np.float64]:
    """(count, 2) float64 in [0, 1): point `number` of the above, and others.

    Of each number they are as even as the sequence's first ones; so are the first of all numbers,
    the second of all, and so on. All together are more points than there are numbers.
    """
    # Turned as a whole by the numbers' points, or these by them.
    own = _turned(np.array([number]), _SEED) ^ _HALF
    return _in_square(own ^ _turned(np.arange(count), _SEED_AROUND))


def _turned(index: NDArray[np.integer], seed: int) -> Bits:
    """(N, 2): scrambled points, flipped so that point 0 lies at the origin."""
    known: Bits = np.concatenate([[0], index]).astype(np.uint32)
    axes = zip(sobol_bits(known).T, (seed, seed * 7919 + 13), strict=True)
    points = np.stack([_scrambled(bits, each) for bits, each in axes], axis=1)
    return np.asarray(points[1:] ^ points[0])


def _in_square(bits: Bits) -> NDArray[np.float64]:
    found = np.asarray(bits / 2.0**32)
    found.flags.writeable = False
    return found


def sobol_bits(index: Bits) -> Bits:
    """(N, 2): points of the sequence itself by their numbers (N,), in units of 2^-32."""
    return np.stack([_reversed(index), _second(index)], axis=1)


def _reversed(bits: Bits) -> Bits:
    """The first dimension: the index with its bits in reverse order (van der Corput)."""
    result = np.zeros_like(bits)
    for place in range(32):
        result |= ((bits >> np.uint32(place)) & np.uint32(1)) << np.uint32(31 - place)
    return result


def _second(index: Bits) -> Bits:
    """The second dimension, whose direction numbers are those of the polynomial x + 1."""
    result, direction = np.zeros_like(index), 1 << 31
    for place in range(32):
        is_set = (index >> np.uint32(place)) & np.uint32(1)
        result ^= is_set * np.uint32(direction)
        direction ^= direction >> 1
    return result


def _scrambled(bits: Bits, seed: int) -> Bits:
    """Each bit flipped or not by a hash of those above it."""
    # Modulo 2^32, as wanted.
    with np.errstate(over="ignore"):
        value = _reversed(bits) + np.uint32(seed & 0xFFFFFFFF)
        for constant in _HASH:
            value ^= value * np.uint32(constant)
    return _reversed(value)
