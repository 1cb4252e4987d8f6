# SPDX-License-Identifier: GPL-3.0-or-later
"""How much smaller a picture is drawn while the camera moves, so that it keeps to a time."""

from __future__ import annotations

import math
from dataclasses import replace

from ..scene.view import View

# View pixels along the side of a drawn one. With the last a picture of 1920x1080 has 240x135.
DIVISORS = (1, 2, 3, 4, 6, 8)
# A finer picture is tried where it is expected to take at most this share of the budget, in so
# many pictures one after the other: else the picture would jump between two sizes.
ROOM = 0.75
PATIENCE = 3
# The share of a new measurement in what is expected; less would follow a change too slowly, more
# every hiccup of the machine.
FOLLOW = 0.5
# What a size took is forgotten after so many pictures of other sizes: the scene may have changed.
MEMORY = 240


def smaller(view: View, divisor: int) -> View:
    """The same camera with fewer pixels; they cover the same part of the scene.

    Where the size cannot be divided, pixels are a little wider or higher than they were.
    """
    width, height = (-(-size // divisor) for size in (view.width, view.height))
    return replace(view, width=width, height=height)


class MoveBudget:
    """Learns from the pictures of a moving view how large the next one may be.

    A picture's time has a part that goes with its pixels and one that does not (triangles, calls),
    and neither is known. So a size that was drawn is expected to take what it took; one that was
    not, what the nearest drawn one took for each pixel. That is too much for a finer picture and
    too little for a coarser one, which the next picture then shows. When pictures of one size
    change their time, as another light would, all others are expected to change likewise.
    """

    def __init__(self) -> None:
        self._seconds: dict[int, float] = {}
        self._drawn_at: dict[int, int] = {}
        self._count = 0
        self._divisor = 1
        self._agreed = 0
        self._pixels = 0

    @property
    def divisor(self) -> int:
        """What was chosen last."""
        return self._divisor

    def expected(self, divisor: int) -> float | None:
        """Seconds that a picture takes; None before any was drawn."""
        if not self._seconds:
            return None
        near = min(self._seconds, key=lambda drawn: abs(math.log(drawn / divisor)))
        return self._seconds[near] * (near / divisor) ** 2

    def took(self, divisor: int, seconds: float) -> None:
        """A picture of a moving view took so long, from its camera to the screen."""
        self._count += 1
        self._drawn_at[divisor] = self._count
        self._seconds = {
            drawn: known
            for drawn, known in self._seconds.items()
            if self._count - self._drawn_at[drawn] < MEMORY
        }
        before = self._seconds.get(divisor)
        if before is None:
            self._seconds[divisor] = seconds
            return
        now = before + FOLLOW * (seconds - before)
        change = now / before if before > 0.0 else 1.0
        self._seconds = {drawn: change * known for drawn, known in self._seconds.items()}
        self._seconds[divisor] = now

    def choose(self, budget_s: float, pixels: int) -> int:
        """The divisor of the next picture.

        Args:
            budget_s: seconds that it may take; 0 for as long as the full picture takes.
            pixels: of the full picture.
        """
        if budget_s <= 0.0:
            self._divisor = 1
            return 1
        self._follow_size(pixels)
        if self._is_over(self._divisor, budget_s):
            self._agreed = 0
            coarser = [d for d in DIVISORS if d > self._divisor]
            enough = [d for d in coarser if not self._is_over(d, budget_s)]
            self._divisor = (enough or coarser[-1:] or [self._divisor])[0]
            return self._divisor
        finer = [d for d in DIVISORS if d < self._divisor]
        if finer and not self._is_over(finer[-1], ROOM * budget_s):
            self._agreed += 1
            if self._agreed >= PATIENCE:
                self._agreed, self._divisor = 0, finer[-1]
        else:
            self._agreed = 0
        return self._divisor

    def _is_over(self, divisor: int, budget_s: float) -> bool:
        expected = self.expected(divisor)
        return expected is not None and expected > budget_s

    def _follow_size(self, pixels: int) -> None:
        """Another size of the view makes all pictures cheaper or dearer."""
        if self._pixels and pixels != self._pixels:
            factor = pixels / self._pixels
            self._seconds = {d: factor * known for d, known in self._seconds.items()}
        self._pixels = pixels
